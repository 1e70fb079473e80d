// In place of log.cpp in a build without captures (THRONG_CAPTURE=OFF): a requested capture is
// reported as not written.
#include "capture/log.hpp"

namespace throng::capture {

const char* folder_of(const Options& options) noexcept { return options.capture; }

void Log::open(const char*, const Options&) noexcept { failed_ = true; }
void Log::begin(Operation, std::uint32_t, std::uint64_t, std::uint32_t, const Vec3&) noexcept {}
void Log::boxes(const Boxes&) noexcept {}
void Log::sweeps(const Sweep*, std::size_t) noexcept {}
void Log::answer(Result& r) noexcept {
  if (failed_ && !r.message[0])
    std::snprintf(
        r.message, sizeof r.message,
        "no capture was written: this build does not support it; build with THRONG_CAPTURE=ON");
  failed_ = false;
}
void Log::close() noexcept {}
void Log::section(Tag, std::uint32_t, std::uint64_t) noexcept {}
void Log::end_section() noexcept {}
void Log::put32(std::uint32_t) noexcept {}
void Log::put64(std::uint64_t) noexcept {}

}  // namespace throng::capture
