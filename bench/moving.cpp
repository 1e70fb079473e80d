// Subcommand moving: the time of frames in which some objects move, including begin and end events.
// Throng's BroadPhase, a Finder whose pairs are compared with those of the last frame, and Bullet's
// btDbvt. All methods get the same moves (random_motion.hpp), one after the other; medians over the
// frames.
#include <throng/throng.hpp>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/failure.hpp"
#include "bench/random_motion.hpp"
#include "bench/require.hpp"
#include "bench/subcommands.hpp"
#include "bench/timing.hpp"

namespace throng::bench {
namespace {

class Persistent : public MovingMethod {
 public:
  explicit Persistent(const Options& options) : broad_phase_(options) {}
  std::string name() const override { return "Throng BroadPhase"; }
  void start(const std::vector<Box>& boxes) override { start_with(broad_phase_, boxes); }
  void update(const Moves& moves) override { bench::update(broad_phase_, moves); }
  bool reports_changes() const override { return true; }
  void changes(std::vector<Pair>& begun, std::vector<Pair>& ended) override {
    for (const LivePair& p : broad_phase_.begun()) begun.push_back({p.first, p.second});
    for (const LivePair& p : broad_phase_.ended()) ended.push_back({p.first, p.second});
  }

 private:
  BroadPhase broad_phase_;
};

// Searches all pairs in sorted order, then computes the two set differences.
class SearchAgain : public MovingMethod {
 public:
  explicit SearchAgain(Options options) {
    options.order = Order::canonical;
    finder_.set_options(options);
  }
  std::string name() const override { return "Throng Finder, two set differences"; }
  void start(const std::vector<Box>& boxes) override {
    boxes_ = boxes;
    require(finder_.find(boxes_));
    last_.assign(finder_.pairs().begin(), finder_.pairs().end());
  }
  void update(const Moves& moves) override {
    if (moves.all)
      boxes_ = *moves.all;
    else
      for (std::size_t i = 0; i < moves.ids.size(); ++i) boxes_[moves.ids[i]] = moves.boxes[i];
    require(finder_.find(boxes_));
    const Pairs now = finder_.pairs();
    begun_.clear();
    ended_.clear();
    std::set_difference(now.begin(), now.end(), last_.begin(), last_.end(),
                        std::back_inserter(begun_));
    std::set_difference(last_.begin(), last_.end(), now.begin(), now.end(),
                        std::back_inserter(ended_));
    last_.assign(now.begin(), now.end());
  }
  bool reports_changes() const override { return true; }
  void changes(std::vector<Pair>& begun, std::vector<Pair>& ended) override {
    begun = begun_;
    ended = ended_;
  }

 private:
  Finder finder_;
  std::vector<Box> boxes_;
  std::vector<Pair> last_, begun_, ended_;
};

struct Case {
  const char* scene;
  std::size_t objects;
  double share;
  int frames;
  bool competitors;
};
constexpr Case cases[] = {
    {"uniform", 1000, 0.01, 2000, true},    {"uniform", 10000, 0.01, 400, true},
    {"uniform", 100000, 0.001, 200, true},  {"uniform", 100000, 0.01, 200, true},
    {"uniform", 100000, 0.05, 60, true},    {"uniform", 100000, 0.1, 40, true},
    {"uniform", 100000, 0.3, 30, true},     {"uniform", 100000, 1, 30, true},
    {"pile", 100000, 0.01, 200, true},      {"pile", 100000, 1, 12, true},
    {"mixed", 100000, 0.01, 60, true},      {"mixed", 100000, 1, 12, true},
    {"clusters", 100000, 0.01, 100, true},  {"spheres", 100000, 0.01, 100, true},
    {"rods", 100000, 0.01, 30, true},       {"pile", 100000, 0.05, 30, true},
    {"uniform", 1000000, 0.001, 100, true}, {"uniform", 1000000, 0.01, 40, true},
    {"uniform", 1000000, 1, 10, false},
};

struct Arguments : CaseOptions {
  bool small_pages = false;

