// Subcommand doubles: exact pairs of boxes of doubles, compared with boxes of floats, with rounding
// outward and testing each pair again, and with CGAL. All methods in turn; medians.
#include <throng/throng.hpp>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/failure.hpp"
#include "bench/competitors/doubles.hpp"
#include "bench/random_motion.hpp"
#include "bench/require.hpp"
#include "bench/subcommands.hpp"
#include "bench/timing.hpp"

namespace throng::bench {
namespace {

using DoubleList = std::vector<DoubleBox>;

// The scene at a third of its size, so that hardly any coordinate is a float, at a distance of
// `origin`.
DoubleList doubles_of(const std::vector<Box>& boxes, double origin) {
  DoubleList list;
  const auto at = [&](const Vec3& v) {
    return DoubleVec3{double{v.x} / 3 + origin, double{v.y} / 3 + origin, double{v.z} / 3 + origin};
  };
  for (const Box& box : boxes) list.push_back({at(box.lower), at(box.upper)});
  return list;
}

struct Measured {
  std::string library, setting;
  std::function<std::size_t()> find;  // returns the number of pairs
  std::vector<double> times = {};
  std::size_t pairs = 0;
};

Box outward(const DoubleBox& b) { return round_outward(&b.lower.x, &b.upper.x); }

bool overlap(const DoubleBox& a, const DoubleBox& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y &&
         b.lower.y <= a.upper.y && a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}

template <class AnyBox>
std::function<std::size_t()> search(Finder& finder, const std::vector<AnyBox>& boxes) {
  return [&] {
    require(finder.find(boxes));
    return finder.pairs().size();
  };
}

void measure(const char* scene, std::size_t count, unsigned threads, int rounds, bool competitors,
             Results& results) {
  const std::vector<Box> floats = boxes_of(scene, count);
  const DoubleList boxes = doubles_of(floats, 0), far = doubles_of(floats, 1e6);
  std::vector<Box> rounded;
  for (const DoubleBox& box : boxes) rounded.push_back(outward(box));
  Options options;
  options.threads = threads;
  Finder of_floats(options), of_doubles(options), of_far(options), of_outward(options);
  std::vector<Box> copy;
  std::vector<Pair> exact;

  std::vector<Measured> all;
  all.push_back({"Throng Finder", "floats", search(of_floats, rounded)});
  all.push_back({"Throng Finder", "doubles", search(of_doubles, boxes)});
  all.push_back({"Throng Finder", "doubles, a million units away", search(of_far, far)});
  all.push_back({"Throng Finder", "rounded outward, each pair tested again", [&] {
                   copy.resize(boxes.size());
                   std::transform(boxes.begin(), boxes.end(), copy.begin(), outward);
                   require(of_outward.find(copy));
                   exact.clear();
                   for (const Pair pair : of_outward.pairs())
                     if (overlap(boxes[pair.first], boxes[pair.second])) exact.push_back(pair);
                   return exact.size();
                 }});
  const auto others = threads == 1 && competitors ? double_competitors()
                                                  : std::vector<std::unique_ptr<DoubleMethod>>();
  for (const auto& method : others)
    all.push_back({method->name(), "doubles", [&] { return method->run(boxes); }});
  for (int round = -1; round < rounds; ++round) {
    for (Measured& m : all) {
      const double time = time_ms([&] { m.pairs = m.find(); });
      if (round >= 0) m.times.push_back(time);
    }
  }
  for (const Measured& m : all) {
    // Of floats, rounding may add pairs; a shift rounds the coordinates.
    if (m.setting.find("away") == std::string::npos && m.setting != "floats" &&
        m.pairs != all[1].pairs)
      throw common::Failure(
          fmt::format("{}: {} pairs, wanted {}", m.library, m.pairs, all[1].pairs),
          common::exit_differs);
    Row row;
    row.kind = "doubles";
    row.name = scene;
    row.objects = count;
    row.setting = m.setting;
    row.library = m.library;
    row.threads = threads;
    row.metric = "search_ms";
    row.found = m.pairs;
    set_samples(row, m.times);
    results.add(std::move(row));
  }
  results.show(
      fmt::format("{}, {} boxes, {} thread{}", scene, count, threads, threads == 1 ? "" : "s"));
}

}  // namespace

int doubles_command(int argc, char** argv) {
  CaseOptions a;
  CLI::App app{"Boxes of doubles.", "throng-bench doubles"};
  app.add_flag_callback(
      "--no-competitors", [&] { a.competitors = false; }, "Only Throng");
  int status = 0;
  if (!parse_case_options(app, a, "SCENE-OBJECTS", argc, argv, status)) return status;
  Results results(a.output);
  const struct {
    const char* scene;
    std::size_t objects;
    int rounds;
  } cases[] = {{"uniform", 10'000, 41},
               {"uniform", 100'000, 15},
               {"uniform", 1'000'000, 7},
               {"pile", 100'000, 15},
               {"mixed", 100'000, 15}};
  for (const unsigned threads : a.threads) {
    std::string last;
    for (const auto& c : cases) {
      const std::size_t objects = a.objects(c.objects);
      const std::string name = fmt::format("{}-{}", c.scene, objects);
      if (!a.wanted(name) || name == last) continue;
      last = name;
      measure(c.scene, objects, threads, a.rounds_of(c.rounds), a.competitors, results);
    }
  }
  return common::exit_done;
}

}  // namespace throng::bench
