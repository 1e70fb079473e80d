#include "work/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

#include "support/hard_boxes.hpp"
#include "support/random.hpp"

namespace throng::tests {
namespace {

// Limits the quadratic number of pairs, for memory and time.
constexpr std::uint32_t max_coincident_boxes = 3000;

Box centred(const Vec3& at, const Vec3& half) {
  return {{at.x - half.x, at.y - half.y, at.z - half.z},
          {at.x + half.x, at.y + half.y, at.z + half.z}};
}
Box centred(const Vec3& at, float half) { return centred(at, Vec3{half, half, half}); }
Vec3 plus(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

// Unit cubes, `density` per unit of volume, in a cube whose lowest corner is `at`.
void add_cluster(WorkScene& s, Random& r, std::uint32_t n, float density, const Vec3& at,
                 float unit) {
  const float side = std::cbrt(static_cast<float>(n) / density);
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec3 p = r.point(0, side);
    s.boxes.push_back(
        centred({at.x + p.x * unit, at.y + p.y * unit, at.z + p.z * unit}, 0.5f * unit));
  }
}

void set_movers(WorkScene& s, Random& r) {
  const auto n = static_cast<std::uint32_t>(s.boxes.size());
  for (std::uint32_t k = std::clamp(n / 200, 1u, 64u); k > 0; --k) s.movers.push_back(r.below(n));
  std::sort(s.movers.begin(), s.movers.end());
  s.movers.erase(std::unique(s.movers.begin(), s.movers.end()), s.movers.end());
  s.teleport = r.one_in(3);
}

void uniform(WorkScene& s, Random& r, std::uint32_t n) {
  add_cluster(s, r, n, r.magnitude(-4, 0), r.point(-100, 100), 1);
}

void pile(WorkScene& s, Random& r, std::uint32_t n) {
  const float density = r.in(1, 4), height = r.in(4, 30);
  const float side = std::sqrt(static_cast<float>(n) / (density * height));
  for (std::uint32_t i = 0; i < n; ++i)
    s.boxes.push_back(
        centred({r.in(0, side), r.in(0, side), height * r.unit() * r.unit()}, r.in(0.3f, 0.7f)));
}

void two_clusters(WorkScene& s, Random& r, std::uint32_t n) {
  const float density = r.magnitude(-3, 1);
  const float width = std::cbrt(static_cast<float>(n) / density);
  const float gap = width * r.magnitude(0, 19);  // up to 1e6 widths
  Vec3 to{0, 0, 0};
  (&to.x)[r.below(3)] = gap;
  if (r.one_in(2)) to = {gap, gap, gap};
  const std::uint32_t there = r.one_in(2) ? n / 2 : n / 20 + 1;
  add_cluster(s, r, n - there, density, {0, 0, 0}, 1);
  add_cluster(s, r, there, density, to, 1);
}

void heaps(WorkScene& s, Random& r, std::uint32_t n) {
  const std::uint32_t k = 2 + r.below(63);
  const float range = r.magnitude(6, 23);
  const bool scales = r.one_in(2);
  for (std::uint32_t h = 0; h < k; ++h) {
    const float unit = scales ? r.magnitude(-6, 6) : 1;
    add_cluster(s, r, n / k + 1, r.magnitude(-1, 2), r.point(-range, range), unit);
  }
}

// Log-uniform coordinates, independent per axis; a box's size is a thousandth of its coordinate.
void decades(WorkScene& s, Random& r, std::uint32_t n) {
  const int octaves = r.between(2, 99);  // up and down: 1 to 60 decades
  const bool both_signs = r.one_in(2);
  for (std::uint32_t i = 0; i < n; ++i) {
    Vec3 at;
    for (int k = 0; k < 3; ++k) {
      (&at.x)[k] = r.magnitude(-octaves, octaves);
      if (both_signs && r.one_in(2)) (&at.x)[k] = -(&at.x)[k];
    }
    s.boxes.push_back(centred(
        at, Vec3{std::fabs(at.x) * 1e-3f, std::fabs(at.y) * 1e-3f, std::fabs(at.z) * 1e-3f}));
  }
}

void layers(WorkScene& s, Random& r, std::uint32_t n) {
  const std::uint32_t count = 1 + r.below(20);
  const float side = std::sqrt(static_cast<float>(n / count + 1) * r.in(1, 8));
  const float spacing = r.magnitude(-3, 6);
  const std::uint32_t across = r.below(3);
  for (std::uint32_t i = 0; i < n; ++i) {
    Vec3 at = r.point(0, side), half{0.5f, 0.5f, 0.5f};
    (&at.x)[across] = static_cast<float>(r.below(count)) * spacing;
    (&half.x)[across] = 0.05f;
    s.boxes.push_back(centred(at, half));
  }
  s.path_objects = std::sqrt(static_cast<double>(n));
}

// `kinds` directions of rods; `planes` layers that contain them, 0: anywhere.
void rods(WorkScene& s, Random& r, std::uint32_t n, std::uint32_t kinds, std::uint32_t planes) {
  const float length = r.magnitude(3, 7), thin = 0.05f;
  const auto count = static_cast<float>(n);
  // In a plane each rod crosses some ten others; in space few.
  const float side = planes == 0
                         ? std::cbrt(count * length * length * 0.2f)
                         : length * std::sqrt(count / (10 * static_cast<float>(planes))) + length;
  for (std::uint32_t i = 0; i < n; ++i) {
    Vec3 at = r.point(0, side), half{thin, thin, thin};
    const std::uint32_t plane = planes == 0 ? 0 : r.below(planes);
    if (planes != 0) at.z = static_cast<float>(plane);
    // One direction per layer if there are several; else mixed.
    const std::uint32_t along = planes > 1 ? plane % kinds : r.below(kinds);
    (&half.x)[along] = 0.5f * length * r.in(0.5f, 1);
    s.boxes.push_back(centred(at, half));
  }
  s.path_objects = std::sqrt(static_cast<double>(n));
}
void rods_layer(WorkScene& s, Random& r, std::uint32_t n) { rods(s, r, n, 2, 1); }
void rods_layers(WorkScene& s, Random& r, std::uint32_t n) { rods(s, r, n, 2, 2 + r.below(9)); }
void rods_any(WorkScene& s, Random& r, std::uint32_t n) { rods(s, r, n, 3, 0); }

void scaled(WorkScene& s, Random& r, std::uint32_t n) {
  add_cluster(s, r, n, r.magnitude(-3, 0), {0, 0, 0}, std::ldexp(1.0f, r.between(-133, 100)));
}

// A heap of static boxes of 4 units in a cube of `side`, at (1000, 1000, 1000).
float static_heap(WorkScene& s, Random& r, std::uint32_t n) {
  const float side = r.in(1, 16);
  for (std::uint32_t i = 0; i < n; ++i)
    s.boxes.push_back(centred(plus({1000, 1000, 1000}, r.point(0, side)), 2));
  s.is_static.assign(n, 1);
  return side;
}
void add_mover(WorkScene& s, const Vec3& at) {
  s.movers.push_back(static_cast<ObjectId>(s.boxes.size()));
  s.boxes.push_back(centred(at, 0.5f));
  s.is_static.push_back(0);
}
void far_mover(WorkScene& s, Random& r, std::uint32_t n) {
  static_heap(s, r, n);
  add_mover(s, r.point(-100, 100));
}
void mover_above(WorkScene& s, Random& r, std::uint32_t n) {
  const float side = static_heap(s, r, n);
  add_mover(s, {1000 + side / 2, 1000 + side + 2.7f + r.in(0, 1), 1000 + side / 2});
}
void mover_inside(WorkScene& s, Random& r, std::uint32_t n) {
  const float side = static_heap(s, r, n);
  add_mover(s, plus({1000, 1000, 1000}, r.point(0, side)));
}
void far_movers(WorkScene& s, Random& r, std::uint32_t n) {
  static_heap(s, r, n);
  const std::uint32_t k = 2 + r.below(n / 20 + 1);
  const float side = std::cbrt(static_cast<float>(k)) * 3;
  for (std::uint32_t i = 0; i < k; ++i) add_mover(s, r.point(0, side));
}

// A dense heap that is spread out before anything is measured.
void unpacked(WorkScene& s, Random& r, std::uint32_t n) {
  const float heap = std::cbrt(static_cast<float>(n) / r.in(4, 30));
  const float side = std::cbrt(static_cast<float>(n)) * r.in(1.5f, 4);
  for (std::uint32_t i = 0; i < n; ++i) {
    s.boxes.push_back(centred(r.point(0, heap), 0.5f));
    s.unpacked.push_back(centred(r.point(-side / 2, side / 2), 0.5f));
  }
}

void deletions(WorkScene& s, Random& r, std::uint32_t n) {
  add_cluster(s, r, n, r.in(0.2f, 20), {0, 0, 0}, 1);
  const std::uint32_t kept_one_in = 20 + r.below(200);
  for (std::uint32_t i = 0; i < n; ++i) {
    if (r.one_in(kept_one_in) || i < 4)
      s.movers.push_back(i);
    else
      s.removed.push_back(i);
  }
  if (s.movers.size() > 16) s.movers.resize(16);
}

// Boxes that nearly coincide; a filter separates them.
void coincident(WorkScene& s, Random& r, std::uint32_t n) {
  const float side = r.in(1, 8);
  for (std::uint32_t i = 0; i < n; ++i) s.boxes.push_back(centred(r.point(0, side), 2));
}
void coincident_static(WorkScene& s, Random& r, std::uint32_t n) {
  coincident(s, r, n);
  s.is_static.assign(s.boxes.size(), 1);
  for (int k = 0; k < 8; ++k) {
    s.movers.push_back(r.below(n));
    s.is_static[s.movers.back()] = 0;
  }
  std::sort(s.movers.begin(), s.movers.end());
  s.movers.erase(std::unique(s.movers.begin(), s.movers.end()), s.movers.end());
}
void coincident_owner(WorkScene& s, Random& r, std::uint32_t n) {
  coincident(s, r, std::min(n, max_coincident_boxes));
  const std::uint32_t owners = r.one_in(2) ? 1 : 1 + r.below(4);
  for (std::size_t i = 0; i < s.boxes.size(); ++i)
    s.owner.push_back(static_cast<std::int32_t>(r.below(owners)));
  s.pays_for_forbidden = true;
}
void coincident_mask(WorkScene& s, Random& r, std::uint32_t n) {
  coincident(s, r, std::min(n, max_coincident_boxes));
  // One class that never pairs with itself; or several, each of which pairs with one other.
  const std::uint32_t classes = r.one_in(2) ? 1 : 2 + r.below(30);
  for (std::size_t i = 0; i < s.boxes.size(); ++i) {
    const std::uint32_t c = r.below(classes);
    s.group.push_back(1u << c);
    s.mask.push_back(classes == 1 ? 2 : 1u << (classes - 1 - c));
  }
  s.pays_for_forbidden = true;
}
void coincident_worlds(WorkScene& s, Random& r, std::uint32_t n) {
  const std::uint32_t worlds = 1 + n / (1 + r.below(200));
  const float side = r.in(3, 12);
  for (std::uint32_t i = 0; i < n; ++i) {
    s.boxes.push_back(centred(r.point(0, side), 0.5f));
    s.world.push_back(static_cast<std::int32_t>(r.below(worlds)));
  }
  s.queries_test_all = true;
}

// Walls that are unbounded along one axis, among cubes; thin and far apart, so few pairs.
void unbounded(WorkScene& s, Random& r, std::uint32_t n) {
  const float side = std::sqrt(static_cast<float>(n) * r.in(4, 30));
  const std::uint32_t along = r.below(3), one_in = 1 + r.below(8);
  for (std::uint32_t i = 0; i < n; ++i) {
    Box box = centred(r.point(0, side), 0.5f);
    if (r.one_in(one_in)) {
      (&box.lower.x)[along] = -infinity;
      (&box.upper.x)[along] = infinity;
    }
    s.boxes.push_back(box);
  }
  if (r.one_in(2)) s.boxes[0] = {{-infinity, -infinity, -1}, {infinity, infinity, -1}};
  s.path_objects = std::sqrt(static_cast<double>(n));
}

void sizes(WorkScene& s, Random& r, std::uint32_t n) {
  const int octaves = r.between(1, 10);
  const float side = std::ldexp(std::cbrt(static_cast<float>(n)), octaves) * r.in(0.5f, 2);
  for (std::uint32_t i = 0; i < n; ++i)
    s.boxes.push_back(centred(r.point(0, side), 0.5f * r.magnitude(-octaves, octaves)));
}

void one_point(WorkScene& s, Random& r, std::uint32_t n) {
  const Vec3 at = r.point(-100, 100);
  const float half = r.one_in(3) ? 0 : r.unit();
  s.boxes.assign(std::min(n, max_coincident_boxes / 2), centred(at, half));
}

// Coordinates of few values, so that no plane separates many boxes.
void few_values(WorkScene& s, Random& r, std::uint32_t n) {
  const int levels = r.between(4, 64);
  const auto places = static_cast<std::uint32_t>(levels * levels * levels);
  const float unit = r.magnitude(-3, 3);
  n = std::min(n, 40 * places);
  for (std::uint32_t i = 0; i < n; ++i) {
    Vec3 at;
    for (int k = 0; k < 3; ++k) (&at.x)[k] = static_cast<float>(r.between(0, levels - 1)) * unit;
    s.boxes.push_back(r.one_in(4) ? Box{at, at} : cube(at, unit * static_cast<float>(r.below(2))));
  }
}

struct Family {
  const char* name;
  void (*make)(WorkScene&, Random&, std::uint32_t);
};
constexpr Family all[] = {
    {"uniform", uniform},
    {"pile", pile},
    {"two-clusters", two_clusters},
    {"heaps", heaps},
    {"decades", decades},
    {"layers", layers},
    {"rods-layer", rods_layer},
    {"rods-layers", rods_layers},
    {"rods-any", rods_any},
    {"scaled", scaled},
    {"far-mover", far_mover},
    {"mover-above", mover_above},
    {"mover-inside", mover_inside},
    {"far-movers", far_movers},
    {"unpacked", unpacked},
    {"deletions", deletions},
    {"coincident-static", coincident_static},
    {"coincident-owner", coincident_owner},
    {"coincident-mask", coincident_mask},
    {"coincident-worlds", coincident_worlds},
    {"unbounded", unbounded},
    {"sizes", sizes},
    {"one-point", one_point},
    {"few-values", few_values},
};

}  // namespace

Boxes WorkScene::view() const {
  Boxes v = boxes;
  const auto hang = [](auto& to, const auto& from) {
    if (!from.empty()) to = {from.data(), from.size()};
  };
  hang(v.filters.group, group);
  hang(v.filters.mask, mask);
  hang(v.filters.owner, owner);
  hang(v.filters.world, world);
  hang(v.filters.is_static, is_static);
  return v;
}

const std::vector<std::string>& work_families() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> made;
    for (const Family& family : all) made.emplace_back(family.name);
    return made;
  }();
  return names;
}

WorkScene make_work_scene(const std::string& family, std::uint32_t n, std::uint64_t seed) {
  for (const Family& f : all) {
    if (family != f.name) continue;
    Random r(seed);
    WorkScene s;
    s.family = family;
    s.seed = seed;
    s.path_objects = std::cbrt(static_cast<double>(n));
    f.make(s, r, n);
    if (s.movers.empty()) set_movers(s, r);
    return s;
  }
  throw std::invalid_argument("no family " + family);
}

}  // namespace throng::tests
