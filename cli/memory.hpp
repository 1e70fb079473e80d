// Resident memory of this process, as the system counts it.
#pragma once

#include <cstdint>
#include <optional>

namespace throng::cli {

// How far resident memory grew above where it stood at construction.
class PeakMeter {
 public:
  PeakMeter();
  // Bytes; nothing where the system does not say.
  std::optional<std::uint64_t> growth() const;

 private:
  std::optional<std::uint64_t> start_;
};

}  // namespace throng::cli
