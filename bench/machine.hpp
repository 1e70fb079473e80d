// The machine that a result belongs to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace throng::bench {

// The description that all programs print, and the versions of the libraries.
std::vector<std::pair<std::string, std::string>> machine_description();
// Bytes read plus bytes written per second, in GB/s, by copying blocks larger than the caches.
double copy_bandwidth(unsigned threads);

// Resident memory, in bytes; 0 if the system does not report it.
std::uint64_t resident_bytes();
std::uint64_t peak_resident_bytes();
// Resets the peak to what is resident now. Returns false if the system cannot.
bool reset_peak();

}  // namespace throng::bench
