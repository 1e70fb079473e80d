#include "bench/validate.hpp"

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <throng/checksum.hpp>
#include <throng/cuda.hpp>
#include <throng/throng.hpp>

#include "apps/common/failure.hpp"
#include "apps/report/format.hpp"
#include "apps/scenes/golden.hpp"
#include "apps/scenes/scene.hpp"

namespace throng::bench {
namespace {

struct Made {
  std::vector<Box> boxes;
  std::vector<std::int32_t> worlds;

  Made(const std::string& name, std::size_t objects, std::size_t frame) {
    scenes::Spec spec;
    spec.name = name;
    spec.objects = objects;
    spec.frames = frame + 1;
    const scenes::Scene scene(spec);
    boxes.resize(objects);
    scene.frame(frame, boxes.data());
    for (std::size_t i = 0; i < objects && scene.has_worlds(); ++i)
      worlds.push_back(scene.world(i));
  }
  Boxes view() const {
    Boxes view = boxes;
    if (!worlds.empty()) view.filters.world = {worlds.data(), worlds.size()};
    return view;
  }
};

struct Way {
  std::string name;
  Options options;
};

// Every instruction set of this processor on 1 to 8 threads, the GPU pipeline on the CPU, and a
// GPU.
std::vector<Way> ways(std::size_t objects) {
  std::vector<Way> all;
  Options options;
  options.order = Order::canonical;
  options.algorithm = Algorithm::grid;
  options.backend = Backend::cpu;
  for (const Isa isa : all_isas) {
    options.isa = isa;
    options.threads = 1;
    if (Finder(options).find(Boxes()).status == Status::unsupported_isa) continue;
    for (options.threads = 1; options.threads <= 8; ++options.threads) {
      all.push_back({fmt::format("{}, {} threads", to_string(isa), options.threads), options});
    }
  }
  options.isa = Isa::automatic;
  options.threads = 0;
  if (objects <= 10000) {
    options.algorithm = Algorithm::all_pairs;
    all.push_back({"brute force", options});
    options.algorithm = Algorithm::grid;
  }
  if (objects <= 100000) {
    options.backend = Backend::emulated;
    all.push_back({"a GPU's pipeline on the CPU", options});
  }
  if (cuda::available().ok()) {
    options.backend = Backend::cuda;
    all.push_back({"GPU", options});
  }
  return all;
}

}  // namespace

int validate(std::size_t most_objects) {
  int different = 0, checked = 0;
  for (const scenes::Golden& want : scenes::golden()) {
    if (want.objects > most_objects) continue;
    const Made made(want.scene, want.objects, want.frame);
    int wrong = 0;
    const std::vector<Way> all = ways(want.objects);
    for (const Way& way : all) {
      Finder finder(way.options);
      const Result result = finder.find(made.view());
      if (!result.ok()) throw common::Failure(fmt::format("{}: {}", way.name, result.message));
      const Pairs pairs = finder.pairs();
      const std::uint64_t canonical = scenes::sequence_checksum(pairs.data(), pairs.size());
      if (result.found == want.pairs && canonical == want.canonical) continue;
      fmt::print(
          "DIFFERENT: {} of {} boxes by {}: {} pairs, canonical {:016x}; wanted {}, {:016x}\n",
          want.scene, want.objects, way.name, result.found, canonical, want.pairs, want.canonical);
      ++wrong;
    }
    fmt::print("{:<11} {:>9} boxes {:>9} pairs  canonical {:016x}  {} ways: {}\n", want.scene,
               report::format_count(want.objects), report::format_count(want.pairs), want.canonical,
               all.size(), wrong == 0 ? "the same bytes" : fmt::format("{} differ", wrong));
    std::fflush(stdout);
    different += wrong;
    checked += static_cast<int>(all.size());
  }
  fmt::print("{} searches, {} different\n", checked, different);
  return different;
}

void print_golden() {
  for (const std::string& name : scenes::names()) {
    for (const std::size_t objects : {1000u, 10000u, 100000u, 1000000u}) {
      const std::size_t frame = name == "column" ? 60 : 0;
      const Made made(name, objects, frame);
      Options options;
      options.backend = Backend::cpu;
      options.order = Order::canonical;
      const std::vector<Pair> pairs = find_pairs(made.view(), options);
      fmt::print("    {{\"{}\", {}, {}, {}, 0x{:016x}, 0x{:016x}}},\n", name, frame, objects,
                 pairs.size(), pair_checksum(pairs.data(), pairs.size()),
                 scenes::sequence_checksum(pairs.data(), pairs.size()));
      std::fflush(stdout);
    }
  }
}

}  // namespace throng::bench
