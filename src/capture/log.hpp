// Writes calls to a file for `throng replay`; format in throng/capture.hpp. Inactive until opened;
// never changes a result.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>

#include <throng/boxes.hpp>
#include <throng/broad_phase.hpp>
#include <throng/capture.hpp>
#include <throng/options.hpp>

namespace throng::capture {

// The target folder: Options::capture, else THRONG_CAPTURE as read at the first call. Null: no
// capture (the usual case).
const char* folder_of(const Options& options) noexcept;

class Log {
 public:
  // cppcheck-suppress uninitMemberVar  // the buffer is written before it is read
  Log() noexcept = default;
  ~Log() { close(); }
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  // Begins a new file in `folder`.
  void open(const char* folder, const Options& options) noexcept;
  explicit operator bool() const noexcept { return file_ != nullptr; }

  void begin(Operation operation, std::uint32_t sets, std::uint64_t capacity = 0,
             std::uint32_t form = 0, const Vec3& by = {}) noexcept;
  void boxes(const Boxes& boxes) noexcept;
  template <class F>  // number(i): the value for i in [0, count), e.g. an id
  void list(std::size_t count, const F& number) noexcept {
    if (!file_) return;
    section(Tag::ids, 0, 8 + std::uint64_t{count} * 4);
    put64(count);
    for (std::size_t i = 0; i < count; ++i) put32(number(i));
    end_section();
  }
  void ids(const std::uint32_t* ids, std::size_t count) noexcept {
    list(count, [&](std::size_t i) { return ids[i]; });
  }
  void sweeps(const Sweep* sweeps, std::size_t count) noexcept;
  // Sets the checksum of the data returned in addition to the Result, for the next answer().
  void set_checksum(std::uint64_t checksum) noexcept { checksum_ = checksum; }
  // Writes the result; reports a failed write once, in its message.
  void answer(Result& result) noexcept;

 private:
  void section(Tag tag, std::uint32_t number, std::uint64_t bytes) noexcept;
  void put(const void* bytes, std::size_t count) noexcept;
  void put32(std::uint32_t value) noexcept;
  void put64(std::uint64_t value) noexcept;
  void put_float(float value) noexcept;
  void put_options(const Options& options) noexcept;
  void drain() noexcept;
  void end_section() noexcept;
  void close() noexcept;
  void fail(int error) noexcept;

  static constexpr std::size_t name_capacity = 1024, buffer_capacity = 512;
  std::FILE* file_ = nullptr;
  std::uint64_t sum_ = 0, checksum_ = 0;
  bool in_operation_ = false;  // an operation awaits its answer
  bool failed_ = false;        // not reported yet
  int error_ = 0;
  std::size_t used_ = 0;
  unsigned char buffer_[buffer_capacity];
  char name_[name_capacity] = {};
};

}  // namespace throng::capture
