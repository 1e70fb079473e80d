// A search in slabs finds the pairs of a search in memory, for all boxes and caps.
#include "tests/apps/stream/files.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <throng/checksum.hpp>

#include "apps/stream/split.hpp"

namespace throng::test {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

class Stream : public StreamTest {};

// A few slabs: more than one, and fewer than with the smallest cap.
constexpr std::size_t medium_surplus = 3 << 20;

TEST_F(Stream, every_scene_under_two_caps) {
  for (const std::string& name : scenes::names()) {
    SCOPED_TRACE(name);
    const Set set = scene_set(name, 30000);
    const stream::Report report = expect_same(set);
    EXPECT_GT(report.slabs, 4u);
    EXPECT_GT(report.scratch_bytes, 30000u * 28);
    expect_same(set, nullptr, {}, medium_surplus);
  }
}

TEST_F(Stream, canonical_order_is_the_same_bytes) {
  Options options;
  options.order = Order::canonical;
  for (const char* name : {"uniform", "pile", "mixed"}) {
    SCOPED_TRACE(name);
    expect_same(scene_set(name, 40000), nullptr, options);
  }
  const Set a = scene_set("uniform", 20000, 4, 5), b = scene_set("uniform", 30000, 4, 6);
  expect_same(a, &b, options);
  expect_same(Set{}, nullptr, options);
}

TEST_F(Stream, runs_of_pairs_are_merged_more_than_once) {
  // 1,200 boxes in one place: 719,400 pairs, sorted 8,192 at a time in 88 runs, 16 of which are
  // merged at once.
  Set set;
  set.boxes.assign(1200, Box{{0, 0, 0}, {1, 1, 1}});
  Options options;
  options.order = Order::canonical;
  expect_same(set, nullptr, options);
}

TEST_F(Stream, everything_in_one_place) {
  // No border separates them: they are processed in blocks. Distinct sizes, few pairs by owners.
  Set set;
  for (int i = 0; i < 7000; ++i) {
    const float r = 1 + static_cast<float>(i) * 1e-3f;
    set.boxes.push_back({{-r, -r, -r}, {r, r, r}});
    set.owner.push_back(i % 50 == 0 ? -1 : 7);
  }
  expect_same(set);
  std::fill(set.boxes.begin(), set.boxes.end(), Box{{2, 2, 2}, {2, 2, 2}});
  expect_same(set);
}

// Unit cubes on a lattice: every face is on a border, and each touches 26 others.
Set lattice(int side, std::uint32_t seed, int nudge) {
  std::mt19937 random(seed);
  const auto near = [&](float x) {
    if (nudge == 0) return x;
    const int steps = static_cast<int>(random() % (2 * nudge + 1)) - nudge;
    for (int k = 0; k < std::abs(steps); ++k)
      x = std::nextafter(x, steps < 0 ? -infinity : infinity);
    return x;
  };
  Set set;
  for (int x = 0; x < side; ++x) {
    for (int y = 0; y < side; ++y) {
      for (int z = 0; z < side; ++z) {
        const auto f = [&](int at) { return near(static_cast<float>(at)); };
        const Vec3 lower = {f(x), f(y), f(z)};
        set.boxes.push_back({lower, {f(x + 1), f(y + 1), f(z + 1)}});
      }
    }
  }
  std::shuffle(set.boxes.begin(), set.boxes.end(), random);
  return set;
}

TEST_F(Stream, lattices_with_faces_on_borders) {
  const stream::Report report = expect_same(lattice(26, 1, 0));
  EXPECT_GT(report.slabs, 3u);
  for (std::uint32_t seed = 2; seed < 5; ++seed) expect_same(lattice(26, seed, 2));
}

TEST_F(Stream, lattices_with_margins_near_contact) {
  // Cubes of a half on a lattice of ones: a margin of a quarter makes them touch, if it is exact.
  for (const int nudge : {0, 2}) {
    Set set = lattice(20, 7, nudge);
    for (Box& b : set.boxes) {
      b.upper.x -= 0.5f;
      b.upper.y -= 0.5f;
      b.upper.z -= 0.5f;
    }
    for (const float margin : {0.25f, 0.2499999f, 1e-30f, 0.75f}) {
      Options options;
      options.margin = margin;
      expect_same(set, nullptr, options);
      options.order = Order::canonical;
      expect_same(set, nullptr, options);
    }
  }
}

TEST_F(Stream, huge_and_infinite_boxes_and_empty_slots) {
  Set set = scene_set("uniform", 20000);
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    Box& b = set.boxes[random() % set.boxes.size()];
    const float big = i % 3 == 0 ? infinity : 1e3f;
    if (i % 2) b.lower.x = -big;
    if (i % 5) b.upper.x = big;
    if (i % 7 == 0) b.lower.y = -big, b.upper.y = big;
    if (i % 11 == 0) b.upper.z = std::numeric_limits<float>::max();
  }
  for (int i = 0; i < 300; ++i) {
    Box& b = set.boxes[random() % set.boxes.size()];
    b.lower.z = b.upper.z + 1;
  }
  set.boxes.push_back({{infinity, 0, 0}, {infinity, 9, 9}});
  set.boxes.push_back({{-infinity, 0, 0}, {-infinity, 9, 9}});
  set.boxes.push_back({{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}});
  expect_same(set);
  for (const float margin : {0.5f, 1e30f, std::numeric_limits<float>::max()}) {
    if (margin > 1 && set.boxes.size() > 6000) set.boxes.resize(3000);
    Options options;
    options.margin = margin;
    expect_same(set, nullptr, options);
  }
}

