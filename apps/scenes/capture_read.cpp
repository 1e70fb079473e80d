// Treats every number of a capture as hostile: sizes are compared with the bytes present before any
// allocation, by divisions that cannot overflow.
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "apps/scenes/capture.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/scenes/npy_header.hpp"

namespace throng::scenes {
namespace {

using capture::Operation;
using capture::Tag;

// The data that an operation comes with.
struct OperationInputs {
  std::size_t least_sets, most_sets;
  bool ids, sweeps;
};
constexpr OperationInputs operation_inputs[capture::operation_count] = {
    {1, 2, false, false},  // find
    {1, 1, false, false},  // add
    {0, 0, true, false},   // remove
    {1, 1, true, false},   // move
    {1, 1, false, false},  // move_all
    {1, 1, true, false},   // set_filters
    {0, 0, false, false},  // shift_origin
    {0, 0, false, false},  // update
    {1, 1, false, false},  // find_overlaps
    {1, 1, false, true},   // find_hits
    {1, 1, true, false},   // restart
};

struct Truncated {};  // the file ends here

class Reader {
 public:
  Reader(const unsigned char* data, std::size_t size, const std::string& name)
      : data_(data), size_(size), name_(name) {}

  Capture read() {
    if (size_ < 16 || std::memcmp(data_, capture::magic, sizeof capture::magic) != 0)
      fail("not a capture", "a file that Options::capture or THRONG_CAPTURE made");
    at_ = 8;
    end_ = size_;
    const std::uint32_t version = u32();
    if (version != capture::format_version)
      fail("format " + std::to_string(version), "1; use the throng of the program that made it");
    if (u32() != 0) fail("an unknown number at byte 12", "0");
    Capture capture;
    try {
      begin_section();
      if (tag_ != Tag::options) fail_at_section("section " + tag_text(), "the options first");
      options(capture);
      end_section();
    } catch (const Truncated&) {
      fail("a file cut short", "all of it");
    }
    while (at_ < size_) {
      try {
        begin_section();
        if (tag_ != Tag::operation) fail_at_section("section " + tag_text(), "an operation");
        capture.calls.push_back(call());
      } catch (const Truncated&) {
        capture.truncated = true;
        break;
      }
    }
    capture.truncated = capture.truncated || truncated_;
    if (capture.calls.empty()) fail("a file cut short before its first call is complete", "more");
    for (const CapturedCall& c : capture.calls) {
      const bool find = c.operation == Operation::find;
      if (find != capture.is_finder() || (find && capture.calls.size() != 1))
        fail("calls of several objects", "one call of a Finder, or those of a BroadPhase");
    }
    return capture;
  }

 private:
  // Messages.
  [[noreturn]] void fail(const std::string& found, const std::string& wanted) const {
    throw_file_error(name_, found, wanted);
  }
  [[noreturn]] void fail_at_section(const std::string& found, const std::string& wanted) const {
    fail(found + " at byte " + std::to_string(start_), wanted);
  }
  std::string tag_text() const { return std::to_string(static_cast<std::uint32_t>(tag_)); }

  // The section's header; its payload is within the file, or the file is cut.
  void begin_section() {
    start_ = at_;
    end_ = size_;
    if (size_ - at_ < 24) throw Truncated{};
    tag_ = static_cast<Tag>(u32());
    number_ = u32();
    const std::uint64_t bytes = u64();
    if (tag_ < Tag::options || tag_ > Tag::answer)
      fail_at_section("section " + tag_text(), "a section that this version knows");
    if (bytes > size_ - at_ - 8) throw Truncated{};
    end_ = at_ + static_cast<std::size_t>(bytes);
    const std::uint64_t sum = capture::fold(capture::fold_start, data_ + start_, end_ - start_);
    const std::size_t payload = at_;
    at_ = end_;
    end_ = size_;
    if (u64() != sum)
      fail_at_section("a section whose bytes are damaged", "the file as it was written");
    at_ = payload;
    end_ = payload + static_cast<std::size_t>(bytes);
  }
  void end_section() {
    if (at_ != end_) fail_at_section(std::to_string(end_ - at_) + " bytes too many", "none");
    at_ += 8;
  }
  // The number of values of this size that a section declares; they must fill its rest exactly.
  std::size_t count_of(std::size_t bytes_each) {
    const std::uint64_t count = u64();
    const std::size_t left = end_ - at_;
    if (count != left / bytes_each || left % bytes_each != 0)
      fail_at_section(std::to_string(count) + " values in " + std::to_string(left) + " bytes",
                      std::to_string(bytes_each) + " bytes each");
    return static_cast<std::size_t>(count);
  }

