// Writing .npy: the bytes, and the files on disk after a failure.
#include <gtest/gtest.h>
#ifndef _WIN32
#include <sys/resource.h>
#include <sys/stat.h>
#endif

#include <csignal>

#include <throng/checksum.hpp>

#include "apps/scenes/npy.hpp"
#include "npy_bytes.hpp"

namespace throng::scenes {
namespace {

using npy_bytes::Folder;
using npy_bytes::raw;

std::vector<Box> some_boxes(std::size_t n) {
  std::vector<Box> boxes(n);
  for (std::size_t i = 0; i < n; ++i) {
    const float v = static_cast<float>(i);
    boxes[i] = {{v, -v, 0.5f}, {v + 1, 1, 0x1p-149f}};
  }
  return boxes;
}

// As written by NumPy's np.save.
std::string numpy_header(const std::string& descr, const std::string& shape) {
  std::string h = "{'descr': '" + descr + "', 'fortran_order': False, 'shape': " + shape + ", }";
  h.resize(117, ' ');
  return npy_bytes::preamble(1, 118) + h + "\n";
}

bool same(const Box* a, const Box* b, std::size_t n) {
  return n == 0 || std::memcmp(a, b, n * sizeof(Box)) == 0;
}

TEST(Write, BytesAreNumPys) {
  const Folder folder;
  const std::vector<Box> boxes = some_boxes(2);
  write_boxes(folder / "b.npy", boxes.data(), 1, 2);
  EXPECT_EQ(folder.get("b.npy"), numpy_header("<f4", "(2, 6)") + raw(boxes));
  const std::vector<Pair> pairs = {{1, 2}, {0xfffffffe, 3}};
  write_pairs(folder / "p.npy", pairs.data(), 2);
  EXPECT_EQ(folder.get("p.npy"), numpy_header("<u4", "(2, 2)") + raw(pairs));
  const std::vector<std::int32_t> worlds = {-1, 7};
  write_i32(folder / "w.npy", worlds.data(), 2);
  EXPECT_EQ(folder.get("w.npy"), numpy_header("<i4", "(2,)") + raw(worlds));
  EXPECT_EQ(folder.entries(), 3u);
}

TEST(Write, RoundTrips) {
  const Folder folder;
  const std::string path = folder / "f.npy";
  const std::vector<Box> boxes = some_boxes(60);
  for (std::size_t frames : {1, 3}) {
    for (std::size_t count : {0, 1, 20}) {
      write_boxes(path, boxes.data(), frames, count);
      const BoxFile back = read_boxes(path);
      ASSERT_EQ(back.frames, frames);
      ASSERT_EQ(back.count, count);
      EXPECT_TRUE(same(back.boxes.get(), boxes.data(), frames * count));
    }
  }
  const std::vector<std::uint32_t> u = {0, 0xffffffff};
  const std::vector<std::int32_t> i = {-2147483647 - 1, 2147483647};
  const std::vector<std::uint8_t> b = {0, 255};
  write_u32(path, u.data(), 2);
  EXPECT_EQ(read_u32(path, 2), u);
  write_i32(path, i.data(), 2);
  EXPECT_EQ(read_i32(path, 2), i);
  write_u8(path, b.data(), 2);
  EXPECT_EQ(read_u8(path, 2), b);
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(Write, FramesOneByOne) {
  const Folder folder;
  const std::vector<Box> boxes = some_boxes(30);
  BoxWriter writer(folder / "f.npy", 3, 10);
  writer.write(boxes.data(), 10);
  writer.write(boxes.data() + 10, 5);
  writer.write(boxes.data() + 15, 15);
  EXPECT_FALSE(std::filesystem::exists(folder / "f.npy")) << "not before it is complete";
  EXPECT_THROW(writer.write(boxes.data(), 1), FileError);
  writer.finish();
  EXPECT_TRUE(same(read_boxes(folder / "f.npy").frame(0), boxes.data(), 30));
  EXPECT_THROW(writer.finish(), FileError);
}

TEST(Write, PairsInBlocks) {
  const Folder folder;
  std::vector<Pair> pairs(100000);
  for (std::uint32_t i = 0; i < pairs.size(); ++i) pairs[i] = {i, i + 1};
  PairWriter writer(folder / "p.npy");
  writer.write(pairs.data(), 1);
  writer.write(pairs.data() + 1, pairs.size() - 1);
  EXPECT_EQ(writer.count(), 100000u);
  writer.finish();
  EXPECT_EQ(folder.get("p.npy"), numpy_header("<u4", "(100000, 2)") + raw(pairs));
  PairWriter none(folder / "none.npy");
  none.finish();
  EXPECT_EQ(folder.get("none.npy"), numpy_header("<u4", "(0, 2)"));
}

TEST(Write, AbandonedKeepsTheOldFile) {
  const Folder folder;
  folder.put("f.npy", "old");
  const std::vector<Box> boxes = some_boxes(10);
  {
    BoxWriter writer(folder / "f.npy", 1, 10);
    writer.write(boxes.data(), 9);
    EXPECT_EQ(folder.entries(), 2u);
    EXPECT_THROW(writer.finish(), FileError) << "a box is missing";
  }
  EXPECT_EQ(folder.entries(), 1u);
  try {
    PairWriter writer(folder / "f.npy");
    throw 1;
  } catch (int) {
  }
  EXPECT_EQ(folder.entries(), 1u);
  EXPECT_EQ(folder.get("f.npy"), "old");
}

void expect_refused(const std::string& path, const char* message_part) {
  const std::vector<Pair> pairs(200000, Pair{1, 2});
  try {
    write_pairs(path, pairs.data(), pairs.size());
    FAIL() << path << " was written";
  } catch (const FileError& e) {
    const std::string said = e.what();
    EXPECT_EQ(said.rfind(path + ": found ", 0), 0u) << said;
    EXPECT_NE(said.find(message_part), std::string::npos) << said;
  }
}

TEST(Write, UnwritableTargets) {
  const Folder folder;
  expect_refused(folder / "missing/p.npy", "No such file or directory");
  expect_refused(folder / ".", "a directory");
  folder.put("file", "");
  expect_refused(folder / "file/p.npy", "directory");
  expect_refused("/proc/p.npy", "");
  EXPECT_EQ(folder.entries(), 1u);
  EXPECT_THROW(write_pairs("", nullptr, 0), FileError);
}

#ifndef _WIN32
TEST(Write, FolderWithoutPermission) {
  const Folder folder;
  folder.put("f.npy", "old");
  ASSERT_EQ(chmod((folder / ".").c_str(), 0500), 0);
  if (access((folder / ".").c_str(), W_OK) == 0) GTEST_SKIP() << "this user may write anywhere";
  expect_refused(folder / "f.npy", "Permission denied");
  ASSERT_EQ(chmod((folder / ".").c_str(), 0700), 0);
  EXPECT_EQ(folder.get("f.npy"), "old");
}

TEST(Write, FullDevice) {
  struct stat info;
  if (stat("/dev/full", &info) != 0 || !S_ISCHR(info.st_mode)) GTEST_SKIP() << "no /dev/full";
  expect_refused("/dev/full", "No space left on device");
  // Few bytes: they fit in the buffer, and only the flush fails.
  EXPECT_THROW(write_pairs("/dev/full", nullptr, 0), FileError);
  PairWriter writer("/dev/full");
  EXPECT_THROW(writer.finish(), FileError);
  ASSERT_EQ(stat("/dev/full", &info), 0);
  EXPECT_TRUE(S_ISCHR(info.st_mode)) << "a device is written to, never replaced";
}

TEST(Write, DiskFullHalfWay) {
  const Folder folder;
  folder.put("p.npy", "old");
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small = {100000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  expect_refused(folder / "p.npy", "File too large");
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(folder.entries(), 1u);
  EXPECT_EQ(folder.get("p.npy"), "old");
}

TEST(Write, ALinkStays) {
  const Folder folder;
  folder.put("real.npy", "old");
  std::filesystem::create_symlink(folder / "real.npy", folder / "link.npy");
  write_pairs(folder / "link.npy", nullptr, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.npy"));
  EXPECT_EQ(folder.get("real.npy"), numpy_header("<u4", "(0, 2)"));
}
#endif

TEST(Checksum, OfPairs) {
  // The first outputs of splitmix64 from state 0 are well known.
  EXPECT_EQ(mix64(0), 0xe220a8397b1dcdafull);
  EXPECT_EQ(mix64(0x9e3779b97f4a7c15ull), 0x6e789e6aa1b965f4ull);
  const Pair pairs[] = {{0, 1}, {2, 3}};
  const Pair turned[] = {{2, 3}, {0, 1}};
  EXPECT_EQ(pair_checksum(pairs, 0), 0u);
  EXPECT_EQ(pair_checksum(pairs, 2), mix64(1) + mix64((2ull << 32) + 3));
  EXPECT_EQ(pair_checksum(pairs, 2), pair_checksum(turned, 2));
}

}  // namespace
}  // namespace throng::scenes
