// BvhForest against a loop over all objects, after random inserts and erases; and bounds on the
// work of searches.
#include "tracking/bvh_forest.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <functional>
#include <vector>

#include "support/random.hpp"

namespace throng::tracking {
namespace {

using tests::Random;

constexpr float infinity = std::numeric_limits<float>::infinity();

Box cube(const Vec3& v, float e) { return {v, {v.x + e, v.y + e, v.z + e}}; }

// Objects in a forest, updated as by Tracker.
class World {
 public:
  explicit World(float margin = 0)
      : memory_(std::pmr::new_delete_resource(), 0), objects_(memory_, margin), forest_(memory_) {}

  ObjectId add(const Box& box, const Filter& filter = {}) {
    objects_.reserve_more(1);
    return objects_.add(box, filter);
  }
  void build() {
    forest_.build(objects_, false);
    objects_.clear_dirty();
  }
  // Places changed objects. Returns false if the forest was rebuilt.
  bool place_dirty() {
    const PodVector<ObjectId>& dirty = objects_.dirty_list();
    if (!forest_.has_capacity_for(dirty.size())) {
      build();
      return false;
    }
    forest_.place_all(objects_, dirty.data(), dirty.size());
    objects_.clear_dirty();
    return true;
  }

  Objects& objects() { return objects_; }
  BvhForest& forest() { return forest_; }

