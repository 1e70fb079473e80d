// Persistent objects on the device: the time of an update when nothing moves, when all move and
// stay in their enlarged boxes, and when some leave them.
#include <algorithm>
#include <string>
#include <vector>

#include <throng/checksum.hpp>
#include <throng/cuda_broad_phase.hpp>

#include "bench/gpu/cases.hpp"
#include "bench/gpu/gpu.hpp"
#include "bench/gpu/session.hpp"
#include "bench/gpu/timing.hpp"

namespace throng::bench::gpu {
namespace {

// What moves between two frames, as shares of the boxes and of the margin of the enlarged boxes.
struct Motion {
  const char* what;
  unsigned one_in;  // 0: none
  float far;        // margins along x
  const char* note;
};
constexpr Motion motions[] = {
    {"nothing moves", 0, 0, "49 bytes per box: old and new"},
    {"1 % move in enlarged boxes", 100, 0.9f, "moved boxes and uncertain candidates"},
    {"all move in enlarged boxes", 1, 0.9f, "the same for all boxes"},
    {"1 % leave enlarged boxes", 100, 2.5f, "candidates updated in the grid"},
    {"all leave enlarged boxes", 1, 2.5f, "all candidates searched again"},
};

void measure_objects(const Case& c, Session& s) {
  FrameMaker maker(c);
  const Box* boxes = maker.frame(0);
  const std::size_t n = c.objects;
  // 0.05 of a box: a third more candidates than pairs.
  const float margin = 0.05f * mean_width(boxes, n);
  const OwnStream stream;
  DeviceArray<Box> here(n), there(n);
  here.put(boxes, n);
  const Boxes at_rest(here.data(), n), moved(there.data(), n);
  std::vector<Box> after(n);
  for (const Motion& motion : motions) {
    for (std::size_t i = 0; i < n; ++i) {
      const bool moves = motion.one_in && mix64(i) % motion.one_in == 0;
      // In both directions, so that pairs begin and end.
      const float side = mix64(i) >> 63 ? 1.0f : -1.0f;
      const float by = moves ? side * motion.far * margin : 0;
      after[i] = boxes[i];
      after[i].lower.x += by;
      after[i].upper.x += by;
    }
    there.put(after.data(), n);
    cuda::BroadPhase scene(margin);
    require(scene.add(at_rest, nullptr, stream.get()));
    require(scene.update(stream.get()));
    Answer first{scene.pair_count(), 0};
    std::uint64_t comparisons = 0, changed = 0;
    const auto frame = [&](std::size_t k) {
      const Result r = scene.update(k % 2 ? at_rest : moved, stream.get());
      require(r);
      comparisons = r.comparisons;
      changed = scene.begun().size() + scene.ended().size();
    };
    // The number of pairs, of both frames, by a search from scratch.
    for (std::size_t k = 0; k < 2; ++k) {
      frame(k);
      cuda::Finder finder;
      const Result r = finder.find(k % 2 ? at_rest : moved, nullptr, 0, stream.get());
      ++s.checked;
      if (r.found != scene.pair_count() || (k % 2 && r.found != first.pairs))
        s.wrong.push_back(std::string(motion.what) + ", " + std::to_string(n) + ": " +
                          std::to_string(scene.pair_count()) + " pairs, there are " +
                          std::to_string(r.found));
    }
    const Timing t = time_runs(stream.get(), s.budget_ms, frame);
    Measurement row;
    row.experiment = "tracking";
    row.what = c.label;
    row.objects = n;
    row.setting = motion.what;
    row.pairs = scene.pair_count();
    row.time = t;
    row.pairs_per_box = static_cast<double>(row.pairs) / static_cast<double>(n);
    row.bytes_per_box = static_cast<double>(scene.memory_bytes()) / static_cast<double>(n);
    row.rate = static_cast<double>(comparisons) / static_cast<double>(n);
    row.rate_metric = "comparisons_per_box";
    row.note = std::string(motion.note) + "; " + std::to_string(scene.candidates().size()) +
               " candidates, " + std::to_string(changed) + " changed";
    s.measurements.push_back(std::move(row));
  }
}

}  // namespace

void measure_tracking(Session& s, std::size_t least, std::size_t most) {
  for (const Case& c : cases_of("stages", most))
    if (c.scene == "uniform" && c.objects >= std::max<std::size_t>(least, 1000000))
      measure_objects(c, s);
}

}  // namespace throng::bench::gpu
