// Queries to persistent objects on the device: ray casts and overlap queries, with a grid that is
// kept and with one that is built for them.
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

// Rays ten box widths long in random directions from points near boxes; and cubes of four widths
// there.
struct Batch {
  std::vector<Sweep> rays;
  std::vector<Box> regions;
};
Batch batch_among(const Box* boxes, std::size_t n, std::size_t count) {
  const float width = mean_width(boxes, n);
  std::uint64_t drawn = 0;
  // From -1 to 1.
  const auto any = [&] { return static_cast<float>(mix64(++drawn) >> 40) * 0x1p-23f - 1; };
  Batch q;
  for (std::size_t k = 0; k < count; ++k) {
    const Box& near = boxes[mix64(k + count) % n];
    const Vec3 from = {near.lower.x + width * any(), near.lower.y + width * any(),
                       near.lower.z + width * any()};
    const float far = 6 * width, side = 4 * width;
    q.rays.push_back({{from, from}, {far * any(), far * any(), far * any()}});
    q.regions.push_back({from, {from.x + side, from.y + side, from.z + side}});
  }
  return q;
}

class Queries {
 public:
  Queries(const Case& c, Session& s) : s_(s), label_(c.label), n_(c.objects) {
    FrameMaker maker(c);
    const Box* boxes = maker.frame(0);
    here_ = DeviceArray<Box>(n_);
    here_.put(boxes, n_);
    const std::size_t most = 1000000;
    batch_ = batch_among(boxes, n_, most);
    rays_ = DeviceArray<Sweep>(most);
    rays_.put(batch_.rays.data(), most);
    regions_ = DeviceArray<Box>(most);
    regions_.put(batch_.regions.data(), most);
    hits_ = DeviceArray<SweepHit>(most);
    require(gpu_.add(Boxes(here_.data(), n_), nullptr, stream_.get()));
    check(boxes);
  }

  void run() {
    for (const std::size_t count : {std::size_t{1000}, std::size_t{100000}, std::size_t{1000000}}) {
      row("first hit", count, "rays", [&](std::size_t) {
        return gpu_.find_first_hits(rays_.data(), count, {}, hits_.data(), stream_.get());
      });
    }
    row("all hits", 100000, "rays", [&](std::size_t) {
      return gpu_.find_hits(rays_.data(), 100000, SweepHits::all, {}, stream_.get());
    });
    row("overlaps", 100000, "regions", [&](std::size_t) {
      return gpu_.find_overlaps(Boxes(regions_.data(), 100000), stream_.get());
    });
    // All move, so that the grid is built again.
    row("first hit, all moved", 1000, "rays", [&](std::size_t) {
      require(gpu_.move_all(Boxes(here_.data(), n_), stream_.get()));
      return gpu_.find_first_hits(rays_.data(), 1000, {}, hits_.data(), stream_.get());
    });
  }

 private:
  // Compares some of the results with what the CPU finds.
  void check(const Box* boxes) {
    const std::size_t some = 2000;
    BroadPhase cpu;
    std::vector<ObjectId> ids(n_);
    require(cpu.add(Boxes(boxes, n_), ids.data()));
    require(cpu.find_hits(batch_.rays.data(), some, SweepHits::first));
    const Result r = gpu_.find_first_hits(rays_.data(), some, {}, hits_.data(), stream_.get());
    require(r);
    stream_.wait();
    std::vector<SweepHit> got(some);
    hits_.get(got.data(), some);
    std::size_t wrong = 0, next = 0;
    for (std::size_t i = 0; i < some; ++i) {
      const bool meets = next < cpu.hits().size() && cpu.hits()[next].sweep == i;
      const SweepHit want = meets ? cpu.hits()[next++] : SweepHit{0, cuda::no_object, 0};
      wrong += got[i].object != want.object || (meets && got[i].time != want.time);
    }
    require(cpu.find_overlaps(Boxes(batch_.regions.data(), some)));
    require(gpu_.find_overlaps(Boxes(regions_.data(), some), stream_.get()));
    stream_.wait();
    std::vector<Pair> overlaps(gpu_.overlaps().size());
    if (!overlaps.empty())
      need(cudaMemcpy(overlaps.data(), gpu_.overlaps().data(), overlaps.size() * sizeof(Pair),
                      cudaMemcpyDeviceToHost));
    const Pairs wanted = cpu.overlaps();
    const bool same = std::equal(wanted.begin(), wanted.end(), overlaps.begin(), overlaps.end());
    s_.checked += 2;
    if (wrong || !same)
      s_.wrong.push_back("queries, " + label_ + ", " + std::to_string(n_) + ": " +
                         std::to_string(wrong) + " of " + std::to_string(some) +
                         " rays differ, overlaps" + (same ? " as" : " not as") +
                         " found by the CPU");
  }

  template <class F>
  void row(const std::string& what, std::size_t count, const char* noun, const F& query) {
    Result last;
    const Timing t = time_runs(stream_.get(), s_.budget_ms, [&](std::size_t k) {
      last = query(k);
      require(last);
    });
    Measurement row;
    row.experiment = "queries";
    row.what = label_;
    row.objects = n_;
    row.setting = std::to_string(count) + " " + noun + ", " + what;
    row.pairs = last.found;
    row.time = t;
    row.bytes_per_box = static_cast<double>(gpu_.memory_bytes()) / static_cast<double>(n_);
    row.rate = static_cast<double>(count) / (1e3 * t.median_ms);
    row.rate_metric = "million_queries_per_s";
    row.note = std::to_string(last.comparisons / count) + " comparisons per query";
    s_.measurements.push_back(std::move(row));
  }

  Session& s_;
  std::string label_;
  std::size_t n_;
  OwnStream stream_;
  Batch batch_;
  DeviceArray<Box> here_, regions_;
  DeviceArray<Sweep> rays_;
  DeviceArray<SweepHit> hits_;
  cuda::BroadPhase gpu_;
};

}  // namespace

void measure_queries(Session& s, std::size_t least, std::size_t most) {
  for (const Case& c : cases_of("stages", std::min<std::size_t>(most, 10000000)))
    if (c.objects >= least) Queries(c, s).run();
}

}  // namespace throng::bench::gpu