 private:
  base::Memory memory_;
  Objects objects_;
  BvhForest forest_;
};

// Searches a box and compares with a loop over all objects.
void expect_found(World& w, const Box& box, const Filter& filter, Work& work) {
  std::vector<ObjectId> found, wanted;
  w.forest().search(box, filter, work, [&](ObjectId id) {
    if (allows(w.objects().filter(id), filter)) found.push_back(id);
  });
  std::sort(found.begin(), found.end());
  for (std::size_t i = 0; i < w.objects().limit(); ++i) {
    const auto id = static_cast<ObjectId>(i);
    if (!w.objects().is_active(id) || !allows(w.objects().filter(id), filter)) continue;
    if (base::overlaps(w.objects().expanded(id), box)) wanted.push_back(id);
  }
  ASSERT_EQ(found, wanted);
}

// Casts a sweep, for all hits and for the first, and compares with a loop over all objects.
void expect_hits(World& w, const Sweep& sweep, const Filter& filter, Work& work) {
  const base::SweptBounds cover(sweep);
  std::vector<ObjectId> met, wanted;
  const auto touch = [&](ObjectId id) {
    return base::contact_interval(sweep, w.objects().body(id).box);
  };
  double first = 2, found = 2;
  for (std::size_t i = 0; i < w.objects().limit(); ++i) {
    const auto id = static_cast<ObjectId>(i);
    if (!w.objects().is_active(id) || !allows(w.objects().filter(id), filter)) continue;
    const base::ContactInterval t = touch(id);
    if (t.enter > t.leave) continue;
    wanted.push_back(id);
    first = std::min(first, t.enter);
  }
  const double never = 2;
  w.forest().cast(base::MovingBox(sweep), cover, filter, false, never, work,
                  [&](const CellLine& line, std::uint32_t k) {
                    const base::ContactInterval t = touch(line.id[k]);
                    if (t.enter > t.leave || !allows(w.objects().filter(line.id[k]), filter))
                      return;
                    met.push_back(line.id[k]);
                  });
  std::sort(met.begin(), met.end());
  ASSERT_EQ(met, wanted);
  Work unused;
  w.forest().cast(base::MovingBox(sweep), cover, filter, true, found, unused,
                  [&](const CellLine& line, std::uint32_t k) {
                    const base::ContactInterval t = touch(line.id[k]);
                    if (t.enter > t.leave || !allows(w.objects().filter(line.id[k]), filter))
                      return;
                    found = std::min(found, t.enter);
                  });
  ASSERT_EQ(found, first);
}

// A number of any magnitude, often a repeated one.
float any_number(Random& random) {
  const float some[] = {0, 1, 2, 3, 1e-20f, 1e-38f, 1e-42f, 1e20f, 1e30f, FLT_MAX, infinity};
  float x = some[random.between(0, random.one_in(2) ? 3 : 10)];
  if (random.one_in(4)) x = random.in(0, 10);
  return random.one_in(2) ? -x : x;
}
Box any_box(Random& random) {
  Box box;
  float* const lower = &box.lower.x;
  float* const upper = &box.upper.x;
  for (int k = 0; k < 3; ++k) {
    const float a = any_number(random), b = random.one_in(4) ? a : any_number(random);
    lower[k] = std::fmin(a, b);
    upper[k] = std::fmax(a, b);
  }
  if (random.one_in(20)) std::swap(box.lower.x, box.upper.x);
  return box;
}
Filter any_filter(Random& random) {
  Filter f;
  if (random.one_in(3)) f.group = 1u << random.below(3);
  if (random.one_in(3)) f.mask = 1u + random.below(7);
  if (random.one_in(3)) f.owner = random.between(0, 3);
  if (random.one_in(2)) f.world = random.between(-1, random.one_in(2) ? 2 : 60);
  f.is_static = random.one_in(3);
  return f;
}
Sweep any_sweep(Random& random) {
  Sweep s;
  s.box = any_box(random);
  if (random.one_in(2)) s.box.upper = s.box.lower;
  const auto by = [&] {
    const float x = any_number(random);
    return std::isfinite(x) ? x : FLT_MAX;
  };
  s.by = {by(), by(), by()};
  return s;
}

// Any boxes and filters; thousands of changes, few or many at once.
TEST(BvhForest, AnyBoxesAndChanges) {
  for (const bool filtered : {false, true}) {
    Random random(filtered ? 2 : 1);
    const auto filter = [&] { return filtered ? any_filter(random) : Filter{}; };
    World w(filtered ? 0.25f : 0);
    std::vector<ObjectId> ids;
    for (int i = 0; i < 400; ++i) ids.push_back(w.add(any_box(random), filter()));
    w.build();
    Work work;
    std::size_t built = 0;
    for (int step = 0; step < 600; ++step) {
      const std::uint32_t changes = random.one_in(8) ? random.below(90) : random.below(6);
      for (std::uint32_t c = 0; c < changes; ++c) {
        const std::uint32_t k = random.below(static_cast<std::uint32_t>(ids.size()));
        if (random.one_in(8) || ids.size() < 300) {
          ids.push_back(w.add(any_box(random), filter()));
        } else if (random.one_in(8)) {
          w.objects().remove(ids[k]);
          ids[k] = ids.back();
          ids.pop_back();
        } else if (filtered && random.one_in(4)) {
          w.objects().set_filter(ids[k], filter());
        } else {
          w.objects().move(ids[k], any_box(random));
        }
      }
      built += !w.place_dirty();
      for (int k = 0; k < 3; ++k) {
        expect_found(w, any_box(random), filter(), work);
        if (w.objects().margin() == 0) expect_hits(w, any_sweep(random), filter(), work);
      }
      if (HasFatalFailure()) return;
    }
    EXPECT_GT(built, 10u);
    EXPECT_LT(built, 300u);
  }
}

// Bounds on the work of searches: a constant, plus a term per box found.
struct Scene {
  const char* name;
  std::function<Box(Random&)> box;
};
std::vector<Scene> scenes() {
  const auto decades = [](Random& r) {
    return std::pow(10.0f, r.in(-18, 18)) * (r.one_in(2) ? 1.0f : -1.0f);
  };
  return {
      {"one cluster", [](Random& r) { return cube(r.point(0, 8), 4); }},
      {"all in one place",
       [](Random&) {
         return cube({1, 2, 3}, 1);
       }},
      {"uniform", [](Random& r) { return cube(r.point(0, 50), 1); }},
      {"two clusters far apart",
       [](Random& r) { return cube(r.point(0, 8), 1 + (r.one_in(2) ? 1e6f : 0)); }},
      {"many magnitudes",
       [decades](Random& r) {
         const Vec3 v{decades(r), decades(r), decades(r)};
         const auto end = [](float x) { return x + 0.001f * std::fabs(x); };
         return Box{v, {end(v.x), end(v.y), end(v.z)}};
       }},
      {"rods of three directions",
       [](Random& r) {
         const Vec3 v = r.point(0, 300);
         float e[3] = {0.1f, 0.1f, 0.1f};
         e[r.below(3)] = 60;
         return Box{v, {v.x + e[0], v.y + e[1], v.z + e[2]}};
       }},
      {"unbounded along an axis",
       [](Random& r) {
         Box b = cube(r.point(0, 3000), 1);
         b.lower.z = -infinity;
         b.upper.z = infinity;
         return b;
       }},
  };
}

TEST(BvhForest, VisitsLittle) {
  constexpr int count = 20'000;
  for (const Scene& scene : scenes()) {
    SCOPED_TRACE(scene.name);
    Random random(3);
    World w;
    for (int i = 0; i < count; ++i) w.add(scene.box(random));
    w.build();
    Work work, of_sweeps;
    std::size_t found = 0, met = 0;
    for (int i = 0; i < 300; ++i) {
      const Box box = scene.box(random);
      w.forest().search(box, {}, work, [&](ObjectId) { ++found; });
      Sweep sweep{{box.lower, box.lower}, random.point(-1, 1)};
      for (float* x : {&sweep.box.lower.z, &sweep.box.upper.z}) *x = std::isfinite(*x) ? *x : 0;
      if (random.one_in(2)) sweep.by = {sweep.by.x * 1e30f, sweep.by.y * 1e30f, sweep.by.z * 1e30f};
      const double never = 2;
      w.forest().cast(base::MovingBox(sweep), base::SweptBounds(sweep), {}, false, never, of_sweeps,
                      [&](const CellLine& line, std::uint32_t k) {
                        const base::ContactInterval t = base::contact_interval(sweep, line.box(k));
                        met += t.enter <= t.leave;
                      });
    }
    EXPECT_LE(work.total(), 300 * 250 + 3 * found);
    EXPECT_LE(of_sweeps.total(), 300 * 700 + 6 * met);
  }
}

// At one place a thousand objects have a group that the query may not pair with, and one does not.
TEST(BvhForest, SkipsFilteredSubtrees) {
  for (int what = 0; what < 4; ++what) {
    Random random(4);
    World w;
    const auto clustered = [&] {
      Filter f;
      if (what == 0) f.group = 2;
      if (what == 1) f.owner = 7;
      if (what == 2) f.world = 5;
      if (what == 3) f.is_static = 1;
      return f;
    };
    for (int i = 0; i < 5000; ++i) w.add(cube(random.point(0, 1), 2), clustered());
    for (int i = 0; i < 10; ++i) w.add(cube(random.point(0, 1), 2));
    w.build();
    Filter mine = clustered();
    if (what == 0) mine.mask = 1;
    if (what == 2) mine.world = 6;
    Work work;
    expect_found(w, cube({0.5f, 0.5f, 0.5f}, 1), mine, work);
    EXPECT_LT(work.total(), 400u) << what;
  }
}

// However few objects move at a time, each is moved at most log n times: counted in full rebuilds.
TEST(BvhForest, RarelyRebuilds) {
  Random random(5);
  World w;
  for (int i = 0; i < 10'000; ++i) w.add(cube(random.point(0, 8), 4));
  w.build();
  std::size_t built = 0;
  for (int frame = 0; frame < 2000; ++frame) {
    for (int k = 0; k < 10; ++k)
      w.objects().move(random.below(10'000), cube(random.point(0, 8), 4));
    built += !w.place_dirty();
  }
  EXPECT_LE(built, 20'000u / 2500 + 1);
  EXPECT_GE(built, 1u);
}

TEST(BvhForest, FewObjectsAndNone) {
  for (int count = 0; count < 20; ++count) {
    Random random(6);
    World w;
    for (int i = 0; i < count; ++i) w.add(cube(random.point(0, 3), 1));
    w.build();
    Work work;
    for (int i = 0; i < count; ++i) {
      expect_found(w, cube(random.point(0, 3), 1), {}, work);
      expect_hits(w, {cube(random.point(0, 3), 1), random.point(-3, 3)}, {}, work);
      w.objects().remove(static_cast<ObjectId>(i));
      w.place_dirty();
    }
    expect_found(w, cube({0, 0, 0}, 9), {}, work);
    w.add(cube({1, 1, 1}, 1));
    w.place_dirty();
    expect_found(w, cube({0, 0, 0}, 9), {}, work);
  }
}

}  // namespace
}  // namespace throng::tracking
