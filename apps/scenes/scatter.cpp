// Scenes whose boxes have independent random positions and move between reflecting walls: the
// density stays constant over time.
#include <algorithm>
#include <cmath>

#include "apps/scenes/generator.hpp"

namespace throng::scenes {
namespace {

// Box i of a scene: its size, the range of its lower corner, its speed in units per frame.
struct Place {
  double size[3];
  double origin[3];
  double span[3];
  double speed;
};

Place in_cube(double sx, double sy, double sz, double span, double speed) noexcept {
  const double low = -span / 2;
  return {{sx, sy, sz}, {low, low, low}, {span, span, span}, speed};
}

// `where(i)` describes box i; fixed boxes (a plane, say) come first.
template <class Where>
class Scatter : public Generator {
 public:
  Scatter(const Spec& spec, const Random& random, const Where& where, double side)
      : where_(where), random_(random), movers_(spec.moving), side_(side) {}

  void boxes(std::size_t f, std::size_t begin, std::size_t end, Box* out) const override {
    const double time = static_cast<double>(f);
    for (std::size_t i = begin; i < end; ++i, ++out) {
      if (i < standing_.size()) {
        *out = standing_[i];
        continue;
      }
      const std::uint64_t xy = random_.word(i, 0), z = random_.word(i, 1);
      const Place p = where_(i, random_);
      double at[3] = {unit(xy) * p.span[0], unit_low(xy) * p.span[1], unit(z) * p.span[2]};
      if (f > 0 && movers_(z)) {
        std::uint64_t v = random_.word(i, 2);
        for (int k = 0; k < 3; ++k, v >>= 21) {
          const double velocity = (static_cast<double>(v & 0x1fffff) * 0x1p-20 - 1) * p.speed;
          at[k] = reflect(at[k] + velocity * time, p.span[k]);
        }
      }
      *out = box_at(p.origin[0] + at[0], p.origin[1] + at[1], p.origin[2] + at[2], p.size[0],
                    p.size[1], p.size[2]);
    }
  }

  bool moves(std::size_t i) const noexcept override {
    return i >= standing_.size() && movers_(random_.word(i, 1));
  }
  double side() const noexcept override { return side_; }
  bool has_worlds() const noexcept override { return world_size_ > 0; }
  std::int32_t world(std::size_t i) const noexcept override {
    return world_size_ > 0 ? static_cast<std::int32_t>(i / world_size_) : -1;
  }

  void add_standing(const Box& box) { standing_.push_back(box); }
  void set_world_size(std::size_t size) { world_size_ = size; }