  Options options(unsigned thread_count) const {
    Options o;
    o.threads = thread_count;
    if (small_pages) o.memory = std::pmr::new_delete_resource();
    return o;
  }
};

struct Measured {
  std::unique_ptr<MovingMethod> method;
  unsigned threads;
  std::vector<double> times = {};
};

std::vector<Measured> methods_of(const Case& c, const Arguments& a) {
  std::vector<Measured> all;
  for (const unsigned t : a.threads) {
    all.push_back({std::make_unique<Persistent>(a.options(t)), t});
    all.push_back({std::make_unique<SearchAgain>(a.options(t)), t});
  }
  if (!c.competitors || !a.competitors) return all;
  for (auto& method : moving_competitors()) all.push_back({std::move(method), 1});
  return all;
}

// Throws unless `method` agrees with `want`: the events of the frame. In the last frame, methods
// without events are compared by the current pairs.
void verify(MovingMethod& method, const std::vector<Box>& boxes,
            const std::vector<Pair> (&events)[2], bool last, const std::string& where) {
  std::vector<Pair> got[2];
  bool same = true;
  if (method.reports_changes()) {
    method.changes(got[0], got[1]);
    same = got[0] == events[0] && got[1] == events[1];
  } else if (last) {
    Options o;
    o.order = Order::canonical;
    const std::vector<Pair> want = find_pairs(boxes, o);
    method.changes(got[0], got[1]);
    const auto apart = [&](Pair p) { return !overlap(boxes[p.first], boxes[p.second]); };
    got[0].erase(std::remove_if(got[0].begin(), got[0].end(), apart), got[0].end());
    std::sort(got[0].begin(), got[0].end());
    same = got[0] == want;
  }
  if (!same)
    throw common::Failure(fmt::format("{}: other pairs in {}", method.name(), where),
                          common::exit_differs);
}

void measure(const Case& c, std::size_t objects, const Arguments& a, Results& results) {
  RandomMotion motion(boxes_of(c.scene, objects), c.share);
  const std::vector<Box>& boxes = motion.boxes();
  std::vector<Measured> all = methods_of(c, a);
  for (Measured& m : all) m.method->start(boxes);

  std::size_t begun = 0;
  const int frames = a.rounds_of(c.frames);
  const int warm_up = 24;
  for (int f = -warm_up; f < frames; ++f) {
    const Moves moves = motion.next();
    for (Measured& m : all) {
      const double t = time_ms([&] { m.method->update(moves); });
      if (f >= 0) m.times.push_back(t);
    }
    if (f >= 0 && f + 4 < frames && f % 16 != 0) continue;
    std::vector<Pair> events[2];
    all[1].method->changes(events[0], events[1]);  // SearchAgain
    begun = events[0].size();
    for (Measured& m : all)
      verify(*m.method, boxes, events, f + 1 == frames, fmt::format("frame {} of {}", f, c.scene));
  }
  for (const Measured& m : all) {
    Row row;
    row.kind = "moving";
    row.name = c.scene;
    row.objects = objects;
    row.setting = share_text(c.share);
    row.library = m.method->name();
    row.threads = m.threads;
    row.metric = "update_ms";
    row.found = begun;
    row.note = "found: pairs that began in the last frame";
    set_samples(row, m.times);
    results.add(std::move(row));
  }
  results.show(fmt::format("{}, {} boxes, {}", c.scene, objects, share_text(c.share)));
}

// Adds all objects in one batch and removes half of them, each with an update.
void measure_batches(std::size_t n, const Arguments& a, Results& results) {
  const std::vector<Box> boxes = boxes_of("uniform", n);
  for (const unsigned threads : a.threads) {
    std::vector<double> add, remove;
    for (int k = 0; k < a.rounds_of(11); ++k) {
      BroadPhase b(a.options(threads));
      add.push_back(time_ms([&] {
        require(b.add(boxes, nullptr));
        require(b.update());
      }));
      std::vector<ObjectId> half;
      for (std::size_t i = 0; i < n; i += 2) half.push_back(static_cast<ObjectId>(i));
      remove.push_back(time_ms([&] {
        require(b.remove(half.data(), half.size()));
        require(b.update());
      }));
    }
    Row row;
    row.kind = "moving";
    row.name = "uniform";
    row.objects = n;
    row.library = "Throng BroadPhase";
    row.threads = threads;
    row.metric = "update_ms";
    row.setting = "add all";
    set_samples(row, add);
    results.add(row);
    row.setting = "remove half";
    set_samples(row, remove);
    results.add(row);
  }
  results.show("Objects added and removed");
}

}  // namespace

int moving_command(int argc, char** argv) {
  Arguments a;
  CLI::App app{"Frames in which some boxes move, with begin and end events.",
               "throng-bench moving"};
  app.add_flag_callback(
      "--no-competitors", [&] { a.competitors = false; }, "Only Throng");
  app.add_flag("--small-pages", a.small_pages, "No large pages for Throng's memory");
  int status = 0;
  if (!parse_case_options(app, a, "SCENE-OBJECTS-SHARE", argc, argv, status)) return status;
  Results results(a.output);
  std::string last;
  for (const Case& c : cases) {
    const std::size_t objects = a.objects(c.objects);
    const std::string name = fmt::format("{}-{}-{:g}", c.scene, objects, c.share);
    // With a limit several cases are the same.
    if (!a.wanted(name) || name == last) continue;
    last = name;
    measure(c, objects, a, results);
  }
  if (a.wanted("batches")) measure_batches(a.objects(100000), a, results);
  return common::exit_done;
}

}  // namespace throng::bench
