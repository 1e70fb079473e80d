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
  const std::string a = folder / "a", b = folder / "b", link = folder / "link";
  OutputFile(a).commit();
  check_outputs({{"-o", b}, {"--csv", link}, {"--html", ""}}, {{"A", a}, {"B", ""}});
  refuses({{"-o", a}}, {{"A", a}}, "the file of A as that of -o");
  refuses({{"-o", b}, {"--csv", a}}, {{"A", a}}, "the file of A as that of --csv");
  refuses({{"-o", b}, {"--csv", folder / "none/../b"}}, {}, "one file for both -o and --csv");
  std::filesystem::create_symlink("b", link);
  refuses({{"-o", b}, {"--csv", link}}, {}, "one file for both -o and --csv");
  std::filesystem::create_hard_link(a, folder / "hard");
  refuses({{"-o", folder / "hard"}}, {{"A", a}}, "the file of A");
  EXPECT_FALSE(std::filesystem::exists(b)) << "refused, and made";
}

TEST(Outputs, AreWritable) {
  const Folder folder;
  refuses({{"-o", folder / "none/a"}}, {}, "which is not a folder");
  refuses({{"-o", folder / "."}}, {}, "a directory");
  std::filesystem::create_symlink("round", folder / "round");
  refuses({{"-o", folder / "round"}}, {}, "links");
  OutputFile(folder / "file").commit();
  refuses({{"-o", folder / "file/a"}}, {}, "");
}

#ifndef _WIN32
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
