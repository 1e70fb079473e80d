// Scratch space for the waiting parts of a problem: memory first, then one unnamed file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "apps/stream/rows.hpp"

namespace throng::stream {

// Extents of one size, which are released and reused; the first ones are in memory. The file is
// unlinked as soon as it is open (Windows: deleted on close), so nothing remains however the
// program ends. Throws Failure that names the folder and the fix.
class Scratch {
 public:
  // The file is created when more than memory_bytes are written.
  Scratch(std::string folder, std::size_t extent_bytes, std::size_t memory_bytes);
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  std::size_t extent_bytes() const noexcept { return extent_bytes_; }
  std::uint64_t write(const char* data,
                      std::size_t bytes);  // writes a free extent; returns its index
  void read(std::uint64_t extent, std::size_t at, char* out, std::size_t bytes);
  void release(std::uint64_t extent) {
    (extent < memory_.size() ? free_memory_ : free_).push_back(extent);
  }
  // The largest size of the file.
  std::uint64_t file_bytes() const noexcept { return extents_ * extent_bytes_; }

 private:
  [[noreturn]] void fail(const char* what, int error) const;

  std::string folder_;
  std::size_t extent_bytes_;
  std::FILE* file_ = nullptr;
  std::uint64_t extents_ = 0;  // of the file; their indices follow those in memory
  std::vector<std::uint64_t> free_, free_memory_;
  std::vector<std::unique_ptr<char[]>> memory_;
};

// Items of one size, in insertion order. The destructor releases its extents.
class Part final : public Source {
 public:
  Part() = default;
  Part(Scratch& scratch, std::size_t item_bytes)
      : scratch_(&scratch),
        item_bytes_(item_bytes),
        memory_extents_(scratch.extent_bytes() / item_bytes) {}
  ~Part() override { clear(); }
  Part(Part&& other) noexcept { *this = std::move(other); }
  Part& operator=(Part&& other) noexcept;

  std::uint64_t count() const noexcept override { return count_; }
  void read(std::uint64_t first, std::size_t count, char* out) override;

  // Buffer for the extent being filled: Scratch::extent_bytes() of the caller's, valid until
  // seal().
  void begin(char* waiting) noexcept { waiting_ = waiting; }
  void add(const char* item) {
    char* at = waiting_ + waiting_count_ * item_bytes_;
    std::memcpy(at, item, item_bytes_);
    ++count_;
    if (++waiting_count_ == memory_extents_) flush();
  }
  // Ends the insertions.
  void seal() {
    if (waiting_count_ != 0) flush();
    waiting_ = nullptr;
  }
  void clear() noexcept;

 private:
  void flush();

  Scratch* scratch_ = nullptr;
  std::size_t item_bytes_ = 0, memory_extents_ = 0;
  std::vector<std::uint64_t> extents_;
  std::uint64_t count_ = 0;
  char* waiting_ = nullptr;
  std::size_t waiting_count_ = 0;
};

}  // namespace throng::stream
