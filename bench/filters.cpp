// What filters cost: searches of the same boxes without any and with those that engines have, in
// turn, as two sets, and worlds apart and in one place; objects that live, with filters and
// without. CSV on standard output: medians, and the share of the time without filters (of worlds:
// apart).
#include <throng/throng.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/wander.hpp"
#include "program/median.hpp"

namespace throng::bench {

const char* const program_name = "throng-bench-filters";

namespace {

using program::median;

// Boxes with values of all filters, those that are not used left empty.
struct Filtered {
  std::string name;
  std::vector<Box> boxes;
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;
  std::size_t first = 0;  // boxes of the first of two sets, which the others are searched with

  Boxes view() const {
    Boxes v = boxes;
    const auto hang = [](auto& filter, const auto& values) {
      if (!values.empty()) filter = {values.data(), values.size()};
    };
    hang(v.filters.group, group);
    hang(v.filters.mask, mask);
    hang(v.filters.owner, owner);
    hang(v.filters.world, world);
    hang(v.filters.is_static, is_static);
    return v;
  }
};

// `share` of the boxes, drawn at random, are static.
std::vector<std::uint8_t> statics(std::size_t n, double share) {
  std::mt19937 random(1);
  std::vector<std::uint8_t> is_static;
  for (std::size_t i = 0; i < n; ++i) is_static.push_back(random() < share * 4294967296.0 ? 1 : 0);
  return is_static;
}

// Layers, each with a mask of its own.
void add_layers(Filtered& c, std::uint32_t layers) {
  std::mt19937 random(layers);
  std::vector<std::uint32_t> meets;
  for (std::uint32_t k = 0; k < layers; ++k) meets.push_back(static_cast<std::uint32_t>(random()));
  for (std::size_t i = 0; i < c.boxes.size(); ++i) {
    const auto layer = static_cast<std::uint32_t>(random() % layers);
    c.group.push_back(1u << layer);
    c.mask.push_back(meets[layer]);
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
  Filtered& alike = add("one group for all");
  alike.group.assign(n, 1);
  alike.mask.assign(n, 0xffffffffu);
  Filtered& groups = add("a tenth static by group");
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
  Filtered& owners = add("an owner for every four");
  for (std::size_t i = 0; i < n; ++i) owners.owner.push_back(static_cast<std::int32_t>(i / 4));
  add("one world").world.assign(n, 0);
  add("two halves").first = n / 2;
  add("a tenth and the rest").first = n / 10;
  add("a hundredth and the rest").first = n / 100;
  return cases;
}

// Unit cubes at two pairs a box, in `worlds` cubes in one place, or apart.
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
  shuffled.name = "in one place and any order";
  for (std::size_t i = shuffled.boxes.size() - 1; i > 0; --i) {
    const std::size_t j = random() % (i + 1);
    std::swap(shuffled.boxes[i], shuffled.boxes[j]);
    std::swap(shuffled.world[i], shuffled.world[j]);
  }
  ground.name = "in one place with a ground";
  ground.boxes.push_back({{-1, -1, -1}, {side + 1, side + 1, -0.5f}});
  ground.world.push_back(-1);
  still.name = "in one place with 0.3 static";
  still.is_static = statics(still.boxes.size(), 0.3);
  return {apart, place, shuffled, ground, still};
}

void tell(const std::string& scene, const Filtered& c, const char* what, unsigned threads,
          double time, double without, std::uint64_t pairs) {
  std::printf("%s,%zu,%s,%s,%u,%.4f,%.3f,%llu\n", scene.c_str(), c.boxes.size(), c.name.c_str(),
              what, threads, time, time / without, static_cast<unsigned long long>(pairs));
  std::fflush(stdout);
}

void search(const std::string& scene, const std::vector<Filtered>& cases, unsigned threads,
            int rounds) {
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
      const double time = ms([&] {
        result = first == 0 ? finders[k].find(view)
                            : finders[k].find({boxes, first}, {boxes + first, view.size() - first});
      });
      must(result);
      pairs[k] = result.found;
      if (round >= 0) times[k].push_back(time);
    }
  }
  const double without = median(times[0]);
  for (std::size_t k = 0; k < cases.size(); ++k)
    tell(scene, cases[k], "search", threads, median(times[k]), without, pairs[k]);
}

void live(const std::string& scene, const std::vector<Filtered>& cases, double share,
          unsigned threads, int frames) {
  Options o;
  o.threads = threads;
  Wander wander(cases[0].boxes, share);
  std::vector<std::unique_ptr<BroadPhase>> all;
  for (const Filtered& c : cases) {
    if (c.first != 0) continue;  // they come last
    all.push_back(std::make_unique<BroadPhase>(o));
    must(all.back()->add(c.view(), nullptr));
    must(all.back()->update());
  }
  std::vector<std::vector<double>> times(cases.size());
  for (int f = -2; f < frames; ++f) {
    const Moves moves = wander.next();
    for (std::size_t k = 0; k < all.size(); ++k) {
      const double time = ms([&] { follow(*all[k], moves); });
      if (f >= 0) times[k].push_back(time);
    }
  }
  const double without = median(times[0]);
  for (std::size_t k = 0; k < all.size(); ++k) {
    tell(scene, cases[k], share == 1 ? "all move" : "1 % moves", threads, median(times[k]), without,
         all[k]->pairs().size());
  }
}

}  // namespace
}  // namespace throng::bench

int main(int argc, char** argv) {
  using namespace throng::bench;
  std::string only;
  std::vector<unsigned> threads = {1, 2};
  CLI::App app{"What filters cost: CSV on standard output"};
  app.add_option("--only", only, "only scenes whose name contains this");
  app.add_option("--threads", threads, "thread counts");
  CLI11_PARSE(app, argc, argv);
  const auto wanted = [&](const std::string& name) { return name.find(only) != std::string::npos; };
  std::printf("scene,boxes,filters,what,threads,ms,times_without,pairs\n");
  for (const unsigned t : threads) {
    for (const char* scene : {"uniform", "pile", "mixed"}) {
      if (!wanted(scene)) continue;
      const auto cases = filtered(boxes_of(scene, 100'000));
      search(scene, cases, t, 61);
      live(scene, cases, 0.01, t, 41);
      live(scene, cases, 1, t, 15);
    }
    if (wanted("uniform-1M")) search("uniform-1M", filtered(boxes_of("uniform", 1'000'000)), t, 9);
    for (const auto& [count, each] :
         {std::pair{8192, 64}, {4096, 24}, {1000, 100}, {64, 1500}, {8, 12'500}}) {
      const std::string name = "worlds-" + std::to_string(count) + "x" + std::to_string(each);
      if (wanted(name))
        search(name, worlds(static_cast<std::size_t>(count), static_cast<std::size_t>(each)), t,
               21);
    }
  }
}