  // Values. A section that is too short for them is an error, not a cut: its length was complete.
  void require_bytes(std::size_t bytes) const {
    if (end_ - at_ < bytes)
      fail_at_section("a section too short", std::to_string(bytes) + " bytes more");
  }
  std::uint32_t u32() {
    require_bytes(4);
    const unsigned char* p = data_ + at_;
    at_ += 4;
    return p[0] | std::uint32_t{p[1]} << 8 | std::uint32_t{p[2]} << 16 | std::uint32_t{p[3]} << 24;
  }
  std::uint64_t u64() {
    const std::uint64_t low = u32();
    return low | std::uint64_t{u32()} << 32;
  }
  float f32() { return std::bit_cast<float>(u32()); }
  Vec3 vec3() {
    const float x = f32(), y = f32(), z = f32();
    return {x, y, z};
  }
  template <class E>
  E choice(std::uint32_t value, E last, const char* what) const {
    if (value > static_cast<std::uint32_t>(last))
      fail_at_section(std::string(what) + " " + std::to_string(value),
                      "at most " + std::to_string(static_cast<std::uint32_t>(last)));
    return static_cast<E>(value);
  }
  bool flag(const char* what) { return choice(u32(), 1, what) == 1; }

  void options(Capture& capture) {
    require_bytes(sizeof(capture::OptionsFields));
    Options& o = capture.options;
    o.algorithm = choice(u32(), Algorithm::grid, "algorithm");
    o.order = choice(u32(), Order::canonical, "order");
    o.backend = choice(u32(), Backend::emulated, "backend");
    o.nan = choice(u32(), NanPolicy::inactive, "treatment of NaN");
    o.isa = choice(u32(), *std::rbegin(all_isas), "instruction set");
    o.margin = f32();
    o.cell_scale = f32();
    o.threads = u32();
    o.concurrent_consumer = flag("concurrent consumer");
    o.measure_stages = flag("measuring of stages");
    capture.executor = u32();
    capture.has_memory_resource = flag("memory resource");
    capture.had_stop = flag("stop");
    (void)u32();
    const std::uint64_t cap = u64();
    if (cap > SIZE_MAX) fail_at_section("a memory cap of " + std::to_string(cap), "less");
    o.memory_cap_bytes = static_cast<std::size_t>(cap);
    for (int k = 0; k < 16; ++k) {
      const char c = static_cast<char>(data_[at_++]);
      // It is printed: only characters of version numbers.
      if (c == 0) continue;
      if (c < '!' || c > '~') fail_at_section("an invalid version string", "as 0.1.0");
      capture.library += c;
    }
  }

  CapturedCall call() {
    CapturedCall c;
    if (number_ >= capture::operation_count)
      fail_at_section("operation " + std::to_string(number_), "one that this version knows");
    c.operation = static_cast<Operation>(number_);
    c.capacity = u64();
    c.by = vec3();
    const bool find = c.operation == Operation::find;
    c.form = choice(u32(), find ? 2u : 1u, "form");
    const std::uint32_t sets = u32();
    if (sets < operation_inputs[number_].least_sets || sets > operation_inputs[number_].most_sets)
      fail_at_section(std::to_string(sets) + " sets of boxes", "what the operation takes");
    end_section();
    const OperationInputs& need = operation_inputs[number_];
    bool ids = false, sweeps = false;
    const auto whole = [&] {
      return c.sets.size() == sets && ids == need.ids && sweeps == need.sweeps;
    };
    while (at_ < size_) {
      try {
        begin_section();
      } catch (const Truncated&) {
        if (!whole()) throw;
        truncated_ = true;  // only the result is missing
        at_ = size_;
        break;
      }
      if (tag_ == Tag::operation) {  // the call before it did not return
        at_ = start_;
        break;
      }
      if (tag_ == Tag::answer) {
        c.answer = answer();
        end_section();
        break;
      }
      if (tag_ == Tag::boxes && c.sets.size() < sets) {
        c.sets.push_back(boxes());
      } else if (tag_ == Tag::ids && need.ids && !ids) {
        ids = true;
        c.ids.resize(count_of(4));
        for (std::uint32_t& id : c.ids) id = u32();
      } else if (tag_ == Tag::sweeps && need.sweeps && !sweeps) {
        sweeps = true;
        c.sweeps.resize(count_of(36));
        for (Sweep& sweep : c.sweeps) {
          sweep.box.lower = vec3();
          sweep.box.upper = vec3();
          sweep.by = vec3();
        }
      } else {
        fail_at_section(
            "section " + tag_text(),
            "what operation " + std::to_string(static_cast<int>(c.operation)) + " comes with");
      }
      end_section();
    }
    if (!whole()) {
      if (at_ >= size_ && !c.answer) throw Truncated{};
      fail_at_section("a call without all its inputs", "its boxes, ids and sweeps");
    }
    // A list that accompanies boxes has one entry per box.
    if ((ids && !c.sets.empty() && c.ids.size() != c.sets[0].boxes.size()) ||
        (sweeps && c.sweeps.size() != c.sets[0].boxes.size()))
      fail_at_section("lists of different lengths", "one id or sweep per box");
    return c;
  }

