#include "capture/create_file.hpp"

#include <cerrno>

#include "capture/folder.hpp"

namespace throng::tests {
namespace {

class CreateFile : public CaptureTest {};

TEST_F(CreateFile, LeavesAnExistingFileAsItIs) {
  const std::string path = folder_ + "/one";
  std::FILE* const file = capture::create_file(path.c_str());
  ASSERT_NE(file, nullptr);
  EXPECT_GE(std::fputs("a\nb", file), 0);
  EXPECT_EQ(std::fclose(file), 0);
  errno = 0;
  EXPECT_EQ(capture::create_file(path.c_str()), nullptr);
  EXPECT_EQ(errno, EEXIST);
  EXPECT_EQ(last_bytes(), "a\nb");
}

TEST_F(CreateFile, NeedsItsFolder) {
  errno = 0;
  EXPECT_EQ(capture::create_file((folder_ + "/none/one").c_str()), nullptr);
  EXPECT_EQ(errno, ENOENT);
}

}  // namespace
}  // namespace throng::tests
