// What questions to boxes that move cost: rays, and what lies in a region, some each frame, one by
// one or in one call. Throng's BroadPhase beside Bullet's btDbvt and a tree of Embree's.
//
// Which boxes move is told in wander.hpp. In every frame all contenders are told the same moves and
// asked the same questions, one contender after the other; medians of the frames. How many objects
// all questions found is compared: rounding may decide otherwise of a ray that grazes a box.
#include <throng/throng.hpp>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/questions.hpp"
#include "bench/wander.hpp"
#include "program/median.hpp"

namespace throng::bench {

const char* const program_name = "throng-bench-questions";

namespace {

using program::median;

class Throng : public Answerer {
 public:
  explicit Throng(unsigned threads) {
    Options o;
    o.threads = threads;
    broad_phase_ = BroadPhase(o);
  }
  std::string name() const override { return "Throng BroadPhase"; }
  bool answers(Questions::Kind) const override { return true; }
  void start(const std::vector<Box>& boxes) override { start_with(broad_phase_, boxes); }
  void frame(const Moves& moves) override { follow(broad_phase_, moves); }
  std::uint64_t ask(const Questions& q) override {
    return ask_by([&](const Boxes& boxes) { return broad_phase_.find_overlaps(boxes); },
                  [&](const auto&... sweeps) { return broad_phase_.find_hits(sweeps...); }, q, 0,
                  q.size());
  }

 protected:
  // Questions begin .. end-1, one by one or in one call.
  template <class Overlaps, class Hits>
  static std::uint64_t ask_by(const Overlaps& overlaps, const Hits& hits, const Questions& q,
                              std::size_t begin, std::size_t end) {
    const SweepHits which = q.kind == Questions::first ? SweepHits::first : SweepHits::all;
    const std::size_t step = q.at_once ? end - begin : 1;
    std::uint64_t found = 0;
    for (std::size_t i = begin; i < end; i += step) {
      const Result r = q.kind == Questions::region ? overlaps(Boxes(q.regions.data() + i, step))
                                                   : hits(q.rays.data() + i, step, which);
      must(r);
      found += r.found;
    }
    return found;
  }

  BroadPhase broad_phase_;
};

// Several threads that ask at once, each some of the questions.
class Askers : public Throng {
 public:
  explicit Askers(unsigned count) : Throng(1), turn_(count) {
    Options o;
    o.threads = 1;
    while (queries_.size() < count) queries_.emplace_back(o);
    for (std::size_t k = 1; k < count; ++k) {
      others_.emplace_back([this, k] {
        for (turn_.arrive_and_wait(); asked_; turn_.arrive_and_wait()) {
          answer(k);
          turn_.arrive_and_wait();
        }
      });
    }
  }
  ~Askers() override {
    asked_ = nullptr;
    turn_.arrive_and_wait();
    for (std::thread& other : others_) other.join();
  }
  std::string name() const override { return "Throng BroadPhaseQuery"; }
  std::uint64_t ask(const Questions& q) override {
    asked_ = &q;
    found_ = 0;
    turn_.arrive_and_wait();
    answer(0);
    turn_.arrive_and_wait();
    return found_;
  }

 private:
  void answer(std::size_t k) {
    const std::size_t count = asked_->size(), askers = queries_.size();
    found_ += ask_by(
        [&](const Boxes& boxes) { return queries_[k].find_overlaps(broad_phase_, boxes); },
        [&](const auto&... sweeps) { return queries_[k].find_hits(broad_phase_, sweeps...); },
        *asked_, count * k / askers, count * (k + 1) / askers);
  }

  std::vector<BroadPhaseQuery> queries_;
  std::vector<std::thread> others_;
  std::barrier<> turn_;
  const Questions* asked_ = nullptr;
  std::atomic<std::uint64_t> found_{0};
};

struct Case {
  const char* scene;
  double share;
  Questions::Kind kind;
  std::size_t count;
  bool at_once;
  bool far;  // rays as long as the world, not ten units
  int frames;

