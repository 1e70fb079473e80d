#include "bench/gpu/session.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>

#include <throng/checksum.hpp>
#include <throng/cuda.hpp>

#include "bench/gpu/gpu.hpp"
#include "bench/gpu/timing.hpp"

namespace throng::bench::gpu {
namespace {

// Above this number of boxes pairs are summed up only on the device: a download takes too long.
constexpr std::size_t most_on_host = 10000000;

void require(const Result& r, const std::string& what) {
  if (!r.ok()) throw std::runtime_error(what + ": " + r.message);
}

// The frames of a case in device memory, and the number of pairs of each.
class Resident {
 public:
  explicit Resident(const Case& c) {
    FrameMaker maker(c);
    if (!maker.worlds().empty()) {
      worlds_ = DeviceArray<std::int32_t>(c.objects);
      worlds_.put(maker.worlds().data(), c.objects);
    }
    for (std::size_t f = 0; f < c.frames; ++f) {
      frames_.emplace_back(c.objects);
      frames_.back().put(maker.frame(f), c.objects);
    }
    cuda::Finder counter(counting());
    for (std::size_t f = 0; f < c.frames; ++f) {
      const Result r = counter.find(boxes(f), nullptr, 0, nullptr);
      if (r.status != Status::buffer_too_small) require(r, c.label);
      found_.push_back(r.found);
    }
  }
  std::size_t size() const { return frames_.size(); }
  Boxes boxes(std::size_t f) const {
    Boxes b(frames_[f].data(), frames_[f].size());
    if (worlds_.size()) b.filters.world = {worlds_.data(), worlds_.size()};
    return b;
  }
  std::uint64_t found(std::size_t f) const { return found_[f]; }
  std::size_t most_found() const {
    return static_cast<std::size_t>(*std::max_element(found_.begin(), found_.end()));
  }

