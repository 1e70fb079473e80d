// Subcommand filters: searches of the same boxes without filters and with those that engines have,
// in turn; as two sets; many worlds in one place and apart; and persistent objects with filters.
#include <throng/throng.hpp>

#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <utility>
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

// Boxes with the values of all filters; unused filters are empty.
struct Filtered {
  std::string name;
  std::vector<Box> boxes;
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;
  std::size_t first = 0;  // size of the first of two sets; the others are the second. 0: one set

  Boxes view() const {
    Boxes v = boxes;
    const auto set = [](auto& filter, const auto& values) {
      if (!values.empty()) filter = {values.data(), values.size()};
    };
    set(v.filters.group, group);
    set(v.filters.mask, mask);
    set(v.filters.owner, owner);
    set(v.filters.world, world);
    set(v.filters.is_static, is_static);
    return v;
  }
};

// A random `share` of the boxes is static.
std::vector<std::uint8_t> statics(std::size_t n, double share) {
  std::mt19937 random(1);
  std::vector<std::uint8_t> is_static;
  for (std::size_t i = 0; i < n; ++i) is_static.push_back(random() < share * 4294967296.0 ? 1 : 0);
  return is_static;
}

// Layers, each with its own random mask.
void add_layers(Filtered& c, std::uint32_t layers) {
  std::mt19937 random(layers);
  std::vector<std::uint32_t> masks;
  for (std::uint32_t k = 0; k < layers; ++k) masks.push_back(static_cast<std::uint32_t>(random()));
  for (std::size_t i = 0; i < c.boxes.size(); ++i) {
    const auto layer = static_cast<std::uint32_t>(random() % layers);
    c.group.push_back(1u << layer);
    c.mask.push_back(masks[layer]);
  }
}

std::vector<Filtered> filtered(const std::vector<Box>& boxes) {
  const std::size_t n = boxes.size();
  std::vector<Filtered> cases;
  const auto add = [&](const char* name) -> Filtered& {
    cases.push_back({name, boxes, {}, {}, {}, {}, {}, 0});
    return cases.back();
  };
  add("none");
  Filtered& alike = add("one group");
  alike.group.assign(n, 1);
  alike.mask.assign(n, 0xffffffffu);
  Filtered& groups = add("0.1 static by group");
  for (const std::uint8_t still : statics(n, 0.1)) {
    groups.group.push_back(still ? 2 : 1);
    groups.mask.push_back(still ? ~2u : ~0u);
  }
  add_layers(add("4 layers"), 4);
  add_layers(add("12 layers"), 12);
  add_layers(add("32 layers"), 32);
  for (const double share : {0.1, 0.3, 0.9}) {
    add(share == 0.1   ? "0.1 static"
        : share == 0.3 ? "0.3 static"
                       : "0.9 static")
        .is_static = statics(n, share);
  }
  Filtered& owners = add("one owner per four boxes");
  for (std::size_t i = 0; i < n; ++i) owners.owner.push_back(static_cast<std::int32_t>(i / 4));
  add("one world").world.assign(n, 0);
  add("two sets, halves").first = n / 2;
  add("two sets, 0.1 and 0.9").first = n / 10;
  add("two sets, 0.01 and 0.99").first = n / 100;
  return cases;
}

// Unit cubes at two pairs per box in `count` worlds, all in one place or apart.
std::vector<Filtered> worlds(std::size_t count, std::size_t each) {
  std::mt19937 random(1);
  const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  const float side = std::cbrt(2 * static_cast<float>(each));
  const auto row = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  Filtered apart{"apart", {}, {}, {}, {}, {}, {}, 0};
  Filtered place{"in one place", {}, {}, {}, {}, {}, {}, 0};
  for (std::size_t i = 0; i < count * each; ++i) {
    const std::size_t w = i / each;
    const Vec3 v{unit() * side, unit() * side, unit() * side};
    const float x = static_cast<float>(w % row) * (side + 2),
                y = static_cast<float>(w / row) * (side + 2);
    place.world.push_back(static_cast<std::int32_t>(w));
    place.boxes.push_back({v, {v.x + 1, v.y + 1, v.z + 1}});
    apart.boxes.push_back({{v.x + x, v.y + y, v.z}, {v.x + x + 1, v.y + y + 1, v.z + 1}});
  }
  Filtered shuffled = place, ground = place, still = place;
  shuffled.name = "in one place, shuffled";
  for (std::size_t i = shuffled.boxes.size() - 1; i > 0; --i) {
    const std::size_t j = random() % (i + 1);
    std::swap(shuffled.boxes[i], shuffled.boxes[j]);
    std::swap(shuffled.world[i], shuffled.world[j]);
  }
  ground.name = "in one place, with a ground";
  ground.boxes.push_back({{-1, -1, -1}, {side + 1, side + 1, -0.5f}});
  ground.world.push_back(-1);
  still.name = "in one place, 0.3 static";
  still.is_static = statics(still.boxes.size(), 0.3);
  return {apart, place, shuffled, ground, still};
}