  std::string kind_name() const {
    constexpr const char* names[] = {"first", "all", "region"};
    return std::string(far ? "far " : "") + names[kind];
  }
};
constexpr std::size_t object_count = 100'000;

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

// Rays in any direction, and regions of four units, from near some box.
Questions questions_of(const Case& c, const std::vector<Box>& boxes, std::mt19937& random) {
  Questions q;
  q.kind = c.kind;
  q.at_once = c.at_once;
  std::uniform_real_distribution<float> near(-3, 3), any(-1, 1);
  const float wanted = c.far ? extent_of(boxes) : 10;
  for (std::size_t i = 0; i < c.count; ++i) {
    const Vec3& v = boxes[random() % boxes.size()].lower;
    const Vec3 from = {v.x + near(random), v.y + near(random), v.z + near(random)};
    Vec3 by;
    float length;
    do {
      by = {any(random), any(random), any(random)};
      length = std::sqrt(by.x * by.x + by.y * by.y + by.z * by.z);
    } while (length > 1 || length < 0.1f);
    const float scale = wanted / length;
    if (c.kind == Questions::region)
      q.regions.push_back({from, {from.x + 4, from.y + 4, from.z + 4}});
    else
      q.rays.push_back({{from, from}, {by.x * scale, by.y * scale, by.z * scale}});
  }
  return q;
}

void run(const Case& c, const std::vector<unsigned>& thread_counts, bool with_rivals) {
  Wander wander(boxes_of(c.scene, object_count), c.share);
  std::vector<std::unique_ptr<Answerer>> all;
  std::vector<unsigned> threads = thread_counts;
  all.reserve(2 * thread_counts.size());
  for (const unsigned t : thread_counts) all.push_back(std::make_unique<Throng>(t));
  for (const unsigned t : thread_counts) all.push_back(std::make_unique<Askers>(t));
  threads.insert(threads.end(), thread_counts.begin(), thread_counts.end());
  if (with_rivals) {
    for (auto& rival : answering_rivals()) {
      if (rival->answers(c.kind)) all.push_back(std::move(rival));
    }
  }
  threads.resize(all.size(), 1);  // of who asks
  for (auto& a : all) a->start(wander.boxes());
  std::vector<std::vector<double>> update(all.size()), ask(all.size());
  std::vector<std::uint64_t> found(all.size());
  constexpr int warm = 4;
  for (int f = -warm; f < c.frames; ++f) {
    const Moves moves = wander.next();
    const Questions questions = questions_of(c, wander.boxes(), wander.random());
    for (std::size_t a = 0; a < all.size(); ++a) {
      const double first = ms([&] { all[a]->frame(moves); });
      const double second = ms([&] { found[a] += all[a]->ask(questions); });
      if (f < 0) continue;
      update[a].push_back(first);
      ask[a].push_back(second);
    }
  }
  for (std::size_t a = 0; a < all.size(); ++a) {
    const double less = std::fabs(static_cast<double>(found[a]) - static_cast<double>(found[0]));
    if (less > 1e-4 * static_cast<double>(found[0]) + 2) {
      std::fprintf(stderr, "%s: %s found %llu and not %llu\n", program_name, all[a]->name().c_str(),
                   static_cast<unsigned long long>(found[a]),
                   static_cast<unsigned long long>(found[0]));
      std::exit(1);
    }
    const double asked = median(ask[a]);
    std::printf("%s,%zu,%g,%s,%zu,%s,%s,%u,%d,%.4f,%.4f,%.3f,%.2f\n", c.scene, object_count,
                c.share, c.kind_name().c_str(), c.count, c.at_once ? "yes" : "no",
                all[a]->name().c_str(), threads[a], c.frames, median(update[a]), asked,
                1000 * asked / static_cast<double>(c.count),
                static_cast<double>(found[a]) / static_cast<double>(c.count) / (c.frames + warm));
  }
  std::fflush(stdout);
}

}  // namespace
}  // namespace throng::bench

int main(int argc, char** argv) {
  using namespace throng::bench;
  std::string only;
  std::vector<unsigned> threads = {1, 2};
  bool rivals = true;
  CLI::App app{"Questions to boxes that move: CSV on standard output"};
  app.add_option("--only", only, "only cases whose SCENE-SHARE-KIND-COUNT contains this");
  app.add_option("--threads", threads, "thread counts of Throng");
  app.add_flag("!--no-rivals", rivals, "without the rivals");
  CLI11_PARSE(app, argc, argv);
  std::printf(
      "scene,objects,share,kind,count,at_once,contender,threads,frames,update_ms,ask_ms,us_each,"
      "found_each\n");
  struct Set {
    Questions::Kind kind;
    std::size_t count;
    bool at_once;
  };
  const Set sets[] = {{Questions::first, 1, false},   {Questions::first, 10, false},
                      {Questions::first, 100, false}, {Questions::first, 1000, false},
                      {Questions::first, 1000, true}, {Questions::first, 20'000, true},
                      {Questions::all, 1000, true},   {Questions::region, 10, false},
                      {Questions::region, 1000, true}};
  const Set far_sets[] = {{Questions::first, 1000, true}, {Questions::all, 1000, true}};
  const auto go = [&](const char* scene, double share, const Set& set, bool far) {
    const Case c{scene, share, set.kind, set.count, set.at_once, far, share == 1 ? 12 : 40};
    char name[96];
    std::snprintf(name, sizeof name, "%s-%g-%s-%zu", scene, share, c.kind_name().c_str(),
                  set.count);
    if (std::string(name).find(only) != std::string::npos) run(c, threads, rivals);
  };
  for (const char* scene : {"uniform", "pile", "mixed"}) {
    for (const double share : {0.01, 1.0})
      for (const Set& set : sets) go(scene, share, set, false);
  }
  for (const char* scene : {"uniform", "mixed", "clusters"})
    for (const Set& set : far_sets) go(scene, 0.01, set, true);
}
