// The machine that a result belongs to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace throng::bench {

// What the programs tell of a machine, and the versions of library and rivals.
std::vector<std::pair<std::string, std::string>> machine_description();
// Bytes read and bytes written, together, by copying blocks that no cache holds; GB/s.
double copy_bandwidth(unsigned threads);

// Resident memory, in bytes; 0 where the system does not tell.
std::uint64_t resident_bytes();
std::uint64_t peak_resident_bytes();
// The peak starts anew from what is resident now.
bool reset_peak();

}  // namespace throng::bench
