// Subcommand queries: ray casts and overlap queries to boxes that move, some each frame, one by one
// or in one call. Throng's BroadPhase, Bullet's btDbvt and a tree of Embree's.
//
// Each frame all methods get the same moves (random_motion.hpp) and the same queries, one method
// after the other; medians over the frames. The number of objects that all queries found is
// compared, with a tolerance: rounding may decide differently about a ray that grazes a box.
#include <throng/throng.hpp>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/failure.hpp"
#include "bench/competitors/queries.hpp"
#include "bench/random_motion.hpp"
#include "bench/require.hpp"
#include "bench/subcommands.hpp"
#include "bench/timing.hpp"

namespace throng::bench {
namespace {

class ThrongQueries : public QueryMethod {
 public:
  explicit ThrongQueries(unsigned threads) {
    Options o;
    o.threads = threads;
    broad_phase_ = BroadPhase(o);
  }
  std::string name() const override { return "Throng BroadPhase"; }
  bool supports(QueryBatch::Kind) const override { return true; }
  void start(const std::vector<Box>& boxes) override { start_with(broad_phase_, boxes); }
  void update(const Moves& moves) override { bench::update(broad_phase_, moves); }
  std::uint64_t run(const QueryBatch& batch) override {
    return run_range([&](const Boxes& boxes) { return broad_phase_.find_overlaps(boxes); },
                     [&](const auto&... sweeps) { return broad_phase_.find_hits(sweeps...); },
                     batch, 0, batch.size());
  }

 protected:
  // Queries begin .. end-1, one by one or in one call.
  template <class Overlaps, class Hits>
  static std::uint64_t run_range(const Overlaps& overlaps, const Hits& hits,
                                 const QueryBatch& batch, std::size_t begin, std::size_t end) {
    const SweepHits which = batch.kind == QueryBatch::first_hit ? SweepHits::first : SweepHits::all;
    const std::size_t step = batch.one_call ? end - begin : 1;
    std::uint64_t found = 0;
    for (std::size_t i = begin; i < end; i += step) {
      const Result r = batch.kind == QueryBatch::overlaps
                           ? overlaps(Boxes(batch.regions.data() + i, step))
                           : hits(batch.rays.data() + i, step, which);
      require(r);
      found += r.found;
    }
    return found;
  }

  BroadPhase broad_phase_;
};

// Several threads that query at the same time, each a part of the queries.
class ConcurrentQueries : public ThrongQueries {
 public:
  explicit ConcurrentQueries(unsigned count) : ThrongQueries(1), barrier_(count) {
    Options o;
    o.threads = 1;
    while (queries_.size() < count) queries_.emplace_back(o);
    for (std::size_t k = 1; k < count; ++k) {
      others_.emplace_back([this, k] {
        for (barrier_.arrive_and_wait(); batch_; barrier_.arrive_and_wait()) {
          run_part(k);
          barrier_.arrive_and_wait();
        }
      });
    }
  }
  ~ConcurrentQueries() override {
    batch_ = nullptr;
    barrier_.arrive_and_wait();
    for (std::thread& other : others_) other.join();
  }
  std::string name() const override { return "Throng BroadPhaseQuery"; }
  std::uint64_t run(const QueryBatch& batch) override {
    batch_ = &batch;
    found_ = 0;
    barrier_.arrive_and_wait();
    run_part(0);
    barrier_.arrive_and_wait();
    return found_;
  }

 private:
  void run_part(std::size_t k) {
    const std::size_t count = batch_->size(), parts = queries_.size();
    found_ += run_range(
        [&](const Boxes& boxes) { return queries_[k].find_overlaps(broad_phase_, boxes); },
        [&](const auto&... sweeps) { return queries_[k].find_hits(broad_phase_, sweeps...); },
        *batch_, count * k / parts, count * (k + 1) / parts);
  }

  std::vector<BroadPhaseQuery> queries_;
  std::vector<std::thread> others_;
  std::barrier<> barrier_;
  const QueryBatch* batch_ = nullptr;
  std::atomic<std::uint64_t> found_{0};
};

// How many queries of which kind per frame.
struct Queries {
  QueryBatch::Kind kind;
  std::size_t count;
  bool one_call;
};
struct Case {
  const char* scene;
  double share;
  Queries queries;
  bool world_long;  // rays as long as the world, not ten units
  int frames;

