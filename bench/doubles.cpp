// Boxes of doubles: what exact pairs of these cost beside those of floats, beside rounding outward
// and looking at each pair again, and beside CGAL, which takes doubles. In turn; CSV on standard
// output, medians.
#include <throng/throng.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#if defined(THRONG_CGAL)
#include <CGAL/box_intersection_d.h>
#endif

#include "bench/wander.hpp"
#include "program/median.hpp"

namespace throng::bench {
namespace {

using DoubleList = std::vector<DoubleBox>;

// A third of a scene's size, so that hardly a coordinate is a float, and `origin` away.
DoubleList doubles_of(const std::vector<Box>& boxes, double origin) {
  DoubleList list;
  const auto at = [&](const Vec3& v) {
    return DoubleVec3{double{v.x} / 3 + origin, double{v.y} / 3 + origin, double{v.z} / 3 + origin};
  };
  for (const Box& box : boxes) list.push_back({at(box.lower), at(box.upper)});
  return list;
}

// A way to find them; tells how many there are. What it keeps it keeps from round to round.
struct Way {
  std::string name;
  std::function<std::size_t()> find;
  std::vector<double> ms = {};
  std::size_t pairs = 0;
};

Box outward(const DoubleBox& b) { return round_outward(&b.lower.x, &b.upper.x); }

bool overlap(const DoubleBox& a, const DoubleBox& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y &&
         b.lower.y <= a.upper.y && a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}

Way exact(std::string name, const DoubleList& boxes, Finder& finder) {
  return {std::move(name), [&] { return finder.find(boxes).ok() ? finder.pairs().size() : 0; }};
}

#if defined(THRONG_CGAL)
struct CgalBox {
  using NT = double;
  using ID = std::uint32_t;
  DoubleBox box;
  ID number;

  static int dimension() { return 3; }
  ID id() const { return number; }
  NT min_coord(int k) const { return (&box.lower.x)[k]; }
  NT max_coord(int k) const { return (&box.upper.x)[k]; }
};

Way cgal(std::ptrdiff_t cutoff, const DoubleList& boxes, std::vector<CgalBox>& room,
         std::vector<Pair>& out) {
  return {"CGAL, cutoff " + std::to_string(cutoff), [&, cutoff] {
            room.resize(boxes.size());
            for (std::uint32_t i = 0; i < boxes.size(); ++i) room[i] = {boxes[i], i};
            out.clear();
            CGAL::box_self_intersection_d(
                room.begin(), room.end(),
                [&](const CgalBox& a, const CgalBox& b) {
                  out.push_back({std::min(a.number, b.number), std::max(a.number, b.number)});
                },
                cutoff);
            return out.size();
          }};
}
#endif

void measure(const char* scene, std::size_t count, unsigned threads, int rounds) {
  const std::vector<Box> floats = boxes_of(scene, count);
  const DoubleList boxes = doubles_of(floats, 0), far = doubles_of(floats, 1e6);
  std::vector<Box> rounded;
  for (const DoubleBox& box : boxes) rounded.push_back(outward(box));
  Options options;
  options.threads = threads;
  Finder of_floats(options), of_doubles(options), of_far(options), of_outward(options);
  std::vector<Box> room;
  std::vector<Pair> looked_at;

  std::vector<Way> ways;
  ways.push_back({"Throng, floats",
                  [&] { return of_floats.find(rounded).ok() ? of_floats.pairs().size() : 0; }});
  ways.push_back(exact("Throng, doubles", boxes, of_doubles));
  ways.push_back(exact("Throng, doubles a million away", far, of_far));
  ways.push_back({"Throng, rounded outward, and each pair looked at", [&] {
                    room.resize(boxes.size());
                    std::transform(boxes.begin(), boxes.end(), room.begin(), outward);
                    if (!of_outward.find(room).ok()) return std::size_t{0};
                    looked_at.clear();
                    for (const Pair pair : of_outward.pairs()) {
                      if (overlap(boxes[pair.first], boxes[pair.second])) looked_at.push_back(pair);
                    }
                    return looked_at.size();
                  }});
#if defined(THRONG_CGAL)
  std::vector<CgalBox> cgal_room;
  std::vector<Pair> cgal_out;
  if (threads == 1)
    for (const std::ptrdiff_t cutoff : {10, 1000})
      ways.push_back(cgal(cutoff, boxes, cgal_room, cgal_out));
#endif
  for (int round = -1; round < rounds; ++round) {
    for (Way& way : ways) {
      const auto start = std::chrono::steady_clock::now();
      way.pairs = way.find();
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - start;
      if (round >= 0) way.ms.push_back(took.count());
    }
  }
  for (const Way& way : ways) {
    std::printf("%s,%zu,%u,\"%s\",%.4g,%zu\n", scene, count, threads, way.name.c_str(),
                program::median(way.ms), way.pairs);
  }
  std::fflush(stdout);
}

}  // namespace
}  // namespace throng::bench

int main() {
  using throng::bench::measure;
  std::printf("scene,boxes,threads,what,ms,pairs\n");
  for (const unsigned threads : {1u, 2u}) {
    for (const char* scene : {"uniform", "pile", "mixed"}) measure(scene, 100'000, threads, 15);
    measure("uniform", 10'000, threads, 41);
    measure("uniform", 1'000'000, threads, 7);
  }
}
