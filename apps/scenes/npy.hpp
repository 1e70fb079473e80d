// Boxes, pairs and filters in NumPy's .npy files.
//
// Boxes are float32, (n, 6) for one frame or (frames, n, 6); also (n, 2, 3), lower and upper
// corners. 2-D boxes have 4 for 6 and 2 for 3; their z is 0. Accepts either byte order, C and
// Fortran order, and float64 whose every value is a float32; integers are refused. Every failure is
// a FileError; a header's sizes are checked against the file before use.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <throng/types.hpp>

namespace throng::scenes {

// what() names the file, what was found, and what is wanted.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// All frames of a file, in memory.
struct BoxFile {
  std::size_t frames = 0;
  std::size_t count = 0;  // boxes in each frame
  bool is_flat = false;   // 2-D boxes
  std::unique_ptr<Box[]> boxes;

  const Box* frame(std::size_t f) const noexcept { return boxes.get() + f * count; }
};

// With round_outward other float64 are rounded: lower corners down, upper corners up; without it
// they are refused. NaN and inverted boxes are passed through: the library handles them.
BoxFile read_boxes(const std::string& path, bool round_outward = false);
// The same from the bytes of a file; `name` is for messages.
BoxFile parse_boxes(const unsigned char* data, std::size_t size, const std::string& name,
                    bool round_outward = false);

class NpyBytes;

// The same in parts, read on demand: for files larger than memory. Conversion takes about 200 KB
// more.
class BoxReader {
 public:
  explicit BoxReader(const std::string& path, bool round_outward = false);
  BoxReader(std::unique_ptr<NpyBytes> bytes, const std::string& name, bool round_outward);
  ~BoxReader();
  BoxReader(BoxReader&&) noexcept;
  BoxReader& operator=(BoxReader&&) noexcept;

  std::size_t frames() const noexcept { return frames_; }
  std::size_t count() const noexcept { return count_; }  // boxes in each frame
  bool is_flat() const noexcept;
  // Boxes begin .. begin+count-1 of a frame.
  void read(std::size_t frame, std::size_t begin, std::size_t count, Box* out);

 private:
  template <class T>
  void convert(std::size_t frame, std::size_t begin, std::size_t count, Box* out);

  std::unique_ptr<NpyBytes> bytes_;
  std::string name_;
  bool round_outward_;
  std::size_t frames_ = 0, count_ = 0;
  std::vector<unsigned char> staged_;
};

// A filter in parts; T: uint32_t, int32_t or uint8_t. See read_u32.
template <class T>
class ValueReader {
 public:
  ValueReader(const std::string& path, std::size_t expected_count);
  ~ValueReader();
  ValueReader(ValueReader&&) noexcept;

  void read(std::size_t begin, std::size_t count, T* out);

 private:
  std::unique_ptr<NpyBytes> bytes_;
  std::string name_;
  std::vector<unsigned char> staged_;
};

// Filters: one dimension, expected_count values of any integer type, each of which must fit the
// requested type. read_u8 also accepts bool.
std::vector<std::uint32_t> read_u32(const std::string& path, std::size_t expected_count);
std::vector<std::int32_t> read_i32(const std::string& path, std::size_t expected_count);
std::vector<std::uint8_t> read_u8(const std::string& path, std::size_t expected_count);

// Output goes to a temporary file in the same folder, which is renamed when complete; on failure it
// is removed and an older file stays unchanged. An existing target that is not a regular file, such
// as /dev/stdout, is written in place.
void write_boxes(const std::string& path, const Box* boxes, std::size_t frames, std::size_t count);
void write_pairs(const std::string& path, const Pair* pairs, std::size_t count);
void write_u32(const std::string& path, const std::uint32_t* values, std::size_t count);
void write_i32(const std::string& path, const std::int32_t* values, std::size_t count);
void write_u8(const std::string& path, const std::uint8_t* values, std::size_t count);

class OutputFile;

// Frames one by one. Without finish(), nothing appears under the final name.
class BoxWriter {
 public:
  // The file will be (count, 6) for one frame, else (frames, count, 6).
  BoxWriter(const std::string& path, std::size_t frames, std::size_t count);
  ~BoxWriter();
  BoxWriter(BoxWriter&&) noexcept;
  BoxWriter& operator=(BoxWriter&&) noexcept;

  // The next `count` boxes: whole frames or parts of one.
  void write(const Box* boxes, std::size_t count);
  // Completes the file. FileError where boxes are missing.
  void finish();

 private:
  std::unique_ptr<OutputFile> file_;
  std::size_t wanted_ = 0;
  std::size_t written_ = 0;
};

// A filter's values, in parts.
class WorldWriter {
 public:
  WorldWriter(const std::string& path, std::size_t count);
  ~WorldWriter();
  WorldWriter(const WorldWriter&) = delete;
  WorldWriter& operator=(const WorldWriter&) = delete;

  void write(const std::int32_t* values, std::size_t count);
  void finish();

 private:
  std::unique_ptr<OutputFile> file_;
};

// Pairs in blocks, of unknown number: the count goes into the header at the end, so a pipe is
// refused.
class PairWriter {
 public:
  explicit PairWriter(const std::string& path);
  ~PairWriter();
  PairWriter(PairWriter&&) noexcept;
  PairWriter& operator=(PairWriter&&) noexcept;

  void write(const Pair* pairs, std::size_t count);
  // Drops all but the first `count` pairs.
  void truncate(std::uint64_t count);
  void finish();
  std::uint64_t count() const noexcept { return written_; }

 private:
  std::unique_ptr<OutputFile> file_;
  std::size_t header_bytes_ = 0;
  std::uint64_t written_ = 0;
};

}  // namespace throng::scenes