void add_row(Results& results, const std::string& scene, const Filtered& c,
             const std::string& motion, unsigned threads, const std::vector<double>& times,
             std::uint64_t pairs) {
  Row row;
  row.kind = "filters";
  row.name = scene;
  row.objects = c.boxes.size();
  row.setting = motion.empty() ? c.name : c.name + "; " + motion;
  row.library = motion.empty() ? "Throng Finder" : "Throng BroadPhase";
  row.threads = threads;
  row.metric = motion.empty() ? "search_ms" : "update_ms";
  row.found = pairs;
  set_samples(row, times);
  results.add(std::move(row));
}

void search(const std::string& scene, const std::vector<Filtered>& cases, unsigned threads,
            int rounds, Results& results) {
  Options o;
  o.threads = threads;
  std::vector<Finder> finders;
  for (std::size_t k = 0; k < cases.size(); ++k) finders.emplace_back(o);
  std::vector<std::vector<double>> times(cases.size());
  std::vector<std::uint64_t> pairs(cases.size());
  for (int round = -2; round < rounds; ++round) {
    for (std::size_t k = 0; k < cases.size(); ++k) {
      const Boxes view = cases[k].view();
      const Box* const boxes = cases[k].boxes.data();
      const std::size_t first = cases[k].first;
      Result result;
      const double time = time_ms([&] {
        result = first == 0 ? finders[k].find(view)
                            : finders[k].find({boxes, first}, {boxes + first, view.size() - first});
      });
      require(result);
      pairs[k] = result.found;
      if (round >= 0) times[k].push_back(time);
    }
  }
  for (std::size_t k = 0; k < cases.size(); ++k)
    add_row(results, scene, cases[k], "", threads, times[k], pairs[k]);
  results.show(fmt::format("{}, search, {} thread{}", scene, threads, threads == 1 ? "" : "s"));
}

void track(const std::string& scene, const std::vector<Filtered>& cases, double share,
           unsigned threads, int frames, Results& results) {
  Options o;
  o.threads = threads;
  RandomMotion motion(cases[0].boxes, share);
  std::vector<std::unique_ptr<BroadPhase>> all;
  for (const Filtered& c : cases) {
    if (c.first != 0) continue;  // two sets are the last cases
    all.push_back(std::make_unique<BroadPhase>(o));
    require(all.back()->add(c.view(), nullptr));
    require(all.back()->update());
  }
  std::vector<std::vector<double>> times(cases.size());
  for (int f = -2; f < frames; ++f) {
    const Moves moves = motion.next();
    for (std::size_t k = 0; k < all.size(); ++k) {
      const double time = time_ms([&] { update(*all[k], moves); });
      if (f >= 0) times[k].push_back(time);
    }
  }
  for (std::size_t k = 0; k < all.size(); ++k)
    add_row(results, scene, cases[k], share_text(share), threads, times[k], all[k]->pairs().size());
  results.show(fmt::format("{}, {}, {} thread{}", scene, share_text(share), threads,
                           threads == 1 ? "" : "s"));
}

}  // namespace

int filters_command(int argc, char** argv) {
  CaseOptions a;
  CLI::App app{"Searches with groups, masks, owners, worlds and static boxes.",
               "throng-bench filters"};
  int status = 0;
  if (!parse_case_options(app, a, "scene", argc, argv, status)) return status;
  Results results(a.output);
  for (const unsigned t : a.threads) {
    for (const char* scene : {"uniform", "pile", "mixed"}) {
      if (!a.wanted(scene)) continue;
      const auto cases = filtered(boxes_of(scene, a.objects(100'000)));
      search(scene, cases, t, a.rounds_of(61), results);
      track(scene, cases, 0.01, t, a.rounds_of(41), results);
      track(scene, cases, 1, t, a.rounds_of(15), results);
    }
    if (a.wanted("uniform") && a.objects(1'000'000) == 1'000'000)
      search("uniform", filtered(boxes_of("uniform", 1'000'000)), t, a.rounds_of(9), results);
    for (const auto& [count, each] :
         {std::pair{8192, 64}, {4096, 24}, {1000, 100}, {64, 1500}, {8, 12'500}}) {
      const std::string name = fmt::format("worlds {} x {}", count, each);
      const auto size = static_cast<std::size_t>(each);
      const std::size_t worlds_count = a.objects(static_cast<std::size_t>(count) * size) / size;
      if (a.wanted(name) && worlds_count > 0)
        search(name, worlds(worlds_count, size), t, a.rounds_of(21), results);
    }
  }
  return common::exit_done;
}

}  // namespace throng::bench
