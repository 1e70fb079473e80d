// What frames cost in which some objects move, with the pairs that began and ended: Throng's
// BroadPhase beside a Finder whose pairs are compared with the last frame's, and Bullet's btDbvt.
//
// Which objects move is told in wander.hpp. In every frame all contenders are given the same moves,
// one after the other; medians of the frames.
#include <throng/throng.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/wander.hpp"
#include "program/median.hpp"

namespace throng::bench {

const char* const program_name = "throng-bench-moving";

namespace {

using program::median;

class Persistent : public Mover {
 public:
  explicit Persistent(const Options& options) : broad_phase_(options) {}
  std::string name() const override { return "Throng BroadPhase"; }
  void start(const std::vector<Box>& boxes) override { start_with(broad_phase_, boxes); }
  void frame(const Moves& moves) override { follow(broad_phase_, moves); }
  bool tells_changes() const override { return true; }
  void changes(std::vector<Pair>& begun, std::vector<Pair>& ended) override {
    for (const LivePair& p : broad_phase_.begun()) begun.push_back({p.first, p.second});
    for (const LivePair& p : broad_phase_.ended()) ended.push_back({p.first, p.second});
  }

 private:
  BroadPhase broad_phase_;
};

// All pairs anew, in canonical order, and the two differences.
class Anew : public Mover {
 public:
  explicit Anew(Options options) {
    options.order = Order::canonical;
    finder_.set_options(options);
  }
  std::string name() const override { return "Finder and two differences"; }
  void start(const std::vector<Box>& boxes) override {
    boxes_ = boxes;
    must(finder_.find(boxes_));
    last_.assign(finder_.pairs().begin(), finder_.pairs().end());
  }
  void frame(const Moves& moves) override {
    if (moves.all)
      boxes_ = *moves.all;
    else
      for (std::size_t i = 0; i < moves.ids.size(); ++i) boxes_[moves.ids[i]] = moves.boxes[i];
    must(finder_.find(boxes_));
    const Pairs now = finder_.pairs();
    begun_.clear();
    ended_.clear();
    std::set_difference(now.begin(), now.end(), last_.begin(), last_.end(),
                        std::back_inserter(begun_));
    std::set_difference(last_.begin(), last_.end(), now.begin(), now.end(),
                        std::back_inserter(ended_));
    last_.assign(now.begin(), now.end());
  }
  bool tells_changes() const override { return true; }
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
  std::string scene;
  std::size_t objects;
  double share;
  int frames;
  bool rival;
};

struct Setting {
  std::string only;
  int frames = 0;
  std::vector<unsigned> threads = {1, 2};
  bool rivals = true;
  bool small_pages = false;
};

Options options_of(const Setting& setting, unsigned threads) {
  Options o;
  o.threads = threads;
  if (setting.small_pages) o.memory = std::pmr::new_delete_resource();
  return o;
}

void run(const Case& c, const Setting& setting) {
  Wander wander(boxes_of(c.scene, c.objects), c.share);
  const std::vector<Box>& boxes = wander.boxes();
  std::vector<std::unique_ptr<Mover>> movers;
  std::vector<unsigned> threads;
  for (const unsigned t : setting.threads) {
    movers.push_back(std::make_unique<Persistent>(options_of(setting, t)));
    movers.push_back(std::make_unique<Anew>(options_of(setting, t)));
    threads.insert(threads.end(), {t, t});
  }
  if (c.rival && setting.rivals) {
    for (auto& rival : moving_rivals()) {
      movers.push_back(std::move(rival));
      threads.push_back(1);
    }
  }
  for (auto& m : movers) m->start(boxes);

  std::vector<std::vector<double>> times(movers.size());
  double begun_count = 0;
  const int frames = setting.frames ? setting.frames : c.frames;
  const int warm = 24;
  for (int f = -warm; f < frames; ++f) {
    const Moves moves = wander.next();
    for (std::size_t m = 0; m < movers.size(); ++m) {
      const double t = ms([&] { movers[m]->frame(moves); });
      if (f >= 0) times[m].push_back(t);
    }
    if (f >= 0 && f + 4 < frames && f % 16 != 0) continue;
    // The same changes by all that tell them; the rivals' sets are compared with the boxes.
    std::vector<Pair> want[2];
    movers[1]->changes(want[0], want[1]);
    begun_count = static_cast<double>(want[0].size());
    for (auto& m : movers) {
      std::vector<Pair> got[2];
      if (m->tells_changes()) {
        m->changes(got[0], got[1]);
      } else if (f + 1 == frames) {
        Options o;
        o.order = Order::canonical;
        want[0] = find_pairs(boxes, o);
        want[1].clear();
        m->changes(got[0], got[1]);
        got[1].clear();
        got[0].erase(
            std::remove_if(got[0].begin(), got[0].end(),
                           [&](Pair p) { return !overlap(boxes[p.first], boxes[p.second]); }),
            got[0].end());
        std::sort(got[0].begin(), got[0].end());
      } else {
        continue;
      }
      if (got[0] != want[0] || got[1] != want[1]) {
        std::fprintf(stderr, "%s: %s disagrees in frame %d of %s\n", program_name,
                     m->name().c_str(), f, c.scene.c_str());
        std::exit(1);
      }
    }
  }
  for (std::size_t m = 0; m < movers.size(); ++m) {
    const std::vector<double>& t = times[m];
    const std::size_t tenth = std::max<std::size_t>(1, t.size() / 10);
    const auto part = [&](std::size_t from) {
      const auto at = t.begin() + static_cast<std::ptrdiff_t>(from);
      return median({at, at + static_cast<std::ptrdiff_t>(tenth)});
    };
    std::printf("%s,%zu,%g,%s,%u,%zu,%.4f,%.4f,%.4f,%.4f,%.0f\n", c.scene.c_str(), c.objects,
                c.share, movers[m]->name().c_str(), threads[m], t.size(), median(t),
                *std::min_element(t.begin(), t.end()), part(0), part(t.size() - tenth),
                begun_count);
  }
  std::fflush(stdout);
}

// Adding all in one batch, and removing half, update included.
void batches(std::size_t n, const Setting& setting) {
  const std::vector<Box> boxes = boxes_of("uniform", n);
  for (const unsigned threads : setting.threads) {
    std::vector<double> add, remove;
    for (int k = 0; k < 11; ++k) {
      BroadPhase b(options_of(setting, threads));
      add.push_back(ms([&] {
        must(b.add(boxes, nullptr));
        must(b.update());
      }));
      std::vector<ObjectId> half;
      for (std::size_t i = 0; i < n; i += 2) half.push_back(static_cast<ObjectId>(i));
      remove.push_back(ms([&] {
        must(b.remove(half.data(), half.size()));
        must(b.update());
      }));
    }
    std::printf("uniform,%zu,add,Throng BroadPhase,%u,11,%.3f,,,,\n", n, threads, median(add));
    std::printf("uniform,%zu,remove half,Throng BroadPhase,%u,11,%.3f,,,,\n", n, threads,
                median(remove));
  }
}

}  // namespace
}  // namespace throng::bench

int main(int argc, char** argv) {
  using namespace throng::bench;
  Setting setting;
  CLI::App app{"Frames in which some objects move: CSV on standard output"};
  app.add_option("--only", setting.only, "only cases whose SCENE-OBJECTS-SHARE contains this");
  app.add_option("--frames", setting.frames, "so many frames in each case");
  app.add_option("--threads", setting.threads, "thread counts of Throng");
  app.add_flag("!--no-rivals", setting.rivals, "without the rivals");
  app.add_flag("--small-pages", setting.small_pages, "no large pages for Throng's memory");
  CLI11_PARSE(app, argc, argv);
  std::printf(
      "scene,objects,share,contender,threads,frames,ms,least_ms,first_tenth_ms,last_tenth_ms,"
      "begun\n");
  const Case cases[] = {
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
  for (const Case& c : cases) {
    char name[96];
    std::snprintf(name, sizeof name, "%s-%zu-%g", c.scene.c_str(), c.objects, c.share);
    if (std::string(name).find(setting.only) != std::string::npos) run(c, setting);
  }
  if (std::string("batches").find(setting.only) != std::string::npos) batches(100000, setting);
}
