#include "apps/paper/input.hpp"

#include <iterator>
#include <stdexcept>

#include <throng/checksum.hpp>

#include <fmt/format.h>

#include "apps/common/median.hpp"
#include "apps/paper/cuda.hpp"
#include "apps/paper/failure.hpp"
#include "apps/report/format.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/scenes/scene.hpp"
#include "base/bounds.hpp"

namespace throng::paper {
namespace {

void refuse_nan(const Boxes& boxes) {
  std::size_t first = 0, count = 0;
  for (std::size_t i = 0; i < boxes.boxes.size(); ++i) {
    if (!base::has_nan(boxes.boxes[i])) continue;
    if (count++ == 0) first = i;
  }
  if (count == 0) return;
  throw Failure(
      fmt::format("{}: found {} boxes with a NaN, the first at index {} of frame {}; give a box "
                  "that is not there "
                  "a lower corner above its upper corner",
                  boxes.name, count, first % boxes.n, first / boxes.n));
}

}  // namespace

Boxes read_file(const std::string& path) {
  const scenes::BoxFile file = scenes::read_boxes(path);
  Boxes boxes{path, file.count, file.frames, {}};
  boxes.boxes.assign(file.boxes.get(), file.boxes.get() + file.count * file.frames);
  refuse_nan(boxes);
  return boxes;
}

Boxes make_scene(const std::string& name, std::size_t n, std::size_t frames, std::uint64_t seed) {
  scenes::Spec spec;
  spec.name = name;
  spec.objects = n;
  spec.frames = frames;
  spec.seed = seed;
  try {
    const scenes::Scene made(spec);
    Boxes boxes{name, n, frames, std::vector<Box>(n * frames)};
    for (std::size_t f = 0; f < frames; ++f) made.frame(f, boxes.boxes.data() + f * n);
    return boxes;
  } catch (const std::invalid_argument& error) {
    throw Failure(error.what());
  }
}

std::unique_ptr<Stepper> make_stepper_on(DeviceKind device, const Job& job) {
  if (device == DeviceKind::cpu) return make_host_stepper(job);
  const std::string reason = why_no_cuda();
  if (!reason.empty()) throw Failure("--device cuda: " + reason);
  return make_cuda_stepper(job);
}

Measured measure(Stepper& stepper, const Box* boxes, int repeat, double budget_ms) {
  stepper.step(boxes);  // cold: memory is touched, kernels are loaded
  constexpr double Times::*stages[] = {&Times::upload, &Times::boxes,    &Times::grid,
                                       &Times::search, &Times::download, &Times::decode};
  std::vector<double> values[std::size(stages)];
  Measured measured;
  double spent = 0;
  for (;;) {
    const Step& step = stepper.step(boxes);
    for (std::size_t s = 0; s < std::size(stages); ++s) {
      values[s].push_back(step.times.*stages[s]);
    }
    spent += step.times.total() + step.times.decode;
    if (static_cast<int>(values[0].size()) >= repeat || spent >= budget_ms) {
      measured.step = step;
      break;
    }
  }
  for (std::size_t s = 0; s < std::size(stages); ++s) {
    measured.step.times.*stages[s] = common::median(values[s]);
  }
  const std::vector<Pair>& pairs = measured.step.pairs;
  measured.checksum = pair_checksum(pairs.data(), pairs.size());
  return measured;
}

std::string hex(std::uint64_t value) { return fmt::format("{:016x}", value); }

}  // namespace throng::paper