TEST_F(Stream, wide_boxes_that_begin_where_others_end) {
  // Boxes that reach the next slabs, and some that reach many more: a wide box overlaps boxes owned
  // by slabs before its own. Only x separates them; worlds limit the pairs.
  std::mt19937 random(11);
  Set set;
  for (int i = 0; i < 20000; ++i) {
    const float x = static_cast<float>(random() % 100000) * 1e-2f;
    set.boxes.push_back({{x, 0, 0}, {x + (i % 50 == 0 ? 900.0f : 100.0f), 1, 1}});
    set.world.push_back(i % 401);
  }
  expect_same(set);
}

TEST_F(Stream, zeroes_of_both_signs_and_denormals) {
  Set set;
  std::mt19937 random(5);
  const float values[] = {-0.0f, 0.0f, 1e-45f, -1e-45f, 1e-38f, -1e-38f};
  const auto any = [&] { return values[random() % 6]; };
  for (int i = 0; i < 6000; ++i) {
    Box b = {{any(), any(), any()}, {any(), any(), any()}};
    set.boxes.push_back(b);
    set.owner.push_back(i % 100 < 97 ? 1 : -1);
  }
  expect_same(set);
  Options options;
  options.margin = 1e-45f;
  expect_same(set, nullptr, options);
}

TEST_F(Stream, nan_boxes_are_refused_with_their_index_or_inactive) {
  Set set = scene_set("uniform", 20000);
  set.boxes[17001].upper.y = std::nanf("");
  set.boxes[19999].lower.x = std::nanf("");
  Options options;
  options.nan = NanPolicy::inactive;
  expect_same(set, nullptr, options);
  stream::Request refused = request(set, nullptr, {});
  refused.options.memory_cap_bytes = smallest_cap(refused);
  try {
    stream::run(refused);
    ADD_FAILURE() << "a NaN was taken";
  } catch (const common::Failure& failure) {
    const std::string said = failure.what();
    EXPECT_NE(said.find("a.npy: 2 boxes have a NaN, the first is box 17001;"), std::string::npos)
        << said;
  }
  EXPECT_FALSE(fs::exists(at("pairs.npy")));
}

// All kinds of filters, distributed so that each decides some pairs.
void add_filters(Set& set, std::uint32_t seed) {
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < set.boxes.size(); ++i) {
    set.group.push_back(1u << random() % 3);
    set.mask.push_back(static_cast<std::uint32_t>(random() % 8));
    set.owner.push_back(static_cast<std::int32_t>(random() % 20) - 1);
    set.world.push_back(static_cast<std::int32_t>(random() % 4) - 1);
    set.is_static.push_back(static_cast<std::uint8_t>(random() % 3 == 0));
  }
}

TEST_F(Stream, filters_of_one_set_and_two) {
  Set a = scene_set("pile", 20000), b = scene_set("pile", 9000, 0, 2);
  add_filters(a, 1);
  expect_same(a);
  expect_same(a, &b);  // one of the two without
  add_filters(b, 2);
  expect_same(a, &b);
  a.world.clear(), a.group.clear(), a.is_static.clear();
  expect_same(a, &b);
}

TEST_F(Stream, two_sets_of_different_size_and_filters) {
  const Set many = scene_set("uniform", 30000, 3), rods = scene_set("rods", 8000);
  const Set ground = {{{{-1e9f, -1e9f, -1e9f}, {1e9f, 1e9f, 0}}}, {}, {}, {}, {}, {}};
  expect_same(many, &rods);
  expect_same(rods, &many);
  expect_same(many, &ground);
  expect_same(ground, &many);
  const Set none;
  expect_same(many, &none);
  expect_same(none, &many);
  Options options;
  options.margin = 0.5f;
  expect_same(rods, &many, options);
}

