// The setting of the experiments: devices, sizes, time limits, and the measurement of one variant.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "apps/paper/evaluation/section.hpp"
#include "apps/paper/input.hpp"
#include "apps/paper/stepper.hpp"

namespace throng::paper {

struct Setting {
  bool quick = false;
  std::vector<DeviceKind> devices = {DeviceKind::cpu};
  unsigned threads = 1;                                             // of the CPU
  std::uint64_t memory_bytes = std::uint64_t{4} << 30;              // for one output, list or grid
  std::uint64_t up_to = std::numeric_limits<std::uint64_t>::max();  // larger n are skipped
  double limit_seconds = 60;                         // for a frame of another library
  std::string competitors;                           // the program that runs them; empty: not built
  std::function<void(const std::string&)> progress;  // may be empty
};

class Lab {
 public:
  explicit Lab(Setting setting);

  const Setting& setting() const noexcept { return setting_; }
  bool quick() const noexcept { return setting_.quick; }
  const std::vector<DeviceKind>& devices() const noexcept { return setting_.devices; }
  // "AMD EPYC 9654, 2 threads", "NVIDIA H200".
  const std::string& name(DeviceKind device) const;
  void say(const std::string& what) const;

  // Without those above --up-to, and with --quick those above `quick_limit`.
  std::vector<std::uint64_t> sizes(std::vector<std::uint64_t> all, std::uint64_t quick_limit) const;

  struct Measurement {
    std::optional<Measured> measured;
    std::string skip_reason;  // why there is none
  };
  // The median step of a variant, or the reason for skipping it (too much memory). `threads` 0: the
  // setting's number.
  Measurement run(const Variant& variant, const Box* boxes, std::uint64_t n, DeviceKind device,
                  unsigned threads = 0) const;
  // Time limit for one variant at one size, after its first step.
  double budget_ms() const noexcept { return quick() ? 250 : 3000; }
  int repeat() const noexcept { return quick() ? 5 : 11; }

  // A row on that device; a missing measurement's reason becomes the result.
  Row row(const std::string& what, std::uint64_t n, const std::string& quantity,
          const std::string& unit, DeviceKind device) const;
  // The same with pairs, checksum and number from a result.
  Row row(const std::string& what, std::uint64_t n, const std::string& quantity, DeviceKind device,
          const Measurement& measurement, double Times::*stage) const;

  // Throng's time for the same boxes: the median of warmed calls. Failure where it is refused.
  struct Library {
    double ms = 0;
    std::uint64_t pairs = 0, checksum = 0;
    std::string plan;
  };
  Library library(const Box* boxes, std::uint64_t n, DeviceKind device, unsigned threads = 0,
                  float cell_scale = 1) const;

 private:
  Setting setting_;
  std::string names_[2];
};

double ms_of(const std::function<void()>& call);
// The median of warmed calls: at least `repeat` and at least 0.1 s, fewer where they exceed the
// time limit.
double median_ms(const std::function<void()>& call, int repeat, double budget_ms);

}  // namespace throng::paper
