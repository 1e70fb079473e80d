// Reading .npy: boxes and filters.
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <new>
#include <system_error>
#include <type_traits>

#include <throng/find_pairs.hpp>

#include "scene/npy.hpp"
#include "scene/npy_header.hpp"

namespace throng::scene {
namespace {

constexpr const char* kWantedBoxes = "float32 of shape (n, 6) or (frames, n, 6)";
// Empty frames take no room in a file, so their number is a claim that nothing backs.
constexpr std::uint64_t kMaxEmptyFrames = 1 << 20;

struct FileCloser {
  void operator()(std::FILE* f) const noexcept { std::fclose(f); }
};

// A file opened, its size known, its header read and checked against that size.
class InputFile {
 public:
  explicit InputFile(const std::string& path) : name_(path) {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) {
      throw_file_error(path, error ? "no file (" + error.message() + ")" : "no file",
                       "a readable .npy file");
    }
    if (fs::is_directory(status)) throw_file_error(path, "a directory", "a .npy file");
    if (!fs::is_regular_file(status)) {
      throw_file_error(path, "a device or a pipe", "a regular .npy file");
    }
    size_ = fs::file_size(path, error);
    if (error) throw_file_error(path, error.message(), "a readable .npy file");
    errno = 0;
    file_.reset(std::fopen(path.c_str(), "rb"));
    if (!file_) throw_file_error(path, std::strerror(errno), "a readable .npy file");

    unsigned char prefix[12];
    const std::size_t start = std::min<std::uint64_t>(sizeof prefix, size_);
    read(prefix, start);
    std::vector<unsigned char> text(prefix, prefix + start);
    const std::size_t want = std::min<std::uint64_t>(npy_prefix_bytes(prefix, start, name_), size_);
    if (want > start) {
      text.resize(want);
      read(text.data() + start, want - start);
    }
    header = parse_npy_header(text.data(), text.size(), size_, name_);
    // A header may be shorter than the 12 bytes that were read.
    if (std::fseek(file_.get(), static_cast<long>(header.data_offset), SEEK_SET) != 0) {
      throw_file_error(path, std::strerror(errno), "a readable .npy file");
    }
  }

  void read(void* out, std::size_t bytes) {
    errno = 0;
    if (bytes == 0 || std::fread(out, 1, bytes, file_.get()) == bytes) return;
    throw_file_error(name_, errno ? std::strerror(errno) : "a file that grew shorter while read",
                     std::to_string(bytes) + " more bytes of it");
  }

  std::uint64_t data_bytes() const noexcept { return size_ - header.data_offset; }

  NpyHeader header;