 private:
  Where where_;
  Random random_;
  Movers movers_;
  double side_;
  std::vector<Box> standing_;
  std::size_t world_size_ = 0;
};

template <class Where>
std::unique_ptr<Scatter<Where>> scatter(const Spec& spec, const Random& random, const Where& where,
                                        double side) {
  return std::make_unique<Scatter<Where>>(spec, random, where, side);
}

const std::vector<SizeClass> unit_cubes = {{{1, 1, 1}, 1}};
constexpr double frame_speed = 0.1;  // a tenth of a unit cube per frame

std::unique_ptr<Generator> uniform(const Spec& spec, const Random& random) {
  const double span = solve_span(unit_cubes, spec.objects, spec.density);
  return scatter(
      spec, random,
      [span](std::size_t, const Random&) { return in_cube(1, 1, 1, span, frame_speed); }, span + 1);
}

constexpr std::size_t world_size = 64;

std::unique_ptr<Generator> worlds(const Spec& spec, const Random& random) {
  const double span = solve_span(unit_cubes, std::min(spec.objects, world_size), spec.density);
  auto made = scatter(
      spec, random,
      [span](std::size_t, const Random&) { return in_cube(1, 1, 1, span, frame_speed); }, span + 1);
  made->set_world_size(world_size);
  return made;
}

std::unique_ptr<Generator> spheres(const Spec& spec, const Random& random) {
  const std::vector<SizeClass> classes = {{{1, 1, 1}, 0.6}, {{2, 2, 2}, 0.3}, {{4, 4, 4}, 0.1}};
  const double span = solve_span(classes, spec.objects, spec.density);
  return scatter(
      spec, random,
      [span](std::size_t i, const Random& r) {
        const double u = r.even(i);
        const double d = u < 0.6 ? 1 : u < 0.9 ? 2 : 4;
        return in_cube(d, d, d, span, frame_speed);
      },
      span + 4);
}

std::unique_ptr<Generator> mixed(const Spec& spec, const Random& random) {
  constexpr double octaves = 6.6438561897747247;  // log2(100)
  constexpr double grounded = 0.02;               // the share of boxes that overlap the ground
  constexpr int steps = 48;
  std::vector<SizeClass> classes;
  for (int k = 0; k < steps; ++k) {
    const double s = portable_exp2((k + 0.5) / steps * octaves);
    classes.push_back({{s, s, s}, 1.0 / steps});
  }
  const std::size_t cubes = spec.objects > 0 ? spec.objects - 1 : 0;
  const double span =
      solve_span(classes, cubes, std::max(spec.density - grounded, spec.density / 2));
  auto made = scatter(
      spec, random,
      [span](std::size_t i, const Random& r) {
        const double s = portable_exp2(r.even(i) * octaves);
        Place p = in_cube(s, s, s, span, 5 * frame_speed);
        p.origin[2] = 0;
        return p;
      },
      span + 100);
  const float edge = static_cast<float>(span / 2 + 200);
  made->add_standing({{-edge, -edge, -10}, {edge, edge, static_cast<float>(grounded * span)}});
  return made;
}

std::unique_ptr<Generator> clusters(const Spec& spec, const Random& random) {
  constexpr std::size_t cells[3] = {5, 5, 4};
  constexpr std::size_t count = cells[0] * cells[1] * cells[2];
  constexpr double emptiness = 64;  // the scene's side in sides of a cluster
  const double span =
      std::max(solve_span(unit_cubes, (spec.objects + count - 1) / count, spec.density), 1.0);
  const double side = emptiness * (span + 1);
  std::vector<Place> places;
  for (std::size_t c = 0; c < count; ++c) {
    // Each cluster at a random place in a cell of its own.
    const std::size_t cell[3] = {c % cells[0], c / cells[0] % cells[1], c / (cells[0] * cells[1])};
    Place p = in_cube(1, 1, 1, span, frame_speed);
    for (int k = 0; k < 3; ++k) {
      const double pitch = side / static_cast<double>(cells[k]);
      const double u = unit(random.word(c, static_cast<unsigned>(5 + k)));
      p.origin[k] = static_cast<double>(cell[k]) * pitch + u * (pitch - span - 1) - side / 2;
    }
    places.push_back(p);
  }
  return scatter(
      spec, random,
      [places](std::size_t i, const Random&) -> const Place& { return places[i % count]; }, side);
}

std::unique_ptr<Generator> rods(const Spec& spec, const Random& random) {
  constexpr double third = 1.0 / 3;
  const std::vector<SizeClass> classes = {
      {{64, 1, 1}, third}, {{1, 64, 1}, third}, {{1, 1, 64}, third}};
  const double span = solve_span(classes, spec.objects, spec.density);
  return scatter(
      spec, random,
      [span](std::size_t i, const Random& r) {
        Place p = in_cube(1, 1, 1, span, frame_speed);
        p.size[static_cast<int>(r.even(i) * 3)] = 64;
        return p;
      },
      span + 64);
}

// The box of a round rod of length 64 and thickness 1 in a direction uniform over the sphere.
void any_rod(std::size_t i, const Random& random, double size[3]) noexcept {
  double a = 0, b = 0, s = 0;
  for (unsigned attempt = 3; attempt < 8; ++attempt) {  // four of five points are in the disc
    const std::uint64_t bits = random.word(i, attempt);
    a = unit(bits) * 2 - 1;
    b = unit_low(bits) * 2 - 1;
    s = a * a + b * b;
    if (s <= 1) break;
    a /= 2, b /= 2, s /= 4;  // used after the last attempt
  }
  const double root = std::sqrt(1 - s);  // Marsaglia's map of the disc to the sphere
  const double direction[3] = {2 * a * root, 2 * b * root, 1 - 2 * s};
  for (int k = 0; k < 3; ++k) {
    const double d = direction[k];
    size[k] = 64 * (d < 0 ? -d : d) + std::sqrt(std::max(1 - d * d, 0.0));
  }
}

std::unique_ptr<Generator> rods_any(const Spec& spec, const Random& random) {
  constexpr std::size_t samples = 100;
  std::vector<SizeClass> classes(samples);
  for (std::size_t k = 0; k < samples; ++k) {
    any_rod(k, random, classes[k].size);
    classes[k].share = 1.0 / samples;
  }
  const double span = solve_span(classes, spec.objects, spec.density);
  return scatter(
      spec, random,
      [span](std::size_t i, const Random& r) {
        Place p = in_cube(1, 1, 1, span, frame_speed);
        any_rod(i, r, p.size);
        return p;
      },
      span + 65);
}

std::unique_ptr<Generator> line(const Spec& spec, const Random& random) {
  const double span = solve_falling(
      [&](double s) {
        const double spans[3] = {s, 0, 0};
        return expected_pairs(unit_cubes, spec.objects, spans);
      },
      spec.density);
  return scatter(
      spec, random,
      [span](std::size_t, const Random&) {
        return Place{{1, 1, 1}, {-span / 2, 0, 0}, {span, 0, 0}, frame_speed};
      },
      span + 1);
}

std::unique_ptr<Generator> rectangles(const Spec& spec, const Random& random) {
  constexpr double sides[3] = {4, 2, 1};
  constexpr int ways[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  std::vector<SizeClass> classes;
  for (const auto& way : ways) {
    classes.push_back({{sides[way[0]], sides[way[1]], sides[way[2]]}, 1.0 / 6});
  }
  const double span = solve_span(classes, spec.objects, spec.density);
  return scatter(
      spec, random,
      [span, classes](std::size_t i, const Random& r) {
        const double* size = classes[static_cast<std::size_t>(r.even(i) * 6)].size;
        return in_cube(size[0], size[1], size[2], span, frame_speed);
      },
      span + 4);
}

// Four cones of this size on the floor, each in the middle of a quadrant.
constexpr std::size_t max_cones = 4;
constexpr double cone_size = 4;

// Expected pairs of n boxes, the cones included, with spheres whose lower corners are uniform in a
// cube on the floor. Does not increase with its side.
double expected_with_cones(std::size_t n, double span) {
  const double cones = static_cast<double>(std::min(n, max_cones));
  const double spheres = static_cast<double>(n) - cones;
  const double pitch = (span + 1) / 2;  // from one cone's centre to the next
  // All cones overlap or none; a cone overlaps boxes that start between 1 before it and its end.
  double pairs = pitch <= cone_size ? cones * (cones - 1) / 2 : 0;
  const double low = pitch / 2 - cone_size / 2;
  const double along = std::min(low + cone_size, span) - std::max(low - 1, 0.0);
  const double across = along < span ? along / span : 1;
  pairs += cones * spheres * across * across * (cone_size < span ? cone_size / span : 1);
  const double met = meeting_chance(1, 1, span);
  return pairs + spheres * (spheres - 1) / 2 * met * met * met;
}

std::unique_ptr<Generator> nbody(const Spec& spec, const Random& random) {
  const double n = static_cast<double>(std::max<std::size_t>(spec.objects, 1));
  const double span = solve_falling(
      [&](double s) { return expected_with_cones(spec.objects, s) / n; }, spec.density);
  const double pitch = (span + 1) / 2;
  auto made = scatter(
      spec, random,
      [span](std::size_t, const Random&) {
        Place p = in_cube(1, 1, 1, span, frame_speed);
        p.origin[0] -= 0.5, p.origin[1] -= 0.5;  // so that the centre of the floor is at 0, 0
        p.origin[2] = 0;
        return p;
      },
      std::max(span + 1, pitch + cone_size));
  for (std::size_t c = 0; c < max_cones; ++c) {
    const double x = c % 2 ? pitch / 2 : -pitch / 2, y = c / 2 ? pitch / 2 : -pitch / 2;
    const double half = cone_size / 2;
    made->add_standing(box_at(x - half, y - half, 0, cone_size, cone_size, cone_size));
  }
  return made;
}

struct Entry {
  const char* name;
  double density;
  std::unique_ptr<Generator> (*make)(const Spec&, const Random&);
};

// The index in this list seeds a scene's numbers: append new ones.
constexpr Entry entries[] = {
    {"uniform", 0.5, uniform},   {"sparse", 0.001, uniform},
    {"spheres", 1, spheres},     {"mixed", 4.7, mixed},
    {"clusters", 0.5, clusters}, {"rods", 2.7, rods},
    {"line", 1, line},           {"worlds", 0.5, worlds},
    {"rods-any", 39, rods_any},  {"rectangles", 1, rectangles},
    {"nbody", 1, nbody},
};

}  // namespace

std::unique_ptr<Generator> make_scatter(Spec& spec) {
  std::uint64_t number = 1;
  for (const Entry& entry : entries) {
    if (spec.name == entry.name) {
      if (spec.density == 0) spec.density = entry.density;
      return entry.make(spec, Random(spec.seed, number));
    }
    ++number;
  }
  return nullptr;
}

}  // namespace throng::scenes
