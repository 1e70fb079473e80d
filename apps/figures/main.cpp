// throng-figures DIR: the drawings of docs/pictures. Boxes, pairs and hits in them come from the
// library, so comparing them with the files in docs/ detects outdated ones.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <numeric>
#include <string>
#include <vector>

#include <throng/throng.hpp>

#include "apps/figures/animation.hpp"
#include "apps/figures/drawing.hpp"
#include "apps/figures/meshes.hpp"
#include "apps/figures/motion.hpp"
#include "apps/report/page.hpp"

namespace throng::figures {
namespace {

Box flat(float x, float y, float width, float height) {
  return {{x, y, 0}, {x + width, y + height, 0}};
}

std::vector<Pair> pairs_of(const std::vector<Box>& boxes) {
  Options options;
  options.order = Order::canonical;
  options.backend = Backend::cpu;
  options.threads = 1;
  return find_pairs(boxes, options);
}

std::vector<Box> random_boxes() {
  Random random;
  std::vector<Box> boxes;
  for (int i = 0; i < 34; ++i) {
    const float width = 22 + random.below(30);
    const float height = 22 + random.below(30);
    const float y = 20 + random.below(300);
    const float x = 20 + random.below(540);
    boxes.push_back(flat(x, y, width, height));
  }
  boxes.push_back(flat(60, 250, 430, 26));  // one that is long
  return boxes;
}

// The paper's idea: the number of a pair determines the pair.
std::string triangle() {
  constexpr int n = 8, cell = 44, left = 70, top = 60;
  Drawing d(left + n * cell + 330, top + n * cell + 20);
  d.words(left, 26, "all pairs of 8 boxes, numbered row by row");
  int k = 0;
  for (int a = 0; a < n; ++a) {
    d.words(left - 14, top + a * cell + 28, std::to_string(a), "end", grey);
    d.words(left + a * cell + 22, top - 10, std::to_string(a), "middle", grey);
    for (int b = a + 1; b < n; ++b, ++k) {
      const char* const colour = k == 13 ? red : k / 7 % 2 ? green : blue;
      d.rectangle(left + b * cell, top + a * cell, cell - 4, cell - 4, colour, k == 13 ? 0.7 : 0.2);
      d.words(left + b * cell + 20, top + a * cell + 26, std::to_string(k), "middle");
    }
  }
  const double x = left + n * cell + 30;
  d.words(x, top + 30, "28 pairs, 4 workers of 7 each:");
  d.words(x, top + 54, "all get the same number.");
  d.words(x, top + 96, "A worker takes its number k, 13 say,");
  d.words(x, top + 120, "and computes which pair that is:");
  d.words(x, top + 144, "the row from a square root, corrected", "start", red);
  d.words(x, top + 168, "in integers; here row 2, box 3.", "start", red);
  return d.svg();
}

// Columns, seen along them; a box's colour is the number of columns that hold it.
std::string columns() {
  const std::vector<Box> boxes = random_boxes();
  constexpr float width = 120, height = 90;
  Drawing d(860, 400);
  for (float x = 20; x <= 620; x += width) d.line(x, 20, x, 380, grey, true);
  for (float y = 20; y <= 380; y += height) d.line(20, y, 620, y, grey, true);
  std::vector<int> count(4);
  for (const Box& b : boxes) {
    const auto span = [](float lower, float upper, float size) {
      return static_cast<int>((upper - 20) / size) - static_cast<int>((lower - 20) / size) + 1;
    };
    const int touched = span(b.lower.x, b.upper.x, width) * span(b.lower.y, b.upper.y, height);
    const int kind = touched == 1 ? 0 : touched == 2 ? 1 : touched <= 4 ? 2 : 3;
    ++count[static_cast<std::size_t>(kind)];
    const char* const colours[] = {blue, green, orange, red};
    d.rectangle(b.lower.x, b.lower.y, b.upper.x - b.lower.x, b.upper.y - b.lower.y, colours[kind]);
  }
  d.words(645, 50, "columns, seen along them");
  const char* const kinds[] = {"in one column", "in two", "in three or four", "in more"};
  const char* const colours[] = {blue, green, orange, red};
  for (int i = 0; i < 4; ++i) {
    d.rectangle(645, 72 + 28 * i, 16, 16, colours[i]);
    d.words(670, 85 + 28 * i,
            fmt::format("{}: {} boxes", kinds[i], count[static_cast<std::size_t>(i)]));
  }
  d.words(645, 220, "Wider columns: fewer copies,");
  d.words(645, 242, "longer sweeps. The planner");
  d.words(645, 264, "weighs them by a sample.");
  return d.svg();
}

// The boxes of one column, sorted by their start along it, and the candidates of one of them.
std::string sweep() {
  Random random;
  std::vector<Box> boxes;
  for (int i = 0; i < 15; ++i) {
    const float height = 20 + random.below(20);
    const float width = 40 + random.below(70);
    const float y = random.below(60);
    const float x = 30 + random.below(420);
    boxes.push_back(flat(x, y, width, height));
  }
  std::sort(boxes.begin(), boxes.end(),
            [](const Box& a, const Box& b) { return a.lower.x < b.lower.x; });
  const std::vector<Pair> pairs = pairs_of(boxes);
  constexpr std::size_t query = 4;
  constexpr double row = 21, top = 44;
  Drawing d(860, 380);
  d.words(30, 24, "the boxes of one column, sorted by where they start along it");
  int compared = 0, found = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Box& b = boxes[i];
    const bool candidate = i > query && b.lower.x <= boxes[query].upper.x;
    const bool hit = std::find(pairs.begin(), pairs.end(),
                               Pair{query, static_cast<std::uint32_t>(i)}) != pairs.end();
    compared += candidate;
    found += hit;
    d.rectangle(b.lower.x, top + row * static_cast<double>(i), b.upper.x - b.lower.x, row - 5,
                i == query  ? blue
                : hit       ? red
                : candidate ? orange
                            : grey,
                i == query ? 0.7 : 0.3);
  }
  const double end = top + row * static_cast<double>(boxes.size());
  d.line(boxes[query].lower.x, top - 6, boxes[query].lower.x, end, blue, true);
  d.line(boxes[query].upper.x, top - 6, boxes[query].upper.x, end, blue, true);
  const auto legend = [&](double y, const char* colour, const std::string& words) {
    d.rectangle(585, y, 16, 14, colour);
    d.words(610, y + 13, words);
  };
  legend(60, blue, "one box");
  legend(88, orange, "starts after it, before its end:");
  d.words(610, 119, fmt::format("compared, {} boxes", compared));
  legend(134, red, fmt::format("and overlaps in all axes: {}", found));
  legend(162, grey, "not compared with it");
  d.words(585, 220, "The sweep goes forward and stops");
  d.words(585, 242, "at the first that starts too late:");
  d.words(585, 264, "8 or 16 comparisons at once.");
  return d.svg();
}

// Of all columns that two boxes share, one reports the pair.
std::string owner_cell() {
  Drawing d(860, 300);
  for (float x = 40; x <= 560; x += 130) d.line(x, 20, x, 280, grey, true);
  for (float y = 20; y <= 280; y += 130) d.line(40, y, 560, y, grey, true);
  const Box a = flat(70, 50, 290, 130), b = flat(200, 90, 300, 150);
  d.rectangle(a.lower.x, a.lower.y, a.upper.x - a.lower.x, a.upper.y - a.lower.y, blue, 0.15);
  d.rectangle(b.lower.x, b.lower.y, b.upper.x - b.lower.x, b.upper.y - b.lower.y, green, 0.15);
  const float x = std::max(a.lower.x, b.lower.x), y = std::max(a.lower.y, b.lower.y);
  d.rectangle(x, y, std::min(a.upper.x, b.upper.x) - x, std::min(a.upper.y, b.upper.y) - y, orange);
  d.dot(x, y, red);
  d.words(585, 60, "Two boxes that share four columns:");
  d.words(585, 84, "each finds the pair; one reports it:");
  d.words(585, 108, "the column with the lower corner");
  d.words(585, 132, "of the intersection.", "start", red);
  d.words(585, 174, "Both columns and corner follow from");
  d.words(585, 196, "the same integers, so no pair is");
  d.words(585, 218, "lost and none is reported twice.");
  return d.svg();
}

// Persistent objects: the cost of moving one.
std::string persistent_objects() {
  std::vector<Box> boxes = random_boxes();
  BroadPhase broad_phase;
  std::vector<ObjectId> ids(boxes.size());
  const auto done = [](const Result& result) {
    if (!result.ok()) throw Error(result);
  };
  done(broad_phase.add(boxes, ids.data()));
  done(broad_phase.update());
  // The first that both begins and ends overlaps on its way.
  const BroadPhase before_moving = broad_phase;
  ObjectId mover = 0;
  Box after{};
  for (; mover < 30; ++mover) {
    const Box& b = boxes[mover];
    after = flat(b.lower.x + 70, b.lower.y + 25, b.upper.x - b.lower.x, b.upper.y - b.lower.y);
    broad_phase = before_moving;
    broad_phase.move(mover, after);
    done(broad_phase.update());
    if (!broad_phase.begun().empty() && !broad_phase.ended().empty()) break;
  }
  const Box before = boxes[mover];
  const auto among = [&](const LivePairs& pairs, ObjectId id) {
    return std::any_of(pairs.begin(), pairs.end(), [&](const LivePair& p) {
      return (p.first == id && p.second == mover) || (p.second == id && p.first == mover);
    });
  };
  Drawing d(860, 400);
  for (float x = 20; x <= 620; x += 60) d.line(x, 20, x, 380, "#dddddd");
  for (float y = 20; y <= 380; y += 60) d.line(20, y, 620, y, "#dddddd");
  for (const ObjectId id : ids) {
    const Box& b = boxes[id];
    const char* const colour = id == mover                      ? grey
                               : among(broad_phase.begun(), id) ? red
                               : among(broad_phase.ended(), id) ? orange
                                                                : grey;
    d.rectangle(b.lower.x, b.lower.y, b.upper.x - b.lower.x, b.upper.y - b.lower.y, colour,
                id == mover ? 0.0 : 0.2);
  }
  d.rectangle(after.lower.x, after.lower.y, after.upper.x - after.lower.x,
              after.upper.y - after.lower.y, blue, 0.6);
  d.line((before.lower.x + before.upper.x) / 2, (before.lower.y + before.upper.y) / 2,
         (after.lower.x + after.upper.x) / 2, (after.lower.y + after.upper.y) / 2, blue, true);
  d.rectangle(645, 50, 16, 16, blue, 0.6);
  d.words(670, 63, "one object moved");
  d.rectangle(645, 80, 16, 16, red);
  d.words(670, 93, fmt::format("begun: {}", broad_phase.begun().size()));
  d.rectangle(645, 110, 16, 16, orange);
  d.words(670, 123, fmt::format("ended: {}", broad_phase.ended().size()));
  d.rectangle(645, 140, 16, 16, grey);
  d.words(670, 153, "not read");
  d.words(645, 200, fmt::format("{} pairs in all.", broad_phase.pair_count()));
  d.words(645, 222, "Only cells near the mover");
  d.words(645, 244, "and its own pairs are read.");
  return d.svg();
}

int run(const std::string& folder) {
  const auto write = [&](const char* name, const std::string& svg) {
    report::write_text(folder + "/" + name, svg);
  };
  write("triangle.svg", triangle());
  write("columns.svg", columns());
  write("sweep.svg", sweep());
  write("owner_cell.svg", owner_cell());
  write("persistent_objects.svg", persistent_objects());
  write("moving.svg", moving());
  write("mesh_side.svg", mesh_side());
  write("mesh_share_none.svg", mesh_share_none());
  write("mesh_share_one.svg", mesh_share_one());
  write("mesh_share_two.svg", mesh_share_two());
  write("mesh_share_three.svg", mesh_share_three());
  write("mesh_stages.svg", mesh_stages());
  return 0;
}

}  // namespace
}  // namespace throng::figures

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("throng-figures: wanted one argument, the output folder\n", stderr);
    return 2;
  }
  try {
    return throng::figures::run(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "throng-figures: %s\n", error.what());
    return 2;
  }
}