 private:
  std::string name_;
  std::unique_ptr<std::FILE, FileCloser> file_;
  std::uint64_t size_ = 0;
};

template <class T>
std::unique_ptr<T[]> allocate(std::uint64_t count, const std::string& name) {
  if (count <= std::numeric_limits<std::size_t>::max() / sizeof(T)) {
    // Without the zeroes that make_unique would write.
    if (T* p = new (std::nothrow) T[static_cast<std::size_t>(count)])
      return std::unique_ptr<T[]>(p);
  }
  throw_file_error(name, std::to_string(count * sizeof(T)) + " bytes to hold in memory",
                   "a file that this machine's memory can hold");
}

template <class T>
T load(const unsigned char* at, bool swapped) {
  unsigned char bytes[sizeof(T)];
  for (std::size_t k = 0; k < sizeof(T); ++k) bytes[k] = at[swapped ? sizeof(T) - 1 - k : k];
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

// Is this an array of boxes? Sets frames and count; they are backed by as many bytes of the file.
void check_boxes(const NpyHeader& h, const std::string& name, BoxFile& out) {
  if (h.kind != 'f' || (h.item_bytes != 4 && h.item_bytes != 8)) {
    throw_file_error(name, h.text(), kWantedBoxes);
  }
  const std::size_t d = h.shape.size();
  if ((d != 2 && d != 3) || h.shape.back() != 6) throw_file_error(name, h.text(), kWantedBoxes);
  const std::uint64_t frames = d == 3 ? h.shape[0] : 1, count = h.shape[d - 2];
  if (count > max_box_count) {
    throw_file_error(name, std::to_string(count) + " boxes in a frame",
                     "at most " + std::to_string(max_box_count));
  }
  if (frames == 0) throw_file_error(name, "no frame, " + h.text(), "at least one frame");
  if (count == 0 && frames > kMaxEmptyFrames) {
    throw_file_error(name, std::to_string(frames) + " empty frames",
                     "at most " + std::to_string(kMaxEmptyFrames));
  }
  out.frames = static_cast<std::size_t>(frames);
  out.count = static_cast<std::size_t>(count);
}

std::string number_text(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

// Six coordinates of one box, as they stand in the file, to float.
template <class T>
Box to_box(const T (&c)[6], bool round_outward, const NpyHeader& h, const std::string& name,
           std::size_t frame, std::size_t box) {
  if constexpr (std::is_same_v<T, float>) {
    return {{c[0], c[1], c[2]}, {c[3], c[4], c[5]}};
  } else {
    float f[6];
    for (int k = 0; k < 6; ++k) {
      // Out of float's range the cast is undefined, and no float is equal anyway.
      const bool nan = std::isnan(c[k]);
      const bool in_range =
          std::isinf(c[k]) || std::fabs(c[k]) <= std::numeric_limits<float>::max();
      f[k] = nan        ? std::numeric_limits<float>::quiet_NaN()
             : in_range ? static_cast<float>(c[k])
                        : 0.0f;
      if (nan || static_cast<double>(f[k]) == c[k]) continue;
      if (round_outward) return throng::round_outward(c, c + 3);
      std::vector<std::uint64_t> index = {box, static_cast<std::uint64_t>(k)};
      if (h.shape.size() == 3) index.insert(index.begin(), frame);
      throw_file_error(name,
                       "the float64 " + number_text(c[k]) + " at " + shape_text(index) +
                           ", which no float32 equals",
                       "float32 values, or leave to round outward (--round outward)");
    }
    return {{f[0], f[1], f[2]}, {f[3], f[4], f[5]}};
  }
}

template <class T>
void convert(const unsigned char* data, const NpyHeader& h, const std::string& name,
             bool round_outward, BoxFile& out) {
  const std::size_t total = out.frames * out.count;
  for (std::size_t f = 0; f < out.frames; ++f) {
    for (std::size_t i = 0; i < out.count; ++i) {
      T c[6];
      for (std::size_t k = 0; k < 6; ++k) {
        // Fortran order: the first index runs fastest.
        const std::size_t at =
            h.fortran_order ? f + out.frames * i + total * k : (f * out.count + i) * 6 + k;
        c[k] = load<T>(data + at * sizeof(T), h.swapped);
      }
      out.boxes[f * out.count + i] = to_box(c, round_outward, h, name, f, i);
    }
  }
}

void convert_boxes(const unsigned char* data, const NpyHeader& h, const std::string& name,
                   bool round_outward, BoxFile& out) {
  out.boxes = allocate<Box>(std::uint64_t{out.frames} * out.count, name);
  if (h.item_bytes == 4) {
    convert<float>(data, h, name, round_outward, out);
  } else {
    convert<double>(data, h, name, round_outward, out);
  }
}

// Integers of type Stored to type T, each of which must fit.
template <class T, class Stored>
void convert_integers(const unsigned char* data, const NpyHeader& h, const std::string& name,
                      std::vector<T>& out) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Stored v = load<Stored>(data + i * sizeof(Stored), h.swapped);
    const bool fits = v < 0 ? static_cast<std::int64_t>(v) >= std::numeric_limits<T>::min()
                            : static_cast<std::uint64_t>(v) <=
                                  static_cast<std::uint64_t>(std::numeric_limits<T>::max());
    if (!fits) {
      throw_file_error(name, "the value " + std::to_string(v) + " at index " + std::to_string(i),
                       "values from " + std::to_string(std::numeric_limits<T>::min()) + " to " +
                           std::to_string(std::numeric_limits<T>::max()));
    }
    out[i] = static_cast<T>(v);
  }
}

template <class T>
std::vector<T> read_integers(const std::string& path, std::size_t expected_count,
                             const char* type) {
  InputFile file(path);
  const NpyHeader& h = file.header;
  const std::string wanted =
      std::string(type) + " of shape (" + std::to_string(expected_count) + ",), one value a box";
  const bool integer =
      (h.kind == 'i' || h.kind == 'u') &&
      (h.item_bytes == 1 || h.item_bytes == 2 || h.item_bytes == 4 || h.item_bytes == 8);
  const bool flag = h.kind == 'b' && h.item_bytes == 1 && sizeof(T) == 1;
  if ((!integer && !flag) || h.shape.size() != 1 || h.shape[0] != expected_count) {
    throw_file_error(path, h.text(), wanted);
  }
  const std::size_t bytes = expected_count * h.item_bytes;  // the file is that long
  const auto data = allocate<unsigned char>(bytes, path);
  file.read(data.get(), bytes);
  std::vector<T> out(expected_count);
  const auto run = [&](auto zero) {
    convert_integers<T, decltype(zero)>(data.get(), h, path, out);
  };
  if (h.kind == 'i') {
    if (h.item_bytes == 1) run(std::int8_t{});
    if (h.item_bytes == 2) run(std::int16_t{});
    if (h.item_bytes == 4) run(std::int32_t{});
    if (h.item_bytes == 8) run(std::int64_t{});
  } else {
    if (h.item_bytes == 1) run(std::uint8_t{});
    if (h.item_bytes == 2) run(std::uint16_t{});
    if (h.item_bytes == 4) run(std::uint32_t{});
    if (h.item_bytes == 8) run(std::uint64_t{});
  }
  return out;
}

}  // namespace

BoxFile read_boxes(const std::string& path, bool round_outward) {
  InputFile file(path);
  const NpyHeader& h = file.header;
  BoxFile out;
  check_boxes(h, path, out);
  if (h.item_bytes == 4 && !h.swapped && !h.fortran_order) {
    out.boxes = allocate<Box>(std::uint64_t{out.frames} * out.count, path);
    file.read(out.boxes.get(), out.frames * out.count * sizeof(Box));
    return out;
  }
  const auto data = allocate<unsigned char>(file.data_bytes(), path);
  file.read(data.get(), static_cast<std::size_t>(file.data_bytes()));
  convert_boxes(data.get(), h, path, round_outward, out);
  return out;
}

BoxFile parse_boxes(const unsigned char* data, std::size_t size, const std::string& name,
                    bool round_outward) {
  const NpyHeader h = parse_npy_header(data, size, size, name);
  BoxFile out;
  check_boxes(h, name, out);
  convert_boxes(data + h.data_offset, h, name, round_outward, out);
  return out;
}

std::vector<std::uint32_t> read_u32(const std::string& path, std::size_t expected_count) {
  return read_integers<std::uint32_t>(path, expected_count, "uint32");
}

std::vector<std::int32_t> read_i32(const std::string& path, std::size_t expected_count) {
  return read_integers<std::int32_t>(path, expected_count, "int32");
}

std::vector<std::uint8_t> read_u8(const std::string& path, std::size_t expected_count) {
  return read_integers<std::uint8_t>(path, expected_count, "uint8");
}

}  // namespace throng::scene
