// Shared by the sub-commands: boxes from a file or a scene, devices, and text on standard output.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "apps/paper/stepper.hpp"

namespace throng::paper {

// Frames of boxes. A box with a NaN is refused; the error names its index.
struct Boxes {
  std::string name;
  std::size_t n = 0, frames = 0;
  std::vector<Box> boxes;  // frame after frame

  const Box* frame(std::size_t f) const noexcept { return boxes.data() + f * n; }
};
Boxes read_file(const std::string& path);
Boxes make_scene(const std::string& name, std::size_t n, std::size_t frames, std::uint64_t seed);

enum class DeviceKind { cpu, cuda };
// Failure where there is no GPU.
std::unique_ptr<Stepper> make_stepper_on(DeviceKind device, const Job& job);

// The median of each stage over `repeat` warmed steps of one frame, fewer (at least one) where they
// exceed `budget_ms` together; the pairs of the last step.
struct Measured {
  Step step;
  std::uint64_t checksum = 0;
};
Measured measure(Stepper& stepper, const Box* boxes, int repeat, double budget_ms = 1e300);

std::string hex(std::uint64_t value);

}  // namespace throng::paper