 private:
  static Options counting() {
    Options o;
    o.nan = NanPolicy::inactive;
    return o;
  }
  std::vector<DeviceArray<Box>> frames_;
  DeviceArray<std::int32_t> worlds_;
  std::vector<std::uint64_t> found_;
};

struct Summed {
  Answer answer;
  std::string by;
};

// Number and checksum of pairs in device memory. A small number is also summed up on the host, and
// both sums must be equal.
Summed sum_up(const Case& c, const DeviceArray<Pair>& pairs, std::size_t count, cudaStream_t stream,
              Session& s) {
  Summed sum{{count, device_checksum(pairs.data(), count, stream)}, "device"};
  if (c.objects > most_on_host) return sum;
  std::vector<Pair> host(count);
  if (count) pairs.get(host.data(), count);
  const std::uint64_t here = pair_checksum(host.data(), count);
  if (here != sum.answer.checksum)
    s.wrong.push_back(c.label + ", " + std::to_string(c.objects) +
                      ": the device's checksum of its pairs is " + hex(sum.answer.checksum) +
                      ", the host's " + hex(here));
  return {{count, here}, "host"};
}

void compare(const Case& c, std::size_t frame, const char* order, const Answer& got, Session& s) {
  if (!s.expected) return;
  const Answer* want = s.expected->find(c.label, c.objects, frame);
  if (!want) {
    ++s.unknown;
    return;
  }
  ++s.checked;
  if (*want == got) return;
  s.wrong.push_back(c.label + ", " + std::to_string(c.objects) + " boxes, frame " +
                    std::to_string(frame) + ", " + order + ": " + std::to_string(got.pairs) +
                    " pairs of checksum " + hex(got.checksum) + "; expected " +
                    std::to_string(want->pairs) + " of " + hex(want->checksum));
}

void measure_order(const Case& c, const Resident& frames, Order order, Session& s) {
  const bool canonical = order == Order::canonical;
  const char* order_name = canonical ? "sorted" : "unsorted";
  Options options;
  options.algorithm = c.algorithm;
  options.order = order;
  options.nan = NanPolicy::inactive;
  options.measure_stages = false;
  const OwnStream stream;
  const std::size_t capacity = frames.most_found();
  DeviceArray<Pair> pairs(std::max<std::size_t>(capacity, 1));  // there may be none
  const DeviceArray<cuda::Report> report(1);
  cuda::Finder finder(options);
  const std::size_t before = device_bytes_in_use();
  require(finder.reserve(c.objects, canonical ? capacity : 0, stream.get()), c.label);
  const std::size_t taken = device_bytes_in_use() - before;
  std::vector<std::unique_ptr<Graph>> graphs;
  for (std::size_t f = 0; f < frames.size(); ++f)
    graphs.push_back(std::make_unique<Graph>(stream.get(), [&] {
      require(
          finder.find_async(frames.boxes(f), pairs.data(), capacity, report.data(), stream.get()),
          c.label);
    }));
  const bool file = c.scene.empty();
  for (std::size_t f = 0; f < frames.size(); ++f) {
    // Pairs that are not written must not look like pairs.
    need(cudaMemsetAsync(pairs.data(), 0xff, pairs.bytes(), stream.get()));
    graphs[f]->launch(stream.get());
    stream.wait();
    cuda::Report reported;
    report.get(&reported, 1);
    const auto found = static_cast<std::size_t>(reported.found);
    if (found != frames.found(f) || found > capacity) {
      s.wrong.push_back(c.label + ", frame " + std::to_string(f) + ": " + std::to_string(found) +
                        " pairs in a replay, " + std::to_string(frames.found(f)) + " before");
      continue;
    }
    const Summed sum = sum_up(c, pairs, found, stream.get(), s);
    compare(c, f, order_name, sum.answer, s);
    if (f > 0 && !file) continue;
    Measurement row;
    row.experiment = c.experiment;
    row.what = file ? c.label.substr(c.label.find_last_of('/') + 1) : c.label;
    row.objects = c.objects;
    row.setting = order_name;
    if (c.algorithm != Algorithm::automatic)
      row.setting += std::string(", ") + to_string(c.algorithm);
    row.pairs = sum.answer.pairs;
    row.checksum = sum.answer.checksum;
    row.checksum_by = sum.by;
    const auto n = static_cast<double>(c.objects);
    row.pairs_per_box = static_cast<double>(found) / n;
    row.bytes_per_box = static_cast<double>(finder.memory_bytes()) / n;
    row.driver_bytes_per_box = static_cast<double>(taken) / n;
    const double budget = file ? s.budget_ms / static_cast<double>(frames.size()) : s.budget_ms;
    const Timing t = time_runs(stream.get(), budget, [&](std::size_t k) {
      graphs[file ? f : k % graphs.size()]->launch(stream.get());
    });
    row.time = t;
    row.note =
        file ? "frame " + std::to_string(f) : std::to_string(frames.size()) + " frames in turn";
    s.measurements.push_back(std::move(row));
  }
}

}  // namespace

void measure_search(const Case& c, Session& s) {
  if (c.objects == 0) return;
  const Resident frames(c);
  measure_order(c, frames, Order::any, s);
  if (c.canonical) measure_order(c, frames, Order::canonical, s);
}

// ---- stages -------------------------------------------------------------------------------------

namespace {

// The bytes that each stage moves through device memory. `random`: sectors of 32 bytes at random
// places of the cell table, which cost nothing if the table is in L2.
struct Moved {
  const char* stage;
  double per_box, random_per_box, per_pair;
  const char* reason;
};
// Above this number boxes are sorted by cell (device/cell_sort.hpp): no cell is counted in
// device memory, and boxes are gathered, one and a half sectors per box.
constexpr std::size_t sorted_above = 3500000;
constexpr Moved bin_sorted = {"bin", (24 + 4 + 4) + (4 + 2 * (8 + 8)) + (4 + 4 + 4 + 48 + 32 + 9),
                              0, 0,
                              "cells: box 24, cell 4, index 4; sort: cell 4, two passes of 8 + 8; "
                              "place: cell 4 + 4, index 4, "
                              "sectors of a box 48, record 32, table 9"};
constexpr Moved moved[] = {
    {"plan", 0, 0, 0, "one block, about 4096 boxes: latency, no bandwidth; others clear the table"},
    // The table has 9/4 cells of 4 bytes per box: 9 bytes.
    {"bin", (24 + 8) + 2 * 9 + (24 + 8 + 32), 2 * 32 + 32, 0,
     "count: box 24, place 8, an atomic on a sector (32 read, 32 written); scan 9 + 9; "
     "place: box 24, place 8, a sector of the table 32, record 32"},
    {"find", 32 + 9, 0, 8,
     "records 32 and table 9 once from memory, candidates again from the caches; 8 per pair"},
};

double stage_ms(const StageTimes& t, int stage) {
  return stage == 0 ? t.plan_ms : stage == 1 ? t.bin_ms : t.find_ms;
}

}  // namespace

void measure_stages(const Case& c, Session& s) {
  if (s.copy_gbs == 0) s.copy_gbs = copy_bandwidth_gbs();
  int l2_bytes = 0, ordinal = 0;
  need(cudaGetDevice(&ordinal));
  need(cudaDeviceGetAttribute(&l2_bytes, cudaDevAttrL2CacheSize, ordinal));
  const Resident frames(c);
  const OwnStream stream;
  DeviceArray<Pair> pairs(std::max<std::size_t>(frames.most_found(), 1));
  Options options;
  options.measure_stages = true;
  cuda::Finder finder(options);
  std::vector<double> times[3];
  double spent_ms = 0;
  for (std::size_t k = 0; k < 12 || (spent_ms < s.budget_ms && k < 500); ++k) {
    const Result r =
        finder.find(frames.boxes(k % frames.size()), pairs.data(), pairs.size(), stream.get());
    require(r, c.label);
    spent_ms += r.times.total_ms;
    if (k < 2) continue;  // warm-up
    for (int stage = 0; stage < 3; ++stage) times[stage].push_back(stage_ms(r.times, stage));
  }
  const auto n = static_cast<double>(c.objects);
  const bool in_l2 = 9 * n < 0.75 * static_cast<double>(l2_bytes);
  for (int stage = 0; stage < 3; ++stage) {
    const bool sorted = stage == 1 && c.objects > sorted_above;
    const Moved& m = sorted ? bin_sorted : moved[stage];
    Measurement row;
    row.experiment = "stages";
    row.what = c.label;
    row.objects = c.objects;
    row.setting = m.stage;
    row.pairs = frames.found(0);
    row.pairs_per_box = static_cast<double>(row.pairs) / n;
    row.time.runs = times[stage].size();
    row.time.min_ms = *std::min_element(times[stage].begin(), times[stage].end());
    row.time.median_ms = common::median(times[stage]);
    const double bytes = n * (m.per_box + (in_l2 ? 0 : m.random_per_box)) +
                         static_cast<double>(row.pairs) * m.per_pair;
    row.note = m.reason;
    if (bytes > 0 && row.time.median_ms > 0) {
      row.bytes_per_box = bytes / n;
      row.rate = 100 * bytes / (row.time.median_ms * 1e6) / s.copy_gbs;
      row.rate_metric = "copy_percent";
      row.note += in_l2 ? "; the table is in L2" : "";
    }
    s.measurements.push_back(std::move(row));
  }
}

}  // namespace throng::bench::gpu