TEST_F(Stream, frames_one_after_another) {
  const Set first = scene_set("uniform", 12000, 1, 1), second = scene_set("pile", 12000, 0, 2);
  std::vector<Box> both = first.boxes;
  both.insert(both.end(), second.boxes.begin(), second.boxes.end());
  stream::Request capped = request(first, nullptr, {});
  scenes::write_boxes(capped.a.boxes, both.data(), 2, 12000);
  capped.options.order = Order::canonical;
  capped.options.memory_cap_bytes = smallest_cap(capped);
  const stream::Report report = stream::run(capped);
  Options canonical;
  canonical.order = Order::canonical;
  std::vector<Pair> expected = find_pairs(first.boxes, canonical);
  const std::vector<Pair> of_second = find_pairs(second.boxes, canonical);
  ASSERT_EQ(report.frames.size(), 2u);
  EXPECT_EQ(report.frames[0].pairs, expected.size());
  EXPECT_EQ(report.frames[1].checksum, pair_checksum(of_second.data(), of_second.size()));
  expected.insert(expected.end(), of_second.begin(), of_second.end());
  EXPECT_EQ(read_pairs(), expected);
}

TEST_F(Stream, oversized_searches_are_halved) {
  // Long boxes crossed: each in dozens of cells.
  Set set = scene_set("rods", 6000, 60);
  const stream::Report report = expect_same(set);
  EXPECT_GT(report.searches, report.slabs);
}

TEST_F(Stream, all_algorithms_and_backends) {
  const Set set = scene_set("mixed", 9000);
  for (const Algorithm algorithm : {Algorithm::all_pairs, Algorithm::grid}) {
    Options options;
    options.algorithm = algorithm;
    expect_same(set, nullptr, options);
  }
  Options options;
  options.backend = Backend::emulated;
  expect_same(set, nullptr, options);
}

TEST_F(Stream, progress_increases_and_may_stop) {
  const Set set = scene_set("uniform", 30000);
  stream::Request capped = request(set, nullptr, {});
  capped.options.memory_cap_bytes = smallest_cap(capped);
  double before = 0;
  int calls = 0;
  capped.progress = [&](double share) {
    EXPECT_GE(share, before);
    EXPECT_LE(share, 1);
    before = share;
    ++calls;
  };
  stream::run(capped);
  EXPECT_GT(before, 0.9);
  EXPECT_GT(calls, 20);
  fs::remove(at("pairs.npy"));
  for (const int stop_at : {1, calls / 2, calls - 1}) {
    int call = 0;
    capped.progress = [&](double) {
      if (++call == stop_at) throw stop_at;
    };
    EXPECT_THROW(stream::run(capped), int);
    EXPECT_EQ(files(), 1u) << "only the boxes may be there";
  }
}

TEST_F(Stream, a_file_that_shrinks_while_it_is_read_is_an_error) {
  const Set set = scene_set("uniform", 30000);
  stream::Request capped = request(set, nullptr, {});
  capped.options.memory_cap_bytes = smallest_cap(capped);
  int call = 0;
  capped.progress = [&](double) {
    if (++call == 3) fs::resize_file(capped.a.boxes, 200000);
  };
  EXPECT_THROW(stream::run(capped), scenes::FileError);
  EXPECT_EQ(files(), 1u);
}

TEST_F(Stream, missing_scratch_folders_are_named) {
  const Set set = scene_set("uniform", 30000);
  stream::Request capped = request(set, nullptr, {});
  capped.options.memory_cap_bytes = smallest_cap(capped);
  capped.scratch_folder = at("nowhere");
  try {
    stream::run(capped);
    ADD_FAILURE() << "no error";
  } catch (const common::Failure& failure) {
    const std::string said = failure.what();
    EXPECT_NE(said.find("nowhere"), std::string::npos) << said;
    EXPECT_NE(said.find("TMPDIR"), std::string::npos) << said;
  }
}

// The rule of halos, at the edge: a border exactly at the end of a box is reached by it.
TEST(Split, owners_and_last_slabs_at_borders) {
  stream::Split split;
  split.borders = {1, 2, 3};
  const auto box = [](float lower, float upper) { return Box{{lower, 0, 0}, {upper, 0, 0}}; };
  EXPECT_EQ(split.slabs(), 4);
  EXPECT_EQ(split.owner(box(std::nextafter(1.0f, 0.0f), 9)), 0);
  EXPECT_EQ(split.owner(box(1, 9)), 1);
  EXPECT_EQ(split.owner(box(-infinity, 9)), 0);
  EXPECT_EQ(split.owner(box(infinity, infinity)), 3);
  EXPECT_EQ(split.last(box(0, std::nextafter(2.0f, 0.0f)), 0), 1);
  EXPECT_EQ(split.last(box(0, 2), 0), 2);
  EXPECT_EQ(split.last(box(0, infinity), 0), 3);
  EXPECT_EQ(split.last(box(2, 2), 2), 2);
  split.margin = 0.5f;
  EXPECT_GE(split.last(box(0, 1), 0), 2);  // 2 - m = 1 + m
  EXPECT_EQ(split.last(box(0, 0.9f), 0), 1);
  EXPECT_EQ(split.last(box(0, std::numeric_limits<float>::max()), 0), 3);
}

}  // namespace
}  // namespace throng::test
