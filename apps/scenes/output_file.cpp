#include "apps/scenes/output_file.hpp"

#if defined(__unix__) || defined(__APPLE__)
#include <unistd.h>
#endif

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <system_error>

#include <throng/checksum.hpp>

#include "apps/scenes/input_file.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/scenes/npy_header.hpp"
#include "capture/create_file.hpp"

namespace throng::scenes {
namespace {

constexpr std::size_t buffer_bytes = 1 << 18;
constexpr int attempts = 16;
constexpr int most_links = 40;

// The target of a path: a rename over a link would replace the link, and /dev/stdout is one. A
// link's target need not exist yet.
std::string followed(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path at = path;
  for (int links = 0; fs::is_symlink(fs::symlink_status(at, error)); ++links) {
    const fs::path to = fs::read_symlink(at, error);
    if (error || links == most_links)
      throw_file_error(path, error ? error.message() : "links that form a cycle",
                       "a file that can be written");
    at = at.parent_path() / to;
  }
  return at.string();
}

// For a target that is not a regular file: a device or a pipe cannot be renamed over.
bool is_written_in_place(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (fs::is_directory(status)) throw_file_error(path, "a directory", "a file to write");
  return fs::exists(status) && !fs::is_regular_file(status);
}

}  // namespace

std::string output_target(const std::string& path) {
  return is_written_in_place(path) ? std::string() : followed(path);
}

// Exclusive creation detects a clash.
std::string temporary_name(const std::string& target) {
  static std::atomic<std::uint64_t> calls{0};
  const auto now = std::chrono::steady_clock::now().time_since_epoch().count();
  const auto place = reinterpret_cast<std::uintptr_t>(&calls);  // differs between processes
  const std::uint64_t bits =
      mix64(mix64(static_cast<std::uint64_t>(now) + calls.fetch_add(1)) ^ std::uint64_t{place});
  char suffix[24];
  std::snprintf(suffix, sizeof suffix, ".part-%08x", static_cast<unsigned>(bits >> 32));
  return target + suffix;
}

OutputFile::OutputFile(const std::string& path) : name_(path) {
  if (path.empty()) throw_file_error("(no name)", "an empty file name", "a file to write");
  target_ = output_target(path);
  if (target_.empty()) {
    file_ = std::fopen(path.c_str(), "wb");
    if (!file_) fail(errno);
  }
  for (int attempt = 0; !file_; ++attempt) {
    temporary_ = temporary_name(target_);
    errno = 0;
    file_ = capture::create_file(temporary_.c_str());
    if (file_) break;
    const int why = errno;
    temporary_.clear();  // created by another process
    if (why != EEXIST || attempt + 1 == attempts) fail(why);
  }
  std::setvbuf(file_, nullptr, _IOFBF, buffer_bytes);
}

OutputFile::~OutputFile() { discard(); }

void OutputFile::fail(int error) {
  discard();
  throw_file_error(name_, error ? std::strerror(error) : "an unknown error",
                   "a file that can be written");
}

void OutputFile::discard() noexcept {
  if (file_) std::fclose(file_);
  file_ = nullptr;
  if (!temporary_.empty()) {
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
    temporary_.clear();
  }
}

void OutputFile::write(const void* data, std::size_t bytes) {
  if (bytes == 0) return;
  if (!file_) throw_file_error(name_, "a file that is closed already", "a file being written");
  errno = 0;
  if (std::fwrite(data, 1, bytes, file_) != bytes) fail(errno);
  at_ += bytes;
  end_ = std::max(end_, at_);
  longest_ = std::max(longest_, end_);
}

void OutputFile::seek(std::uint64_t offset) {
  if (!file_) throw_file_error(name_, "a file that is closed already", "a file being written");
  errno = 0;
  if (!seek_to(file_, offset)) fail(errno);
  at_ = offset;
}

bool OutputFile::can_seek() const noexcept { return file_ && seek_to(file_, at_); }

void OutputFile::truncate(std::uint64_t offset) {
  seek(offset);
  end_ = offset;
}

void OutputFile::commit() {
  if (!file_) throw_file_error(name_, "a file that is closed already", "a file being written");
  errno = 0;
  if (std::fflush(file_) != 0) fail(errno);
  errno = 0;
  std::FILE* file = file_;
  file_ = nullptr;  // closed even where closing fails
  if (std::fclose(file) != 0) fail(errno);
  if (temporary_.empty()) return;
  std::error_code error;
  if (end_ < longest_) {
    std::filesystem::resize_file(temporary_, end_, error);
    if (error) fail(error.value());
  }
  std::filesystem::rename(temporary_, target_, error);
  if (error) fail(error.value());
  temporary_.clear();
}

void check_outputs(const std::vector<NamedFile>& outputs, const std::vector<NamedFile>& inputs) {
  namespace fs = std::filesystem;
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const NamedFile& out = outputs[k];
    const std::string target = out.path.empty() ? std::string() : output_target(out.path);
    if (target.empty()) continue;
    const fs::path place = fs::absolute(target).lexically_normal();
    const auto is_that_of = [&](const NamedFile& other) {
      if (other.path.empty()) return false;
      std::error_code ignored;
      return fs::equivalent(place, other.path, ignored) ||
             place == fs::absolute(followed(other.path)).lexically_normal();
    };
    for (const NamedFile& in : inputs)
      if (is_that_of(in))
        throw_file_error(out.path, "the file of " + in.name + " as that of " + out.name + ", too",
                         "another name for the output");
    for (std::size_t other = 0; other < k; ++other)
      if (is_that_of(outputs[other]))
        throw_file_error(out.path, "one file for both " + outputs[other].name + " and " + out.name,
                         "different names");
    std::error_code ignored;
    if (!fs::is_directory(place.parent_path(), ignored))
      throw_file_error(out.path, place.parent_path().string() + ", which is not a folder",
                       "a file in an existing folder");
#if defined(__unix__) || defined(__APPLE__)
    if (access(place.parent_path().c_str(), W_OK | X_OK) != 0)
      throw_file_error(out.path, std::strerror(errno), "a file that can be written");
#endif
  }
}

}  // namespace throng::scenes
