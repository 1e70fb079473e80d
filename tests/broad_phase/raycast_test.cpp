// BroadPhase::raycast against a loop over all objects, and filters by lambdas and functions.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "broad_phase/actor.hpp"
#include "broad_phase/snapshot.hpp"
#include "support/failing_resource.hpp"

namespace throng::tests {
namespace {

constexpr double no_limit = std::numeric_limits<double>::infinity();

struct TestRay {
  Vec3 origin, direction;
  double max_distance = no_limit;
  Filter filter;
};

double length_of(const Vec3& v) {
  return std::sqrt(double{v.x} * v.x + double{v.y} * v.y + double{v.z} * v.z);
}

// As the header defines it: whether the ray enters the box, and where.
bool enters(const TestRay& ray, const Box& b, double& t, int& axis) {
  const float o[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
  const float d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
  const float lower[3] = {b.lower.x, b.lower.y, b.lower.z};
  const float upper[3] = {b.upper.x, b.upper.y, b.upper.z};
  double last = no_limit;
  t = 0;
  axis = -1;
  for (int k = 0; k < 3; ++k) {
    if (!(lower[k] <= upper[k])) return false;
    if (d[k] == 0) {
      if (o[k] < lower[k] || upper[k] < o[k]) return false;
      continue;
    }
    const double p = (double{lower[k]} - o[k]) / d[k], q = (double{upper[k]} - o[k]) / d[k];
    const double enter = d[k] > 0 ? p : q, leave = d[k] > 0 ? q : p;
    if (enter > t) {
      t = enter;
      axis = k;
    }
    last = std::fmin(last, leave);
  }
  return std::isfinite(t) && t <= last;
}

RayHit expected_hit(const TestRay& ray, ObjectId id, const Box& b, double t, int axis) {
  const float o[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
  const float d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
  const float lower[3] = {b.lower.x, b.lower.y, b.lower.z};
  const float upper[3] = {b.upper.x, b.upper.y, b.upper.z};
  const double length = length_of(ray.direction);
  float point[3], normal[3];
  for (int k = 0; k < 3; ++k) {
    if (axis < 0) {
      point[k] = o[k];
      normal[k] = static_cast<float>(-(d[k] / length));
    } else if (k == axis) {
      point[k] = d[k] > 0 ? lower[k] : upper[k];
      normal[k] = d[k] > 0 ? -1.0f : 1.0f;
    } else {
      const double at = o[k] + t * double{d[k]};
      const double lowest = std::fmax(double{lower[k]}, -double{float_max});
      const double highest = std::fmin(double{upper[k]}, double{float_max});
      point[k] = static_cast<float>(at < lowest ? lowest : at > highest ? highest : at);
      normal[k] = 0;
    }
  }
  return {id, t * length, {point[0], point[1], point[2]}, {normal[0], normal[1], normal[2]}};
}

template <class Allowed>
std::optional<RayHit> cast_by_loop(const Model& model, const TestRay& ray, const Allowed& allowed) {
  std::optional<RayHit> closest;
  double closest_t = no_limit;
  for (const ObjectId id : model.ids()) {
    const Model::Object& o = model.at(id);
    double t = 0;
    int axis = 0;
    if (!allowed(id) || !enters(ray, o.box, t, axis)) continue;
    if (t * length_of(ray.direction) > ray.max_distance || t >= closest_t) continue;
    const Box start = {ray.origin, ray.origin};
    if (!wanted(item_of(start, ray.filter), item_of(o.box, o.filter))) continue;
    closest_t = t;
    closest = expected_hit(ray, id, o.box, t, axis);
  }
  return closest;
}

bool same(const Vec3& a, const Vec3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

std::string text_of(const std::optional<RayHit>& hit) {
  if (!hit) return "no hit";
  const auto text = [](const Vec3& v) {
    return std::to_string(v.x) + ' ' + std::to_string(v.y) + ' ' + std::to_string(v.z);
  };
  return "object " + std::to_string(hit->object) + " at " + std::to_string(hit->distance) + ", (" +
         text(hit->point) + "), normal (" + text(hit->normal) + ")";
}

testing::AssertionResult same(const std::optional<RayHit>& got, const std::optional<RayHit>& want) {
  const bool equal = got.has_value() == want.has_value() &&
                     (!got || (got->object == want->object && got->distance == want->distance &&
                               same(got->point, want->point) && same(got->normal, want->normal)));
  if (equal) return testing::AssertionSuccess();
  return testing::AssertionFailure() << text_of(got) << " instead of " << text_of(want);
}

template <class Allowed>
testing::AssertionResult same_ray(const BroadPhase& b, const Model& model, const TestRay& ray,
                                  const Allowed& allowed) {
  std::optional<RayHit> hit;
  const Result r = b.raycast(ray.origin, ray.direction, ray.max_distance, ray.filter, allowed, hit);
  if (testing::AssertionResult checked = Model::check_query(r, hit.has_value()); !checked)
    return checked;
  testing::AssertionResult equal = same(hit, cast_by_loop(model, ray, allowed));
  if (equal) return equal;
  return equal << "; ray from " << ray.origin.x << ' ' << ray.origin.y << ' ' << ray.origin.z
               << " by " << ray.direction.x << ' ' << ray.direction.y << ' ' << ray.direction.z
               << " up to " << ray.max_distance;
}

const auto all_objects = [](ObjectId) { return true; };

testing::AssertionResult same_ray(const BroadPhase& b, const Model& model, const TestRay& ray) {
  return same_ray(b, model, ray, all_objects);
}

// Rays from and to boxes of the scene, along its faces, edges and diagonals, and of any length.
class RandomRays {
 public:
  RandomRays(Actor& actor, float side) : actor_(actor), random_(actor.random), side_(side) {}

  TestRay next(bool filtered) {
    TestRay ray{origin(), {}, no_limit, {}};
    ray.direction = direction(ray.origin);
    if (filtered && !random_.one_in(3)) ray.filter = actor_.any_filter();
    switch (random_.below(6)) {
      case 0:
        ray.max_distance = random_.in(0, side_);
        break;
      case 1:
        ray.max_distance = random_.one_in(3) ? 0 : std::ldexp(1.0, random_.between(-1074, 1023));
        break;
      case 2:
        ray.max_distance = random_.between(0, 9);
        break;
      default:
        break;
    }
    return ray;
  }

 private:
  Box some_box() {
    for (;;) {
      const auto id =
          static_cast<ObjectId>(random_.below(static_cast<std::uint32_t>(actor_.model.limit())));
      if (actor_.model.alive(id)) return actor_.model.at(id).box;
    }
  }
  static float finite(float x) { return std::isfinite(x) ? x : 0.5f; }
  // A corner, or a point of an edge, a face or the inside.
  Vec3 point_of(const Box& b) {
    const auto along = [&](float lower, float upper) {
      switch (random_.below(3)) {
        case 0:
          return finite(lower);
        case 1:
          return finite(upper);
        default:
          return finite(lower + (upper - lower) * 0.5f);
      }
    };
    return {along(b.lower.x, b.upper.x), along(b.lower.y, b.upper.y), along(b.lower.z, b.upper.z)};
  }
  Vec3 whole_point(int least, int most) {
    const auto any = [&] { return static_cast<float>(random_.between(least, most)); };
    return {any(), any(), any()};
  }
  float any_size() {
    const float size = random_.one_in(6) ? denormal : random_.magnitude(-149, 127);
    return random_.one_in(2) ? size : -size;
  }
  Vec3 origin() {
    switch (random_.below(8)) {
      case 0:
        return point_of(some_box());
      case 1:
        return whole_point(-1, static_cast<int>(side_) + 1);
      case 2:
        return {random_.in(-1e5f, 1e5f), random_.in(0, side_), random_.in(0, side_)};
      case 3:
        return random_.one_in(4) ? Vec3{any_size(), any_size(), any_size()} : Vec3{-3e38f, 1, 1};
      default:
        return random_.point(-1, side_ + 1);
    }
  }
  Vec3 direction(const Vec3& from) {
    Vec3 d = random_.point(-1, 1);
    switch (random_.below(8)) {
      case 0:
        d = whole_point(-1, 1);
        break;
      case 1:
        d = whole_point(-3, 3);
        break;
      case 2:
      case 3: {
        const Vec3 to = point_of(some_box());
        d = {to.x - from.x, to.y - from.y, to.z - from.z};
        break;
      }
      case 4: {
        d = {any_size(), any_size(), any_size()};
        break;
      }
      default:
        break;
    }
    if (random_.one_in(5)) d.x = 0;
    if (random_.one_in(5)) d.y = random_.one_in(2) ? 0 : -0.0f;
    if (random_.one_in(5)) d.z = denormal;
    const bool usable =
        std::isfinite(d.x) && std::isfinite(d.y) && std::isfinite(d.z) && length_of(d) != 0;
    return usable ? d : Vec3{0, 0, -1};
  }

  Actor& actor_;
  Random& random_;
  float side_;
};

// Without an index, on columns, in cells and in a forest, and where objects moved since.
void cast_rays(std::uint64_t seed, std::size_t objects, bool filtered, bool thin, float margin,
               bool in_worlds = false) {
  Options options;
  options.threads = 1;
  options.margin = margin;
  constexpr float side = 14;
  Actor actor(options, seed, side);
  actor.in_worlds = in_worlds;
  actor.thin = thin;
  ASSERT_TRUE(actor.add(objects, filtered));
  RandomRays rays(actor, side);
  std::size_t hits = 0;
  for (int step = 0; step < 10; ++step) {
    if (step % 3 == 1) {
      ASSERT_TRUE(actor.move_all(20));
    } else if (step % 4 != 0) {
      ASSERT_TRUE(actor.move(step % 4 == 1 ? objects : 5));
    }
    if (step % 5 == 4) {
      ASSERT_TRUE(actor.remove(3));
      ASSERT_TRUE(actor.add(7, filtered));
    }
    if (step % 3 != 2) {
      ASSERT_TRUE(actor.update());
    }
    for (int i = 0; i < 70; ++i) {
      TestRay ray = rays.next(filtered);
      ASSERT_TRUE(same_ray(actor.broad_phase, actor.model, ray)) << "step " << step;
      // Without the objects in which the ray starts: some contain all of space.
      const auto outside = [&](ObjectId id) {
        double t = 0;
        int axis = 0;
        return !enters(ray, actor.model.at(id).box, t, axis) || t > 0;
      };
      const auto same_outside = [&] {
        return same_ray(actor.broad_phase, actor.model, ray, outside);
      };
      ASSERT_TRUE(same_outside()) << "step " << step;
      const std::optional<RayHit> hit = cast_by_loop(actor.model, ray, outside);
      if (!hit) continue;
      ++hits;
      // The distance itself is within reach, less is not.
      ray.max_distance = hit->distance;
      ASSERT_TRUE(same_outside()) << "step " << step;
      ray.max_distance = std::nextafter(hit->distance, 0);
      ASSERT_TRUE(same_outside()) << "step " << step;
    }
  }
  EXPECT_GT(hits, 100u);
}

TEST(Raycast, EqualsALoopFewObjects) {
  for (std::uint64_t seed = 0; seed < seeds(6); ++seed) cast_rays(seed, 60, seed % 2, false, 0);
}
TEST(Raycast, EqualsALoopManyObjects) {
  for (std::uint64_t seed = 10; seed < 10 + seeds(4); ++seed)
    cast_rays(seed, 900, seed % 2, seed % 3 == 0, seed % 4 == 0 ? 0.25f : 0);
}
TEST(Raycast, EqualsALoopInWorlds) {
  for (std::uint64_t seed = 20; seed < 20 + seeds(3); ++seed)
    cast_rays(seed, 600, true, false, 0, true);
}

// Hard scenes, each cast until an index exists.
TEST(Raycast, EqualsALoopHardScenes) {
  for (const HardScene& scene : hard_scenes(400)) {
    const BoxList& boxes = scene.boxes;
    Actor actor({}, 3, 14);
    std::vector<ObjectId> ids(boxes.size());
    ASSERT_TRUE(actor.broad_phase.add(boxes, ids.data()).ok());
    for (std::size_t i = 0; i < boxes.size(); ++i)
      ASSERT_TRUE(actor.model.add(ids[i], boxes[i], {}));
    RandomRays rays(actor, 14);
    for (int step = 0; step < 3; ++step) {
      if (step == 1) {
        ASSERT_TRUE(actor.broad_phase.update().ok());
      }
      for (int i = 0; i < 150; ++i) {
        ASSERT_TRUE(same_ray(actor.broad_phase, actor.model, rays.next(false))) << scene.name;
      }
    }
  }
}

// A lattice of cubes: rays along faces and edges, through corners, from corners.
TEST(Raycast, EqualsALoopLattice) {
  Actor actor({}, 1, 12);
  BoxList boxes;
  for (int i = 0; i < 1000; ++i) {
    boxes.push_back(cube(static_cast<float>(i % 10), static_cast<float>(i / 10 % 10),
                         static_cast<float>(i / 100), i % 7 == 0 ? 0 : 0.5f));
  }
  std::vector<ObjectId> ids(boxes.size());
  ASSERT_TRUE(actor.broad_phase.add(boxes, ids.data()).ok());
  for (std::size_t i = 0; i < boxes.size(); ++i) ASSERT_TRUE(actor.model.add(ids[i], boxes[i], {}));
  const float steps[] = {-1, -0.5f, 0, 0.5f, 1, 2, 3};
  Random random(2);
  const auto any = [&] { return steps[random.below(7)]; };
  std::size_t hits = 0;
  for (int i = 0; i < 6000; ++i) {
    const TestRay ray{
        {any() * 3, any() * 3, any() * 3}, {any(), any(), any() + 0.25f}, no_limit, {}};
    ASSERT_TRUE(same_ray(actor.broad_phase, actor.model, ray)) << i;
    hits += cast_by_loop(actor.model, ray, all_objects).has_value();
  }
  EXPECT_GT(hits, 3000u);
}

// The rules of the header, one by one.
struct OneBox {
  explicit OneBox(const Box& box) : id(b.add(box)) {}
  BroadPhase b;
  ObjectId id;
};

TEST(Raycast, FaceDistanceAndNormal) {
  const OneBox scene({{2, -1, -1}, {4, 1, 1}});
  const std::optional<RayHit> hit = scene.b.raycast({0, 0.5f, 0}, {10, 0, 0});
  ASSERT_TRUE(same(hit, RayHit{scene.id, 2, {2, 0.5f, 0}, {-1, 0, 0}}));
  // The length of the direction does not change the distance.
  ASSERT_TRUE(same(scene.b.raycast({0, 0.5f, 0}, {0.125f, 0, 0}), *hit));
  EXPECT_TRUE(
      same(scene.b.raycast({6, 0, 0}, {-1, 0, 0}), RayHit{scene.id, 2, {4, 0, 0}, {1, 0, 0}}));
  EXPECT_TRUE(same(scene.b.raycast({3, 9, 0.5f}, {0, -3, 0}),
                   RayHit{scene.id, 8, {3, 1, 0.5f}, {0, 1, 0}}));
  EXPECT_TRUE(
      same(scene.b.raycast({3, 0, -9}, {0, 0, 3}), RayHit{scene.id, 8, {3, 0, -1}, {0, 0, -1}}));
  EXPECT_FALSE(scene.b.raycast({0, 0, 0}, {-1, 0, 0}));
  EXPECT_FALSE(scene.b.raycast({0, 1.5f, 0}, {1, 0, 0}));
  EXPECT_FALSE(scene.b.raycast({0, 0, 0}, {1, 0, 0}, 1.5));
  EXPECT_TRUE(scene.b.raycast({0, 0, 0}, {1, 0, 0}, 2));
}

TEST(Raycast, TouchingCounts) {
  const OneBox scene({{2, -1, -1}, {4, 1, 1}});
  // Along a face, along an edge, through an edge, through a corner.
  EXPECT_TRUE(
      same(scene.b.raycast({0, 1, 0}, {1, 0, 0}), RayHit{scene.id, 2, {2, 1, 0}, {-1, 0, 0}}));
  EXPECT_TRUE(
      same(scene.b.raycast({0, 1, 1}, {1, 0, 0}), RayHit{scene.id, 2, {2, 1, 1}, {-1, 0, 0}}));
  EXPECT_TRUE(same(scene.b.raycast({1, 2, 0}, {3, -3, 0}),
                   RayHit{scene.id, std::sqrt(18.0) / 3, {2, 1, 0}, {-1, 0, 0}}));
  EXPECT_TRUE(same(scene.b.raycast({3, 2, 2}, {0, -1, -1}),
                   RayHit{scene.id, std::sqrt(2.0), {3, 1, 1}, {0, 1, 0}}));
  EXPECT_TRUE(same(scene.b.raycast({5, 2, 2}, {-1, -1, -1}),
                   RayHit{scene.id, std::sqrt(3.0), {4, 1, 1}, {1, 0, 0}}));
  // It ends on the face.
  EXPECT_TRUE(scene.b.raycast({2.5f, 3, 0}, {0, -1, 0}, 2));
  EXPECT_FALSE(scene.b.raycast({2.5f, 3, 0}, {0, -1, 0}, std::nextafter(2.0, 0)));
}

TEST(Raycast, StartsInside) {
  const OneBox scene({{-infinity, -1, -1}, {4, 1, 1}});
  const RayHit inside{scene.id, 0, {3, 0, 0}, {0, -0.6f, 0.8f}};
  EXPECT_TRUE(same(scene.b.raycast({3, 0, 0}, {0, 3, -4}), inside));
  EXPECT_TRUE(same(scene.b.raycast({3, 0, 0}, {0, 3, -4}, 0), inside));
  // On a face, whether it moves in, out or along it.
  for (const Vec3& by : {Vec3{-1, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}}) {
    EXPECT_TRUE(same(scene.b.raycast({4, 0, 0}, by, 1),
                     RayHit{scene.id, 0, {4, 0, 0}, {0 - by.x, 0 - by.y, 0}}));
  }
  const OneBox point({{1, 1, 1}, {1, 1, 1}});
  EXPECT_TRUE(
      same(point.b.raycast({1, 1, 1}, {0, 0, 2}), RayHit{point.id, 0, {1, 1, 1}, {0, 0, -1}}));
  EXPECT_TRUE(same(point.b.raycast({0, 0, 0}, {2, 2, 2}),
                   RayHit{point.id, 0.5 * std::sqrt(12.0), {1, 1, 1}, {-1, 0, 0}}));
  EXPECT_FALSE(point.b.raycast({0, 0, 0}, {2, 2, 2.0000002f}));
}

TEST(Raycast, AmongEqualDistancesTheLowestId) {
  BroadPhase b;
  const Box far{{3, -1, -1}, {4, 1, 1}}, near{{2, -1, -1}, {4, 1, 1}};
  b.add(far);
  const ObjectId first = b.add(near);
  b.add(near);
  EXPECT_EQ(b.raycast({0, 0, 0}, {1, 0, 0})->object, first);
}

// Distances beyond those of any float vector, and of any float.
TEST(Raycast, ExtremeLengths) {
  const OneBox far({{3e38f, -1, -1}, {infinity, 1, 1}});
  EXPECT_TRUE(same(far.b.raycast({-3e38f, 0, 0}, {1, 0, 0}),
                   RayHit{far.id, 2 * double{3e38f}, {3e38f, 0, 0}, {-1, 0, 0}}));
  EXPECT_TRUE(far.b.raycast({-3e38f, 0, 0}, {denormal, 0, 0}));
  EXPECT_FALSE(far.b.raycast({-3e38f, 0, 0}, {1, 0, 0}, 5.9e38));
  // It rises by 2^-149 per unit of x, until it meets the plate.
  const OneBox plate({{-infinity, 1, -1}, {infinity, 2, 1}});
  const std::optional<RayHit> hit = plate.b.raycast({0, 0, 0}, {1, denormal, 0});
  ASSERT_TRUE(same(hit, RayHit{plate.id, 0x1p149, {float_max, 1, 0}, {0, -1, 0}}));
  EXPECT_FALSE(plate.b.raycast({0, 0, 0}, {1, denormal, 0}, 0x1p148));
  const OneBox at_infinity({{infinity, -1, -1}, {infinity, 1, 1}});
  EXPECT_FALSE(at_infinity.b.raycast({0, 0, 0}, {1, 0, 0}));
  const OneBox everywhere({{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}});
  EXPECT_EQ(everywhere.b.raycast({7, 8, 9}, {1, 0, 0})->distance, 0);
}

TEST(Raycast, IgnoresMarginAndInactiveObjects) {
  Options options;
  options.margin = 1;
  BroadPhase b(options);
  b.add({{1, -1, -1}, {0.5f, 1, 1}});  // inactive
  const ObjectId removed = b.add({{1.5f, -1, -1}, {1.5f, 1, 1}});
  const ObjectId id = b.add({{2, -1, -1}, {4, 1, 1}});
  ASSERT_EQ(b.remove(removed), Status::ok);
  const std::optional<RayHit> hit = b.raycast({0, 0, 0}, {1, 0, 0});
  ASSERT_TRUE(same(hit, RayHit{id, 2, {2, 0, 0}, {-1, 0, 0}}));
}

TEST(Raycast, LayersAndFilters) {
  BroadPhase b;
  Filter layer;
  const auto add = [&](std::uint32_t group, float x) {
    layer.group = group;
    return b.add({{x, -1, -1}, {x + 0.5f, 1, 1}}, layer);
  };
  const ObjectId one = add(1, 1), two = add(2, 2), four = add(4, 3);
  const auto object = [&](std::uint32_t mask, ObjectFilter filter = {}) {
    const std::optional<RayHit> hit = b.raycast({0, 0, 0}, {1, 0, 0}, no_limit, mask, filter);
    return hit ? hit->object : ObjectId{999};
  };
  EXPECT_EQ(object(0xffffffffu), one);
  EXPECT_EQ(object(6), two);
  EXPECT_EQ(object(4), four);
  EXPECT_EQ(object(8), 999u);
  EXPECT_EQ(object(0), 999u);
  EXPECT_EQ(object(0xffffffffu, [&](ObjectId id) { return id != one; }), two);
  EXPECT_EQ(object(5, [&](ObjectId id) { return id != one; }), four);
  EXPECT_EQ(object(7, [](ObjectId) { return false; }), 999u);
  struct Counts {  // a callable that may change itself
    int calls = 0;
    bool operator()(ObjectId) { return ++calls > 0; }
  } counts;
  EXPECT_EQ(object(7, counts), one);
  EXPECT_GT(counts.calls, 0);
  // Worlds, by all filter values.
  Filter of_ray;
  of_ray.world = 3;
  layer = {};
  layer.world = 2;
  b.add({{0.1f, -1, -1}, {0.2f, 1, 1}}, layer);
  std::optional<RayHit> hit;
  ASSERT_TRUE(b.raycast({0, 0, 0}, {1, 0, 0}, no_limit, of_ray, {}, hit).ok());
  EXPECT_EQ(hit->object, one);
}

TEST(Raycast, InvalidRays) {
  const float nan = std::nanf("");
  const OneBox scene({{2, -1, -1}, {4, 1, 1}});
  const BroadPhase empty;
  const auto refused = [&](Status status, const std::string& text, const Vec3& origin,
                           const Vec3& direction, double max_distance = 1, Filter filter = {}) {
    for (const BroadPhase* b : {&scene.b, &empty}) {
      std::optional<RayHit> hit = RayHit{};
      const Result r = b->raycast(origin, direction, max_distance, filter, {}, hit);
      EXPECT_EQ(r.status, status) << text;
      EXPECT_EQ(std::string(r.message), text);
      EXPECT_FALSE(hit);
      if (filter.world != -1) continue;
      try {
        (void)b->raycast(origin, direction, max_distance);
        ADD_FAILURE() << "accepted: " << text;
      } catch (const Error& e) {
        EXPECT_EQ(std::string(e.what()), "throng: " + text);
      }
    }
  };
  refused(Status::nan_box, "origin: found (nan, 0, 0), wanted three finite numbers", {nan, 0, 0},
          {1, 0, 0});
  refused(Status::nan_box, "origin: found (0, 0, -inf), wanted three finite numbers",
          {0, 0, -infinity}, {1, 0, 0});
  refused(Status::nan_box,
          "direction: found (1, nan, 0), wanted three finite numbers; for an unlimited ray give an "
          "infinite max_distance",
          {0, 0, 0}, {1, nan, 0});
  refused(Status::nan_box,
          "direction: found (0, 0, inf), wanted three finite numbers; for an unlimited ray give an "
          "infinite max_distance",
          {0, 0, 0}, {0, 0, infinity});
  refused(
      Status::bad_option,
      "direction: found (0, 0, 0), wanted a vector other than 0; for the objects at a point use "
      "find_overlaps",
      {0, 0, 0}, {0, 0, 0});
  refused(Status::bad_option,
          "max_distance: found -0.5, wanted 0 or more, or infinity for no limit", {0, 0, 0},
          {1, 0, 0}, -0.5);
  refused(Status::bad_option, "max_distance: found nan, wanted 0 or more, or infinity for no limit",
          {0, 0, 0}, {1, 0, 0}, std::nan(""));
  Filter below;
  below.world = -2;
  refused(Status::bad_filter, "world: found -2, wanted -1 for every world, or 0 and up for one",
          {0, 0, 0}, {1, 0, 0}, 1, below);
  EXPECT_FALSE(empty.raycast({0, 0, 0}, {1, 0, 0}));
}

TEST(Raycast, FirstCallReportsInvalidOptions) {
  Options options;
  options.margin = -1;
  const BroadPhase objects(options);
  std::optional<RayHit> hit;
  const Result r = objects.raycast({0, 0, 0}, {1, 0, 0}, 10, Filter(), {}, hit);
  EXPECT_EQ(r.status, Status::bad_option);
  EXPECT_NE(std::string(r.message).find("margin is -1"), std::string::npos) << r.message;
  EXPECT_FALSE(hit);
}

// Several threads cast rays while one of them builds an index.
TEST(Raycast, ConcurrentRays) {
  Actor actor({}, 9, 24);
  ASSERT_TRUE(actor.add(3000, true));
  RandomRays rays(actor, 24);
  std::vector<TestRay> all;
  std::vector<std::optional<RayHit>> want;
  for (int i = 0; i < 60; ++i) {
    all.push_back(rays.next(true));
    want.push_back(cast_by_loop(actor.model, all.back(), all_objects));
  }
  const Snapshot before(actor.broad_phase);
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k) {
    threads.emplace_back([&, k] {
      BroadPhaseQuery query;
      for (std::size_t i = 0; i < 20 * all.size(); ++i) {
        const std::size_t j = (i + static_cast<std::size_t>(k) * 15) % all.size();
        std::optional<RayHit> hit;
        const TestRay& ray = all[j];
        const Result r = actor.broad_phase.raycast(ray.origin, ray.direction, ray.max_distance,
                                                   ray.filter, {}, hit);
        wrong += !r.ok() || !same(hit, want[j]);
        if (i % 50 != 0) continue;
        const Box box = {{1, 1, 1}, {9, 9, 9}};
        wrong += !query.find_overlaps(actor.broad_phase, Boxes(&box, 1)).ok();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(Snapshot(actor.broad_phase), before);
}

// Other calls are refused during a ray cast, and ray casts during other calls.
TEST(Raycast, BusyDuringOtherCalls) {
  OneBox scene({{2, -1, -1}, {4, 1, 1}});
  Result during_ray, during_query;
  std::optional<RayHit> nested, refused;
  const std::optional<RayHit> hit =
      scene.b.raycast({0, 0, 0}, {1, 0, 0}, no_limit, 0xffffffffu, [&](ObjectId) {
        during_ray = scene.b.update();
        nested = scene.b.raycast({0, 0, 0}, {1, 0, 0});
        return true;
      });
  EXPECT_TRUE(hit);
  EXPECT_TRUE(nested);
  EXPECT_EQ(during_ray.status, Status::busy);
  const Sweep sweep{{{0, 0, 0}, {0, 0, 0}}, {9, 0, 0}};
  ASSERT_TRUE(
      scene.b
          .find_hits(&sweep, 1, SweepHits::first, {},
                     [&](ObjectId) {
                       during_query = scene.b.raycast({0, 0, 0}, {1, 0, 0}, 1, {}, {}, refused);
                       return true;
                     })
          .ok());
  EXPECT_EQ(during_query.status, Status::busy);
  EXPECT_EQ(std::string(during_query.message),
            "another thread is in a call on this BroadPhase; retry when it has returned");
  EXPECT_FALSE(refused);
}

// Once an index exists, a ray allocates nothing; where memory runs out before, rays work without.
TEST(Raycast, Memory) {
  FailingResource memory;
  Options options;
  options.memory = &memory;
  Actor actor(options, 4, 30);
  ASSERT_TRUE(actor.add(4000, false));
  RandomRays rays(actor, 30);
  std::vector<TestRay> all;
  for (int i = 0; i < 40; ++i) all.push_back(rays.next(false));
  const auto cast_all = [&] {
    std::size_t failed = 0;
    for (const TestRay& ray : all) {
      std::optional<RayHit> hit;
      const Result r =
          actor.broad_phase.raycast(ray.origin, ray.direction, ray.max_distance, {}, {}, hit);
      failed += !r.ok();
      if (!r.ok()) {
        EXPECT_EQ(r.status, Status::out_of_memory) << r.message;
        EXPECT_FALSE(hit);
      } else {
        EXPECT_TRUE(same(hit, cast_by_loop(actor.model, ray, all_objects)));
      }
    }
    return failed;
  };
  memory.fail(0, true);
  std::size_t failed = 0;
  for (int round = 0; round < 10; ++round) failed += cast_all();
  memory.calm();
  EXPECT_GT(failed, 0u);
  for (int round = 0; round < 10; ++round) EXPECT_EQ(cast_all(), 0u);
  const std::size_t allocations = memory.allocations();
  EXPECT_EQ(cast_all(), 0u);
  EXPECT_EQ(memory.allocations(), allocations);
}

// ---- filters by lambdas and functions, of batches ----

bool is_third(ObjectId id) { return id % 3 == 0; }
double at_once(std::uint32_t, ObjectId, double) { return 0; }

TEST(ObjectFilter, Overlaps) {
  Actor actor({}, 6, 14);
  ASSERT_TRUE(actor.add(700, true));
  BroadPhaseQuery query;
  const auto third = [](ObjectId id) { return id % 3 == 0; };
  for (const std::size_t count : {1u, 30u, 900u}) {  // single queries, and a search of two sets
    const RandomQueries q(actor, count, true);
    Boxes view = q.boxes;
    view.filters = view_of(q.filters);
    ASSERT_TRUE(actor.broad_phase.find_overlaps(view).ok());
    std::vector<Pair> want;
    for (const Pair& pair : actor.broad_phase.overlaps()) {
      if (third(pair.second)) want.push_back(pair);
    }
    std::size_t calls = 0;
    const std::size_t all = actor.broad_phase.overlaps().size();
    Result r = actor.broad_phase.find_overlaps(view, [&](ObjectId id) {
      ++calls;
      return third(id);
    });
    ASSERT_TRUE(Model::check_query(r, want.size()));
    EXPECT_EQ(to_vector(actor.broad_phase.overlaps()), want);
    EXPECT_EQ(calls, all);
    EXPECT_LT(want.size(), all);
    for (const ObjectFilter& filter : {ObjectFilter(third), ObjectFilter(is_third)}) {
      r = query.find_overlaps(actor.broad_phase, view, filter);
      ASSERT_TRUE(Model::check_query(r, want.size()));
      EXPECT_EQ(to_vector(query.overlaps()), want);
    }
  }
}

TEST(ObjectFilter, Hits) {
  Actor actor({}, 7, 14);
  ASSERT_TRUE(actor.add(700, true));
  BroadPhaseQuery query;
  QueryClient client{actor.broad_phase, query};
  const RandomQueries q(actor, 90, true);
  const auto third = [](ObjectId id) { return id % 3 == 0; };
  const SweepTest filter = third;
  EXPECT_EQ(filter.when(filter.context, 0, 3, 0.25), 0.25);
  EXPECT_GT(filter.when(filter.context, 0, 4, 0.25), 1);
  const SweepTest by_name = is_third, test = at_once;
  EXPECT_EQ(by_name.when(by_name.context, 0, 3, 0.25), 0.25);
  EXPECT_GT(by_name.when(by_name.context, 0, 4, 0.25), 1);
  EXPECT_EQ(test.when(test.context, 0, 4, 0.25), 0);
  ASSERT_TRUE(same_hits(actor.broad_phase, actor.model, q.sweeps, q.filters, filter));
  ASSERT_TRUE(same_hits(client, actor.model, q.sweeps, q.filters, filter));
  double latest = 0;
  const auto later = [&latest](std::uint32_t sweep, ObjectId id, double time) {
    latest = time;
    return (sweep + id) % 3 == 0 ? 2.0 : time + 0.125;
  };
  ASSERT_TRUE(same_hits(client, actor.model, q.sweeps, q.filters, later));
}

}  // namespace
}  // namespace throng::tests
