#include "apps/throng/memory.hpp"

#include <cstdio>
#include <cstring>
#include <string>

#if defined(__linux__)
#include <malloc.h>
#elif defined(_WIN32)
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>
// after windows.h
#include <psapi.h>
#else
#include <sys/resource.h>
#endif

namespace throng::cli {
namespace {

#if defined(__linux__)

// A field of /proc/self/status in bytes. Read through one small buffer, so that reading it does not
// change it.
std::optional<std::uint64_t> status_field(const char* name) {
  std::FILE* file = std::fopen("/proc/self/status", "r");
  if (!file) return std::nullopt;
  char line[256];
  std::optional<std::uint64_t> bytes;
  const std::size_t length = std::strlen(name);
  while (std::fgets(line, sizeof line, file)) {
    unsigned long long kib = 0;
    if (std::strncmp(line, name, length) == 0 && std::sscanf(line + length, ": %llu", &kib) == 1) {
      bytes = kib * 1024;
      break;
    }
  }
  std::fclose(file);
  return bytes;
}

// Resets the high-water mark to the current resident size (Linux 4.0 and later, where /proc allows
// it).
bool reset_peak() {
  std::FILE* file = std::fopen("/proc/self/clear_refs", "w");
  if (!file) return false;
  const bool written = std::fputs("5", file) >= 0;
  return std::fclose(file) == 0 && written;
}

std::optional<std::uint64_t> peak() { return status_field("VmHWM"); }

std::optional<std::uint64_t> baseline() {
#ifdef __GLIBC__
  malloc_trim(0);  // memory freed earlier must not hide new allocations
#endif
  // Without the reset the mark may be an earlier peak: the reported growth is then too low, never
  // too high.
  return reset_peak() ? status_field("VmRSS") : peak();
}

#elif defined(_WIN32)

std::optional<std::uint64_t> peak() {
  PROCESS_MEMORY_COUNTERS counters{};
  if (!GetProcessMemoryInfo(GetCurrentProcess(), &counters, sizeof counters)) return std::nullopt;
  return counters.PeakWorkingSetSize;
}
std::optional<std::uint64_t> baseline() { return peak(); }

#else

std::optional<std::uint64_t> peak() {
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) != 0) return std::nullopt;
#ifdef __APPLE__
  return static_cast<std::uint64_t>(usage.ru_maxrss);  // bytes there, KiB elsewhere
#else
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
#endif
}
std::optional<std::uint64_t> baseline() { return peak(); }

#endif

}  // namespace

PeakMeter::PeakMeter() : start_(baseline()) {}

std::optional<std::uint64_t> PeakMeter::growth() const {
  const std::optional<std::uint64_t> now = peak();
  if (!start_ || !now) return std::nullopt;
  return *now > *start_ ? *now - *start_ : 0;
}

}  // namespace throng::cli
