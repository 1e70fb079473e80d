// Objects that live on the device: what an update costs when nothing moves, when all move and stay
// in their fat boxes, when some leave theirs.
#include <algorithm>
#include <string>
#include <vector>

#include <throng/cuda_broad_phase.hpp>

#include "bench/gpu/cases.hpp"
#include "bench/gpu/gpu.hpp"
#include "bench/gpu/search.hpp"
#include "bench/gpu/timing.hpp"
#include "scene/checksum.hpp"

namespace throng::bench::gpu {
namespace {

// What moves between two frames, as shares of the boxes and of the fat margin.
struct Motion {
  const char* what;
  unsigned one_in;  // 0: nobody
  float far;        // margins along x
  const char* note;
};
constexpr Motion motions[] = {
    {"live, nothing moves", 0, 0, "49 B a box, as they were and as they are"},
    {"live, 1 % move in fat boxes", 100, 0.9f,
     "states of what moves; candidates in doubt compared"},
    {"live, all move in fat boxes", 1, 0.9f, "the same of all"},
    {"live, 1 % leave fat boxes", 100, 2.5f, "candidates mended in the grid"},
    {"live, all leave fat boxes", 1, 2.5f, "all candidates found anew"},
};

void measure_objects(const Case& c, Session& s) {
  FrameMaker maker(c);
  const Box* boxes = maker.frame(0);
  const std::size_t n = c.objects;
  // A twentieth of a box: a third more candidates than pairs.
  const float fat_margin = 0.05f * mean_width(boxes, n);
  const OwnStream stream;
  DeviceArray<Box> here(n), there(n);
  here.put(boxes, n);
  const Boxes at_rest(here.data(), n), moved(there.data(), n);
  std::vector<Box> after(n);
  for (const Motion& motion : motions) {
    for (std::size_t i = 0; i < n; ++i) {
      const bool moves = motion.one_in && scene::mix(i) % motion.one_in == 0;
      // To either side, so that pairs begin and end.
      const float side = scene::mix(i) >> 63 ? 1.0f : -1.0f;
      const float by = moves ? side * motion.far * fat_margin : 0;
      after[i] = boxes[i];
      after[i].lower.x += by;
      after[i].upper.x += by;
    }
    there.put(after.data(), n);
    cuda::BroadPhase scene(fat_margin);
    must(scene.add(at_rest, nullptr, stream.get()));
    must(scene.update(stream.get()));
    Answer first{scene.pair_count(), 0};
    std::uint64_t comparisons = 0, changed = 0;
    const auto frame = [&](std::size_t k) {
      const Result r = scene.update(k % 2 ? at_rest : moved, stream.get());
      must(r);
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
                          std::to_string(scene.pair_count()) + " pairs live, there are " +
                          std::to_string(r.found));
    }
    const Timing t = time_runs(stream.get(), s.budget_ms, frame);
    Row row;
    row.experiment = "live";
    row.what = motion.what;
    row.objects = n;
    row.order = "any";
    row.pairs = scene.pair_count();
    row.device = s.device;
    row.time = t;
    row.pairs_per_box = static_cast<double>(row.pairs) / static_cast<double>(n);
    row.bytes_per_box = static_cast<double>(scene.memory_bytes()) / static_cast<double>(n);
    row.rate = static_cast<double>(comparisons) / static_cast<double>(n);
    row.rate_unit = "candidates compared a box";
    row.note = std::string(motion.note) + "; " + std::to_string(scene.candidates().size()) +
               " candidates, " + std::to_string(changed) + " changed";
    s.rows.push_back(std::move(row));
  }
}

}  // namespace

void measure_live(Session& s, std::size_t least, std::size_t most) {
  for (const Case& c : cases_of("stages", most))
    if (c.scene == "uniform" && c.objects >= std::max<std::size_t>(least, 1000000))
      measure_objects(c, s);
}

}  // namespace throng::bench::gpu
