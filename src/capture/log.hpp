// Writes calls to a file, for `throng replay`: see throng/capture.hpp. Does nothing until it is
// opened, and never changes an answer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>

#include <throng/boxes.hpp>
#include <throng/broad_phase.hpp>
#include <throng/capture.hpp>
#include <throng/options.hpp>

namespace throng::capture {

// Where to: Options::capture, or else THRONG_CAPTURE as it was at the first call of this. Null:
// nowhere, as nearly always.
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
  template <class F>  // number(i) of i from 0 on, as ids
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
  // What was told beside the numbers of the Result, until answer().
  void told(std::uint64_t checksum) noexcept { checksum_ = checksum; }
  // Says in the result, too, where the file could not be written; once.
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

  static constexpr std::size_t name_room = 1024, buffer_room = 512;
  std::FILE* file_ = nullptr;
  std::uint64_t sum_ = 0, checksum_ = 0;
  bool began_ = false;   // an operation, not answered yet
  bool failed_ = false;  // not told yet
  int error_ = 0;
  std::size_t used_ = 0;
  unsigned char buffer_[buffer_room];
  char name_[name_room] = {};
};

}  // namespace throng::capture