  CapturedBoxes boxes() {
    CapturedBoxes set;
    set.flags = number_;
    if (set.flags > capture::known_boxes_flags)
      fail_at_section("flags " + std::to_string(set.flags), "those that this version knows");
    std::size_t bytes_each = sizeof(Box);
    for (const auto word :
         {capture::has_group, capture::has_mask, capture::has_owner, capture::has_world}) {
      if (set.flags & word) bytes_each += 4;
    }
    if (set.flags & capture::has_static) bytes_each += 1;
    const std::size_t n = count_of(bytes_each);
    if (n > max_box_count)
      fail_at_section(std::to_string(n) + " boxes", std::to_string(max_box_count) + " at most");
    set.boxes.resize(n);
    for (Box& box : set.boxes) {
      box.lower = vec3();
      box.upper = vec3();
      if ((set.flags & capture::is_flat) && (box.lower.z != 0 || box.upper.z != 0))
        fail_at_section("a flat box with a z", "0");
    }
    const auto words = [&](std::uint32_t which, auto& values) {
      if (!(set.flags & which)) return;
      values.resize(n);
      for (auto& value : values) value = static_cast<std::decay_t<decltype(value)>>(u32());
    };
    words(capture::has_group, set.group);
    words(capture::has_mask, set.mask);
    words(capture::has_owner, set.owner);
    words(capture::has_world, set.world);
    if (set.flags & capture::has_static) {
      set.is_static.assign(data_ + at_, data_ + at_ + n);
      at_ += n;
    }
    return set;
  }

  CapturedAnswer answer() {
    CapturedAnswer a;
    a.status = choice(number_, Status::busy, "status");
    for (std::uint64_t* field : {&a.found, &a.written, &a.inactive, &a.first_invalid,
                                 &a.invalid_count, &a.bytes_needed, &a.checksum}) {
      *field = u64();
    }
    a.backend = choice(u32(), Backend::emulated, "backend");
    a.algorithm = choice(u32(), Algorithm::grid, "algorithm");
    a.isa = choice(u32(), *std::rbegin(all_isas), "instruction set");
    a.threads = u32();
    return a;
  }

  const unsigned char* data_;
  const std::size_t size_;
  const std::string& name_;
  std::size_t at_ = 0, end_ = 0, start_ = 0;
  Tag tag_ = Tag::options;
  std::uint32_t number_ = 0;
  bool truncated_ = false;
};

template <class T>
Strided<T> strided(const std::vector<T>& values) {
  return {values.empty() ? nullptr : values.data(), values.size(), sizeof(T)};
}

}  // namespace

Boxes CapturedBoxes::view() const noexcept {
  const float* first = boxes.empty() ? nullptr : &boxes[0].lower.x;
  const bool flat = first && (flags & capture::is_flat);
  Boxes v = flat ? Boxes::arrays(first, first + 1, nullptr, first + 3, first + 4, nullptr,
                                 boxes.size(), sizeof(Box))
                 : Boxes(boxes.data(), boxes.size());
  v.filters = {strided(group), strided(mask), strided(owner), strided(world), strided(is_static)};
  return v;
}

Capture parse_capture(const unsigned char* data, std::size_t size, const std::string& name) {
  return Reader(data, size, name).read();
}

Capture read_capture(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::is_regular_file(status))
    throw_file_error(path, fs::exists(status) ? "not a regular file" : "no file", "a capture");
  const std::uintmax_t size = fs::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  if (error || !file) throw_file_error(path, "a file that cannot be read", "a readable capture");
  std::vector<unsigned char> bytes(static_cast<std::size_t>(size));
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
    throw_file_error(path, "a file that cannot be read to its end", "a readable capture");
  return parse_capture(bytes.data(), bytes.size(), path);
}

}  // namespace throng::scenes