  // "1000 rays, first hit, one call"
  std::string text() const {
    constexpr const char* what[] = {"first hit", "all hits", "overlaps"};
    const char* noun = queries.kind == QueryBatch::overlaps ? "region" : "ray";
    return fmt::format("{} {}{}{}, {}, {}", queries.count, noun, queries.count == 1 ? "" : "s",
                       world_long ? " as long as the world" : "", what[queries.kind],
                       queries.one_call ? "one call" : "one by one");
  }
};

std::vector<Case> all_cases() {
  constexpr auto first_hit = QueryBatch::first_hit, all_hits = QueryBatch::all_hits,
                 overlaps = QueryBatch::overlaps;
  constexpr Queries near[] = {
      {first_hit, 1, false},    {first_hit, 10, false},  {first_hit, 100, false},
      {first_hit, 1000, false}, {first_hit, 1000, true}, {first_hit, 20'000, true},
      {all_hits, 1000, true},   {overlaps, 10, false},   {overlaps, 1000, true}};
  constexpr Queries far[] = {{first_hit, 1000, true}, {all_hits, 1000, true}};
  std::vector<Case> all;
  for (const char* scene : {"uniform", "pile", "mixed"}) {
    for (const double share : {0.01, 1.0})
      for (const Queries& q : near) all.push_back({scene, share, q, false, share == 1 ? 12 : 40});
  }
  for (const char* scene : {"uniform", "mixed", "clusters"})
    for (const Queries& q : far) all.push_back({scene, 0.01, q, true, 40});
  return all;
}

float extent_of(const std::vector<Box>& boxes) {
  Box all = boxes[0];
  for (const Box& b : boxes) {
    all.lower = {std::min(all.lower.x, b.lower.x), std::min(all.lower.y, b.lower.y),
                 std::min(all.lower.z, b.lower.z)};
    all.upper = {std::max(all.upper.x, b.upper.x), std::max(all.upper.y, b.upper.y),
                 std::max(all.upper.z, b.upper.z)};
  }
  return std::max(
      {all.upper.x - all.lower.x, all.upper.y - all.lower.y, all.upper.z - all.lower.z});
}

// Rays in random directions, and regions of four units, each from a point near a random box.
QueryBatch batch_of(const Case& c, const std::vector<Box>& boxes, std::mt19937& random) {
  QueryBatch batch;
  batch.kind = c.queries.kind;
  batch.one_call = c.queries.one_call;
  std::uniform_real_distribution<float> near(-3, 3), any(-1, 1);
  const float wanted = c.world_long ? extent_of(boxes) : 10;
  for (std::size_t i = 0; i < c.queries.count; ++i) {
    const Vec3& v = boxes[random() % boxes.size()].lower;
    const Vec3 from = {v.x + near(random), v.y + near(random), v.z + near(random)};
    Vec3 by;
    float length;
    do {
      by = {any(random), any(random), any(random)};
      length = std::sqrt(by.x * by.x + by.y * by.y + by.z * by.z);
    } while (length > 1 || length < 0.1f);
    const float scale = wanted / length;
    if (batch.kind == QueryBatch::overlaps)
      batch.regions.push_back({from, {from.x + 4, from.y + 4, from.z + 4}});
    else
      batch.rays.push_back({{from, from}, {by.x * scale, by.y * scale, by.z * scale}});
  }
  return batch;
}

struct Measured {
  std::unique_ptr<QueryMethod> method;
  unsigned threads;
  std::vector<double> update_ms = {}, query_ms = {};
  std::uint64_t found = 0;
};

void measure(const Case& c, std::size_t objects, const CaseOptions& a, Results& results) {
  RandomMotion motion(boxes_of(c.scene, objects), c.share);
  std::vector<Measured> all;
  for (const unsigned t : a.threads) all.push_back({std::make_unique<ThrongQueries>(t), t});
  for (const unsigned t : a.threads) all.push_back({std::make_unique<ConcurrentQueries>(t), t});
  if (a.competitors) {
    for (auto& method : query_competitors())
      if (method->supports(c.queries.kind)) all.push_back({std::move(method), 1});
  }
  for (Measured& m : all) m.method->start(motion.boxes());
  constexpr int warm_up = 4;
  const int frames = a.rounds_of(c.frames);
  for (int f = -warm_up; f < frames; ++f) {
    const Moves moves = motion.next();
    const QueryBatch batch = batch_of(c, motion.boxes(), motion.random());
    for (Measured& m : all) {
      const double update_ms = time_ms([&] { m.method->update(moves); });
      const double query_ms = time_ms([&] { m.found += m.method->run(batch); });
      if (f < 0) continue;
      m.update_ms.push_back(update_ms);
      m.query_ms.push_back(query_ms);
    }
  }
  const auto want = static_cast<double>(all[0].found);
  for (const Measured& m : all) {
    if (std::fabs(static_cast<double>(m.found) - want) > 1e-4 * want + 2)
      throw common::Failure(fmt::format("{} found {} objects, {} found {}", m.method->name(),
                                        m.found, all[0].method->name(), all[0].found),
                            common::exit_differs);
    Row row;
    row.kind = "queries";
    row.name = c.scene;
    row.objects = objects;
    row.setting = share_text(c.share) + "; " + c.text();
    row.library = m.method->name();
    row.threads = m.threads;
    row.metric = "update_ms";
    set_samples(row, m.update_ms);
    results.add(row);
    row.metric = "query_ms";
    row.found = m.found;
    row.note = "found: objects, all frames";
    set_samples(row, m.query_ms);
    results.add(std::move(row));
  }
  results.show(
      fmt::format("{}, {} boxes, {}: {}", c.scene, objects, share_text(c.share), c.text()));
}

}  // namespace

int queries_command(int argc, char** argv) {
  CaseOptions a;
  CLI::App app{"Ray casts and overlap queries among boxes that move.", "throng-bench queries"};
  app.add_flag_callback(
      "--no-competitors", [&] { a.competitors = false; }, "Only Throng");
  int status = 0;
  if (!parse_case_options(app, a, "SCENE; SHARE; QUERIES, such as 'pile; 1 % move; 10 rays',", argc,
                          argv, status))
    return status;
  Results results(a.output);
  for (const Case& c : all_cases()) {
    if (a.wanted(fmt::format("{}; {}; {}", c.scene, share_text(c.share), c.text())))
      measure(c, a.objects(100'000), a, results);
  }
  return common::exit_done;
}

}  // namespace throng::bench
