#include "apps/stream/scratch.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include <fmt/format.h>

#include "apps/common/failure.hpp"
#include "apps/scenes/input_file.hpp"

#ifndef _WIN32
#include <unistd.h>
#endif

namespace throng::stream {
namespace {

std::FILE* open_unnamed(const std::string& folder) {
#ifdef _WIN32
  for (int attempt = 0; attempt < 16; ++attempt) {
    const std::string name = fmt::format("{}/throng-{:08x}", folder, std::rand());
    if (std::FILE* file = std::fopen(name.c_str(), "w+bxTD")) return file;
  }
  return nullptr;
#else
  std::string name = folder + "/throng-XXXXXX";
  const int fd = mkstemp(name.data());
  if (fd < 0) return nullptr;
  unlink(name.c_str());
  std::FILE* file = fdopen(fd, "w+b");
  if (!file) close(fd);
  return file;
#endif
}

}  // namespace

Scratch::Scratch(std::string folder, std::size_t extent_bytes, std::size_t memory_bytes)
    : folder_(std::move(folder)),
      extent_bytes_(extent_bytes),
      memory_(memory_bytes / extent_bytes) {
  for (std::size_t i = memory_.size(); i > 0; --i) free_memory_.push_back(i - 1);
}

Scratch::~Scratch() {
  if (file_) std::fclose(file_);
}

void Scratch::fail(const char* what, int error) const {
  throw common::Failure(fmt::format(
      "a temporary file in {} cannot be {}: {}; it held {} bytes. Set TMPDIR to a folder with "
      "more space (about 30 bytes per box, 4 per filter, 8 per pair in canonical order), or "
      "raise --memory",
      folder_, what, error ? std::strerror(error) : "unknown error", file_bytes()));
}

std::uint64_t Scratch::write(const char* data, std::size_t bytes) {
  if (!free_memory_.empty()) {
    const std::uint64_t extent = free_memory_.back();
    free_memory_.pop_back();
    std::unique_ptr<char[]>& memory = memory_[static_cast<std::size_t>(extent)];
    if (!memory) memory.reset(new char[extent_bytes_]);  // uses pages only when written
    std::memcpy(memory.get(), data, bytes);
    return extent;
  }
  if (!file_) {
    errno = 0;
    file_ = open_unnamed(folder_);
    if (!file_) fail("made", errno);
    std::setvbuf(file_, nullptr, _IONBF, 0);
  }
  std::uint64_t extent = memory_.size() + extents_;
  if (free_.empty()) {
    ++extents_;
  } else {
    extent = free_.back();
    free_.pop_back();
  }
  errno = 0;
  if (!scenes::seek_to(file_, (extent - memory_.size()) * extent_bytes_) ||
      std::fwrite(data, 1, bytes, file_) != bytes) {
    fail("written", errno);
  }
  return extent;
}

void Scratch::read(std::uint64_t extent, std::size_t at, char* out, std::size_t bytes) {
  if (extent < memory_.size()) {
    std::memcpy(out, memory_[static_cast<std::size_t>(extent)].get() + at, bytes);
    return;
  }
  errno = 0;
  if (!scenes::seek_to(file_, (extent - memory_.size()) * extent_bytes_ + at) ||
      std::fread(out, 1, bytes, file_) != bytes) {
    fail("read", errno);
  }
}

Part& Part::operator=(Part&& other) noexcept {
  std::swap(scratch_, other.scratch_);
  std::swap(item_bytes_, other.item_bytes_);
  std::swap(memory_extents_, other.memory_extents_);
  std::swap(extents_, other.extents_);
  std::swap(count_, other.count_);
  std::swap(waiting_, other.waiting_);
  std::swap(waiting_count_, other.waiting_count_);
  return *this;
}

void Part::flush() {
  extents_.push_back(scratch_->write(waiting_, waiting_count_ * item_bytes_));
  waiting_count_ = 0;
}

void Part::read(std::uint64_t first, std::size_t count, char* out) {
  while (count != 0) {
    const std::size_t at = static_cast<std::size_t>(first % memory_extents_);
    const std::size_t now = std::min(count, memory_extents_ - at);
    scratch_->read(extents_[static_cast<std::size_t>(first / memory_extents_)], at * item_bytes_,
                   out, now * item_bytes_);
    first += now;
    count -= now;
    out += now * item_bytes_;
  }
}

void Part::clear() noexcept {
  for (const std::uint64_t extent : extents_) scratch_->release(extent);
  extents_ = {};
  count_ = 0;
}

}  // namespace throng::stream
