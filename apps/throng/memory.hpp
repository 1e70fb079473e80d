// Resident memory of this process, as the system reports it.
#pragma once

#include <cstdint>
#include <optional>

namespace throng::cli {

// Growth of resident memory since construction.
class PeakMeter {
 public:
  PeakMeter();
  // Bytes; nothing where the system does not report it.
  std::optional<std::uint64_t> growth() const;

 private:
  std::optional<std::uint64_t> start_;
};

}  // namespace throng::cli
