// Reading .npy: boxes and filters.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <new>
#include <type_traits>
#include <utility>

#include <throng/find_pairs.hpp>

#include "apps/scenes/input_file.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/scenes/npy_header.hpp"

namespace throng::scenes {
namespace {

constexpr const char* wanted_boxes =
    "float32 of shape (n, 6) or (frames, n, 6); of 2-D boxes 4 for 6; or (n, 2, 3), (n, 2, 2): "
    "lower "
    "and upper corners";
// Empty frames take no space in a file, so the file's size does not limit their number.
constexpr std::uint64_t max_empty_frames = 1 << 20;
// Values are converted in blocks of about this many numbers.
constexpr std::size_t staged_items = 24576;

template <class T>
std::unique_ptr<T[]> allocate(std::uint64_t count, const std::string& name) {
  if (count <= std::numeric_limits<std::size_t>::max() / sizeof(T)) {
    // Without the zero-initialization of make_unique.
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

// Treats corner arrays (n, 2, 3) as (n, 6); for 2-D boxes with 2 for 3.
bool has_corners(const NpyHeader& h) {
  return h.shape.size() == 3 && h.shape[1] == 2 && (h.shape[2] == 3 || h.shape[2] == 2);
}
bool is_flat(const NpyHeader& h) { return h.shape.back() == 4 || h.shape.back() == 2; }

struct BoxShape {
  std::size_t frames, count;
};

// Whether this is an array of boxes. The file has the bytes that its shape implies.
BoxShape check_boxes(const NpyHeader& h, const std::string& name) {
  if (h.kind != 'f' || (h.item_bytes != 4 && h.item_bytes != 8)) {
    throw_file_error(name, h.text(), wanted_boxes);
  }
  const std::size_t d = h.shape.size();
  const bool corners = has_corners(h);
  if ((d != 2 && d != 3) || (!corners && h.shape.back() != 6 && h.shape.back() != 4))
    throw_file_error(name, h.text(), wanted_boxes);
  const std::uint64_t frames = d == 3 && !corners ? h.shape[0] : 1;
  const std::uint64_t count = corners ? h.shape[0] : h.shape[d - 2];
  if (count > max_box_count) {
    throw_file_error(name, std::to_string(count) + " boxes per frame",
                     "at most " + std::to_string(max_box_count));
  }
  if (frames == 0) throw_file_error(name, "no frame, " + h.text(), "at least one frame");
  if (count == 0 && frames > max_empty_frames) {
    throw_file_error(name, std::to_string(frames) + " empty frames",
                     "at most " + std::to_string(max_empty_frames));
  }
  return {static_cast<std::size_t>(frames), static_cast<std::size_t>(count)};
}

std::string number_text(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

// The offset of coordinate k of six: its indices after the box's.
std::vector<std::uint64_t> place_of(const NpyHeader& h, std::uint64_t k) {
  const std::uint64_t d = is_flat(h) ? 2 : 3, corner = k / 3, axis = k % 3;
  if (has_corners(h)) return {corner, axis};
  return {corner * d + axis};
}

// Six coordinates of one box, as stored in the file, to float.
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
      std::vector<std::uint64_t> index = place_of(h, static_cast<std::uint64_t>(k));
      index.insert(index.begin(), box);
      if (h.shape.size() == 3 && !has_corners(h)) index.insert(index.begin(), frame);
      throw_file_error(name,
                       "the float64 " + number_text(c[k]) + " at " + shape_text(index) +
                           ", which no float32 equals",
                       "float32 values, or rounding outward (--round outward)");
    }
    return {{f[0], f[1], f[2]}, {f[3], f[4], f[5]}};
  }
}

// Integers of type Stored to type T, each must fit; the first is value `begin` of the file.
template <class T, class Stored>
void convert_integers(const unsigned char* data, const NpyHeader& h, const std::string& name,
                      std::size_t begin, std::size_t count, T* out) {
  for (std::size_t i = 0; i < count; ++i) {
    const Stored v = load<Stored>(data + i * sizeof(Stored), h.swapped);
    const bool fits = v < 0 ? static_cast<std::int64_t>(v) >= std::numeric_limits<T>::min()
                            : static_cast<std::uint64_t>(v) <=
                                  static_cast<std::uint64_t>(std::numeric_limits<T>::max());
    if (!fits) {
      throw_file_error(name,
                       "the value " + std::to_string(v) + " at index " + std::to_string(begin + i),
                       "values from " + std::to_string(std::numeric_limits<T>::min()) + " to " +
                           std::to_string(std::numeric_limits<T>::max()));
    }
    out[i] = static_cast<T>(v);
  }
}

template <class T>
constexpr const char* type_name = nullptr;
template <>
constexpr const char* type_name<std::uint32_t> = "uint32";
template <>
constexpr const char* type_name<std::int32_t> = "int32";
template <>
constexpr const char* type_name<std::uint8_t> = "uint8";

template <class T>
std::vector<T> read_values(const std::string& path, std::size_t expected_count) {
  ValueReader<T> reader(path, expected_count);
  std::vector<T> out(expected_count);
  reader.read(0, expected_count, out.data());
  return out;
}

BoxFile read_all(BoxReader& reader, const std::string& name) {
  BoxFile out{reader.frames(), reader.count(), reader.is_flat(), nullptr};
  out.boxes = allocate<Box>(std::uint64_t{out.frames} * out.count, name);
  for (std::size_t f = 0; f < out.frames; ++f) {
    reader.read(f, 0, out.count, out.boxes.get() + f * out.count);
  }
  return out;
}

}  // namespace

BoxReader::BoxReader(std::unique_ptr<NpyBytes> bytes, const std::string& name, bool round_outward)
    : bytes_(std::move(bytes)), name_(name), round_outward_(round_outward) {
  const BoxShape shape = check_boxes(bytes_->header, name);
  frames_ = shape.frames;
  count_ = shape.count;
}
BoxReader::BoxReader(const std::string& path, bool round_outward)
    : BoxReader(std::make_unique<InputFile>(path), path, round_outward) {}
BoxReader::~BoxReader() = default;
BoxReader::BoxReader(BoxReader&&) noexcept = default;
BoxReader& BoxReader::operator=(BoxReader&&) noexcept = default;

bool BoxReader::is_flat() const noexcept { return scenes::is_flat(bytes_->header); }

void BoxReader::read(std::size_t frame, std::size_t begin, std::size_t count, Box* out) {
  const NpyHeader& h = bytes_->header;
  if (h.item_bytes == 4 && !h.swapped && !h.fortran_order && !is_flat()) {
    const std::uint64_t at = std::uint64_t{frame} * count_ + begin;
    bytes_->read(h.data_offset + at * sizeof(Box), out, count * sizeof(Box));
  } else if (h.item_bytes == 4) {
    convert<float>(frame, begin, count, out);
  } else {
    convert<double>(frame, begin, count, out);
  }
}

template <class T>
void BoxReader::convert(std::size_t frame, std::size_t begin, std::size_t count, Box* out) {
  const NpyHeader& h = bytes_->header;
  // Fortran order: the first index varies fastest, so the values of a coordinate are contiguous,
  // and the coordinates `apart` items apart.
  const std::size_t d = is_flat() ? 2 : 3, width = 2 * d;
  const bool corners = has_corners(h);
  const std::size_t apart = h.fortran_order ? frames_ : width;
  const std::size_t block = std::max<std::size_t>(1, staged_items / (width * apart));
  for (std::size_t done = 0; done < count; done += block) {
    const std::size_t now = std::min(block, count - done), first = begin + done;
    const std::size_t span = h.fortran_order ? (now - 1) * apart + 1 : now * width;
    staged_.resize((h.fortran_order ? width * span : span) * sizeof(T));
    if (h.fortran_order) {
      for (std::uint64_t k = 0; k < width; ++k) {
        // For corner arrays the corner's index varies faster than the axis.
        const std::uint64_t run = corners ? k / d + 2 * (k % d) : k;
        const std::uint64_t at = frame + std::uint64_t{frames_} * (first + count_ * run);
        bytes_->read(h.data_offset + at * sizeof(T), staged_.data() + k * span * sizeof(T),
                     span * sizeof(T));
      }
    } else {
      const std::uint64_t at = (std::uint64_t{frame} * count_ + first) * width;
      bytes_->read(h.data_offset + at * sizeof(T), staged_.data(), span * sizeof(T));
    }
    for (std::size_t i = 0; i < now; ++i) {
      T c[6] = {};
      for (std::size_t k = 0; k < width; ++k) {
        const std::size_t at = i * apart + k * (h.fortran_order ? span : 1);
        c[k < d ? k : 3 + k - d] = load<T>(staged_.data() + at * sizeof(T), h.swapped);
      }
      out[done + i] = to_box(c, round_outward_, h, name_, frame, first + i);
    }
  }
}

template <class T>
ValueReader<T>::ValueReader(const std::string& path, std::size_t expected_count)
    : bytes_(std::make_unique<InputFile>(path)), name_(path) {
  const NpyHeader& h = bytes_->header;
  const bool integer =
      (h.kind == 'i' || h.kind == 'u') &&
      (h.item_bytes == 1 || h.item_bytes == 2 || h.item_bytes == 4 || h.item_bytes == 8);
  const bool flag = h.kind == 'b' && h.item_bytes == 1 && sizeof(T) == 1;
  if ((!integer && !flag) || h.shape.size() != 1 || h.shape[0] != expected_count) {
    throw_file_error(path, h.text(),
                     std::string(type_name<T>) + " of shape (" + std::to_string(expected_count) +
                         ",), one value per box");
  }
}
template <class T>
ValueReader<T>::~ValueReader() = default;
template <class T>
ValueReader<T>::ValueReader(ValueReader&&) noexcept = default;

template <class T>
void ValueReader<T>::read(std::size_t begin, std::size_t count, T* out) {
  const NpyHeader& h = bytes_->header;
  for (std::size_t done = 0; done < count;) {
    const std::size_t now = std::min(staged_items, count - done), first = begin + done;
    staged_.resize(now * h.item_bytes);
    bytes_->read(h.data_offset + std::uint64_t{first} * h.item_bytes, staged_.data(),
                 staged_.size());
    const auto run = [&](auto zero) {
      convert_integers<T, decltype(zero)>(staged_.data(), h, name_, first, now, out + done);
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
    done += now;
  }
}

template class ValueReader<std::uint32_t>;
template class ValueReader<std::int32_t>;
template class ValueReader<std::uint8_t>;

BoxFile read_boxes(const std::string& path, bool round_outward) {
  BoxReader reader(path, round_outward);
  return read_all(reader, path);
}

BoxFile parse_boxes(const unsigned char* data, std::size_t size, const std::string& name,
                    bool round_outward) {
  BoxReader reader(std::make_unique<MemoryBytes>(data, size, name), name, round_outward);
  return read_all(reader, name);
}

std::vector<std::uint32_t> read_u32(const std::string& path, std::size_t expected_count) {
  return read_values<std::uint32_t>(path, expected_count);
}

std::vector<std::int32_t> read_i32(const std::string& path, std::size_t expected_count) {
  return read_values<std::int32_t>(path, expected_count);
}

std::vector<std::uint8_t> read_u8(const std::string& path, std::size_t expected_count) {
  return read_values<std::uint8_t>(path, expected_count);
}

}  // namespace throng::scenes
