// Checks of output files before writing.
#include <gtest/gtest.h>
#ifndef _WIN32
#include <sys/stat.h>
#endif

#include "apps/scenes/npy.hpp"
#include "apps/scenes/output_file.hpp"
#include "npy_bytes.hpp"

namespace throng::scenes {
namespace {

using npy_bytes::Folder;

void refuses(const std::vector<NamedFile>& outputs, const std::vector<NamedFile>& inputs,
             const std::string& word) {
  try {
    check_outputs(outputs, inputs);
    FAIL() << "not refused: " << word;
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
  }
}

TEST(Outputs, MustDiffer) {
  const Folder folder;
  const std::string a = folder / "a", b = folder / "b", c = folder / "c";
  OutputFile(a).commit();
  check_outputs({{"-o", b}, {"--csv", c}, {"--html", ""}}, {{"A", a}, {"B", ""}});
  refuses({{"-o", a}}, {{"A", a}}, "the file of A as that of -o");
  refuses({{"-o", b}, {"--csv", a}}, {{"A", a}}, "the file of A as that of --csv");
  refuses({{"-o", b}, {"--csv", folder / "none/../b"}}, {}, "one file for both -o and --csv");
  std::filesystem::create_hard_link(a, folder / "hard");
  refuses({{"-o", folder / "hard"}}, {{"A", a}}, "the file of A");
  EXPECT_FALSE(std::filesystem::exists(b)) << "refused, and made";
}

TEST(Outputs, AreWritable) {
  const Folder folder;
  refuses({{"-o", folder / "none/a"}}, {}, "which is not a folder");
  refuses({{"-o", folder / "."}}, {}, "a directory");
  OutputFile(folder / "file").commit();
  refuses({{"-o", folder / "file/a"}}, {}, "");
}

#ifndef _WIN32
TEST(Outputs, LinksAreFollowed) {
  const Folder folder;
  const std::string target = folder / "target", link = folder / "link", round = folder / "round";
  check_outputs({{"-o", target}, {"--csv", link}});
  std::filesystem::create_symlink("target", link);
  refuses({{"-o", target}, {"--csv", link}}, {}, "one file for both -o and --csv");
  EXPECT_FALSE(std::filesystem::exists(target)) << "refused, and made";
  std::filesystem::create_symlink("round", round);
  refuses({{"-o", round}}, {}, "links");
}

// Opening a pipe would wait for its reader.
TEST(Outputs, PipesAreNotOpened) {
  const Folder folder;
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  check_outputs({{"-o", pipe}, {"--csv", "/dev/null"}, {"--html", "/dev/null"}});
  EXPECT_EQ(output_target(pipe), "");
}
#endif

}  // namespace
}  // namespace throng::scenes
