// Questions to objects that live on the device: rays and regions, in a grid that is kept, and in
// one that is made for them.
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

// Ten widths of a box long, any way, from beside a box; and cubes of four widths there.
struct Questions {
  std::vector<Sweep> rays;
  std::vector<Box> regions;
};
Questions questions_among(const Box* boxes, std::size_t n, std::size_t count) {
  const float width = mean_width(boxes, n);
  std::uint64_t drawn = 0;
  // From -1 to 1.
  const auto any = [&] { return static_cast<float>(scene::mix(++drawn) >> 40) * 0x1p-23f - 1; };
  Questions q;
  for (std::size_t k = 0; k < count; ++k) {
    const Box& near = boxes[scene::mix(k + count) % n];
    const Vec3 from = {near.lower.x + width * any(), near.lower.y + width * any(),
                       near.lower.z + width * any()};
    const float far = 6 * width, side = 4 * width;
    q.rays.push_back({{from, from}, {far * any(), far * any(), far * any()}});
    q.regions.push_back({from, {from.x + side, from.y + side, from.z + side}});
  }
  return q;
}

class Asker {
 public:
  Asker(const Case& c, Session& s) : s_(s), label_(c.label), n_(c.objects) {
    FrameMaker maker(c);
    const Box* boxes = maker.frame(0);
    here_ = DeviceArray<Box>(n_);
    here_.put(boxes, n_);
    const std::size_t most = 1000000;
    asked_ = questions_among(boxes, n_, most);
    rays_ = DeviceArray<Sweep>(most);
    rays_.put(asked_.rays.data(), most);
    regions_ = DeviceArray<Box>(most);
    regions_.put(asked_.regions.data(), most);
    hits_ = DeviceArray<SweepHit>(most);
    must(gpu_.add(Boxes(here_.data(), n_), nullptr, stream_.get()));
    check(boxes);
  }

  void run() {
    for (const std::size_t count : {std::size_t{1000}, std::size_t{100000}, std::size_t{1000000}}) {
      row("first hits of rays", count, "rays", [&](std::size_t) {
        return gpu_.find_first_hits(rays_.data(), count, {}, hits_.data(), stream_.get());
      });
    }
    row("all hits of rays", 100000, "rays", [&](std::size_t) {
      return gpu_.find_hits(rays_.data(), 100000, SweepHits::all, {}, stream_.get());
    });
    row("regions", 100000, "regions", [&](std::size_t) {
      return gpu_.find_overlaps(Boxes(regions_.data(), 100000), stream_.get());
    });
    // So that the grid is made anew.
    row("all moved, first hits of rays", 1000, "rays", [&](std::size_t) {
      must(gpu_.move_all(Boxes(here_.data(), n_), stream_.get()));
      return gpu_.find_first_hits(rays_.data(), 1000, {}, hits_.data(), stream_.get());
    });
  }

 private:
  // Some of them, held against what the CPU finds.
  void check(const Box* boxes) {
    const std::size_t some = 2000;
    BroadPhase cpu;
    std::vector<ObjectId> ids(n_);
    must(cpu.add(Boxes(boxes, n_), ids.data()));
    must(cpu.find_hits(asked_.rays.data(), some, SweepHits::first));
    const Result r = gpu_.find_first_hits(rays_.data(), some, {}, hits_.data(), stream_.get());
    must(r);
    stream_.wait();
    std::vector<SweepHit> got(some);
    hits_.get(got.data(), some);
    std::size_t wrong = 0, next = 0;
    for (std::size_t i = 0; i < some; ++i) {
      const bool meets = next < cpu.hits().size() && cpu.hits()[next].sweep == i;
      const SweepHit want = meets ? cpu.hits()[next++] : SweepHit{0, cuda::no_object, 0};
      wrong += got[i].object != want.object || (meets && got[i].time != want.time);
    }
    must(cpu.find_overlaps(Boxes(asked_.regions.data(), some)));
    must(gpu_.find_overlaps(Boxes(regions_.data(), some), stream_.get()));
    stream_.wait();
    std::vector<Pair> overlaps(gpu_.overlaps().size());
    if (!overlaps.empty())
      need(cudaMemcpy(overlaps.data(), gpu_.overlaps().data(), overlaps.size() * sizeof(Pair),
                      cudaMemcpyDeviceToHost));
    const Pairs wanted = cpu.overlaps();
    const bool same = std::equal(wanted.begin(), wanted.end(), overlaps.begin(), overlaps.end());
    s_.checked += 2;
    if (wrong || !same)
      s_.wrong.push_back("questions, " + label_ + ", " + std::to_string(n_) + ": " +
                         std::to_string(wrong) + " of " + std::to_string(some) +
                         " rays and the regions" + (same ? "" : " not") + " as by the CPU");
  }

  template <class F>
  void row(const std::string& what, std::size_t count, const char* unit, const F& ask) {
    Result last;
    const Timing t = time_runs(stream_.get(), s_.budget_ms, [&](std::size_t k) {
      last = ask(k);
      must(last);
    });
    Row row;
    row.experiment = "questions";
    row.what = label_ + ", " + what;
    row.objects = n_;
    row.order = std::to_string(count);
    row.pairs = last.found;
    row.device = s_.device;
    row.time = t;
    row.bytes_per_box = static_cast<double>(gpu_.memory_bytes()) / static_cast<double>(n_);
    row.rate = static_cast<double>(count) / (1e3 * t.median_ms);
    row.rate_unit = std::string("million ") + unit + " a second";
    row.note = std::to_string(last.comparisons / count) + " comparisons a question";
    s_.rows.push_back(std::move(row));
  }

  Session& s_;
  std::string label_;
  std::size_t n_;
  OwnStream stream_;
  Questions asked_;
  DeviceArray<Box> here_, regions_;
  DeviceArray<Sweep> rays_;
  DeviceArray<SweepHit> hits_;
  cuda::BroadPhase gpu_;
};

}  // namespace

void measure_questions(Session& s, std::size_t least, std::size_t most) {
  for (const Case& c : cases_of("stages", std::min<std::size_t>(most, 10000000)))
    if (c.objects >= least) Asker(c, s).run();
}

}  // namespace throng::bench::gpu
