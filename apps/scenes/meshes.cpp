#include "apps/scenes/meshes.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "apps/scenes/noise.hpp"
#include "apps/scenes/random.hpp"

namespace throng::scenes {
namespace {

// Gives four pairs per triangle at 1M triangles; measured.
constexpr double soup_density = 54;

struct Point {
  double x = 0, y = 0, z = 0;
};
Point operator+(Point a, Point b) noexcept { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Point operator*(Point a, double s) noexcept { return {a.x * s, a.y * s, a.z * s}; }
double dot(Point a, Point b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }
Point cross(Point a, Point b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Point direction_of(Point a) noexcept { return a * (1 / std::sqrt(dot(a, a))); }
Vec3 rounded(Point p) noexcept {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

// The largest integer >= `least` whose square is at most x; `least` if there is none.
std::size_t root_of(double x, std::size_t least) noexcept {
  return std::max(least, static_cast<std::size_t>(std::sqrt(std::max(x, 0.0))));
}

// Two triangles per cell of a grid of rows and columns of vertices.
void add_cell(GeneratedMesh& mesh, std::size_t a, std::size_t b, std::size_t c, std::size_t d) {
  const auto ia = static_cast<std::uint32_t>(a), ib = static_cast<std::uint32_t>(b),
             ic = static_cast<std::uint32_t>(c), id = static_cast<std::uint32_t>(d);
  mesh.triangles.push_back({ia, ib, ic});
  mesh.triangles.push_back({ia, ic, id});
}

// The lattice points on the surface of a cube of n x n x n cells, numbered by layers of k.
class CubeLattice {
 public:
  explicit CubeLattice(std::size_t n) : n_(n) {}

  std::size_t size() const noexcept { return 6 * n_ * n_ + 2; }
  std::size_t index(std::size_t i, std::size_t j, std::size_t k) const noexcept {
    const std::size_t side = n_ + 1, layer = side * side;
    if (k == 0) return i + j * side;
    if (k == n_) return layer + 4 * n_ * (n_ - 1) + i + j * side;
    const std::size_t around = j == 0 ? i : i == n_ ? n_ + j : j == n_ ? 3 * n_ - i : 4 * n_ - j;
    return layer + 4 * n_ * (k - 1) + around;
  }

  template <class F>
  void for_each(F f) const {
    for (std::size_t k = 0; k <= n_; ++k) {
      for (std::size_t j = 0; j <= n_; ++j) {
        const bool inside = k != 0 && k != n_ && j != 0 && j != n_;
        for (std::size_t i = 0; i <= n_; i += inside ? n_ : 1) f(i, j, k);
      }
    }
  }

 private:
  std::size_t n_;
};

// Every triangle stays in the cone of its cell of the cube, so that only neighbours meet.
GeneratedMesh sphere(const MeshSpec& spec) {
  const std::size_t n = root_of(static_cast<double>(spec.triangles) / 12, 1);
  const CubeLattice lattice(n);
  const Noise shape(spec.seed, 1), bumps(spec.seed, 2), grain(spec.seed, 3), dust(spec.seed, 4);
  GeneratedMesh mesh;
  mesh.vertices.resize(lattice.size());
  mesh.triangles.reserve(12 * n * n);
  lattice.for_each([&](std::size_t i, std::size_t j, std::size_t k) {
    const auto across = [n](std::size_t c) {
      return 2 * static_cast<double>(c) / static_cast<double>(n) - 1;
    };
    const double x = across(i), y = across(j), z = across(k);
    // A map of the cube to the sphere that keeps cells of about one size.
    const double xx = x * x, yy = y * y, zz = z * z;
    const Point d{x * std::sqrt(1 - yy / 2 - zz / 2 + yy * zz / 3),
                  y * std::sqrt(1 - zz / 2 - xx / 2 + zz * xx / 3),
                  z * std::sqrt(1 - xx / 2 - yy / 2 + xx * yy / 3)};
    const auto at = [&d](const Noise& noise, double f) {
      return noise(d.x * f + 0.31, d.y * f + 0.57, d.z * f + 0.83);
    };
    const double radius = 0.9 + 0.4 * at(shape, 1.4) + 0.13 * at(bumps, 4) + 0.02 * at(grain, 19) +
                          0.006 * at(dust, 67);
    mesh.vertices[lattice.index(i, j, k)] = rounded(d * radius);
  });
  for (int face = 0; face < 6; ++face) {
    const std::size_t fixed = face % 2 != 0 ? n : 0;
    const auto index = [&](std::size_t u, std::size_t v) {
      if (face % 2 == 0) std::swap(u, v);  // seen from outside, counter-clockwise
      return face / 2 == 0   ? lattice.index(fixed, u, v)
             : face / 2 == 1 ? lattice.index(v, fixed, u)
                             : lattice.index(u, v, fixed);
    };
    for (std::size_t v = 0; v < n; ++v) {
      for (std::size_t u = 0; u < n; ++u) {
        add_cell(mesh, index(u, v), index(u + 1, v), index(u + 1, v + 1), index(u, v + 1));
      }
    }
  }
  return mesh;
}

// A rectangular sheet of columns x rows cells; `at(column, row)` is the place of a vertex.
template <class Place>
GeneratedMesh sheet(std::size_t columns, std::size_t rows, const Place& at) {
  GeneratedMesh mesh;
  mesh.vertices.reserve((columns + 1) * (rows + 1));
  mesh.triangles.reserve(2 * columns * rows);
  for (std::size_t c = 0; c <= columns; ++c) {
    for (std::size_t r = 0; r <= rows; ++r) mesh.vertices.push_back(rounded(at(c, r)));
  }
  for (std::size_t c = 0; c < columns; ++c) {
    for (std::size_t r = 0; r < rows; ++r) {
      const std::size_t a = c * (rows + 1) + r, b = a + rows + 1;
      add_cell(mesh, a, b, b + 1, a + 1);
    }
  }
  return mesh;
}

GeneratedMesh crumpled(const MeshSpec& spec) {
  const std::size_t columns = root_of(static_cast<double>(spec.triangles) / 2, 1);
  const std::size_t rows = std::max<std::size_t>(1, spec.triangles / 2 / columns);
  const Noise noise[3] = {Noise(spec.seed, 11), Noise(spec.seed, 12), Noise(spec.seed, 13)};
  const auto at = [&](std::size_t column, std::size_t row) {
    const double u = 2 * static_cast<double>(column) / static_cast<double>(columns) - 1;
    const double v = 2 * static_cast<double>(row) / static_cast<double>(rows) - 1;
    // Each octave folds the sheet once more: it moves points by more than it leaves between them.
    Point p{0.75 * u, 0.75 * v, 0};
    double frequency = 1.3, size = 0.62;
    for (int octave = 0; octave < 4; ++octave) {
      const double x = u * frequency + 0.37, y = v * frequency + 0.73, z = 0.5 + octave;
      p = p + Point{noise[0](x, y, z), noise[1](x, y, z), noise[2](x, y, z)} * size;
      frequency *= 2.1, size *= 0.42;
    }
    return p;
  };
  return sheet(columns, rows, at);
}

// The radius grows by one pitch per turn; a factor that depends on the angle and z alone lets the
// surface wave. Columns of all turns are on the same rays from the axis, so layers keep apart.
GeneratedMesh spiral(const MeshSpec& spec, bool touches) {
  constexpr double inner = 0.5, outer = 1, height = 1.5, pi = 3.141592653589793;
  const double n = static_cast<double>(spec.triangles);
  // An edge is two pitches long, along the mean turn and along z: n = 2 columns rows.
  const double pitch_per_edge = 0.5, span = outer - inner, mean = (inner + outer) / 2;
  const double turns_wanted =
      cube_root(n * span * span / (4 * pi * mean * height * pitch_per_edge * pitch_per_edge));
  const double pitch = span / turns_wanted, edge = pitch / pitch_per_edge;
  const std::size_t rows = std::max<std::size_t>(2, static_cast<std::size_t>(height / edge));
  const std::size_t per_turn =
      std::max<std::size_t>(8, static_cast<std::size_t>(2 * pi * mean / edge));
  const std::size_t columns = std::max<std::size_t>(1, spec.triangles / 2 / rows);
  const Random random(spec.seed, 21);
  const double phase = unit(random.word(0, 0));
  const auto at = [&](std::size_t column, std::size_t row) {
    if (touches && column > 0 && row > 0 && row < rows && column % 3 == 0 && row % 3 == 0 &&
        column / per_turn % 2 == 0 && column + per_turn < columns &&
        random.word(column * (rows + 1) + row, 1) % 8 == 0) {
      column += per_turn;  // the tip of a dent
    }
    const double turn = static_cast<double>(column % per_turn) / static_cast<double>(per_turn);
    const double z = height * (static_cast<double>(row) / static_cast<double>(rows) - 0.5);
    const double wave = 1 + 0.05 * portable_sine_cosine(3 * turn + 0.4 * z + phase).sine +
                        0.02 * portable_sine_cosine(5 * turn - z + phase).sine;
    const double radius =
        (inner + pitch * static_cast<double>(column) / static_cast<double>(per_turn)) * wave;
    const SineCosine angle = portable_sine_cosine(turn);
    return Point{radius * angle.cosine, radius * angle.sine, z};
  };
  return sheet(columns, rows, at);
}

// A rotation: three orthogonal unit vectors.
struct Axes {
  Point x, y, z;
};

// A point of a ball of radius 1: the first of several in a cube that is inside.
Point in_ball(const Random& random, std::uint64_t i, unsigned k) noexcept {
  Point p;
  for (std::uint64_t attempt = 0; attempt < 16; ++attempt) {
    const std::uint64_t xy = random.word(64 * i + attempt, k),
                        z = random.word(64 * i + attempt, k + 1);
    p = {2 * unit(xy) - 1, 2 * unit_low(xy) - 1, 2 * unit(z) - 1};
    const double square = dot(p, p);
    if (square <= 1 && square > 0.01) break;
    p = {0.5, 0.5, 0.5};
  }
  return p;
}

Axes any_axes(const Random& random, std::uint64_t i) noexcept {
  const Point z = direction_of(in_ball(random, i, 0));
  Point other = in_ball(random, i, 2);
  const Point across = cross(z, other);
  if (dot(across, across) < 1e-4) other = {z.y, z.z, -z.x};
  const Point x = direction_of(cross(z, other));
  return {x, cross(z, x), z};
}

// Winds `along` times around the axis of the torus and `around` times around its tube.
struct KnotShape {
  int along, around;
};

GeneratedMesh knot(const MeshSpec& spec) {
  constexpr KnotShape shapes[] = {{2, 3}, {3, 2}, {2, 5}, {3, 4}};
  constexpr std::size_t most_tubes = 13;
  constexpr double torus = 0.5, wind = 0.2, tube = 0.065, reach = 0.45;
  constexpr double rings_per_side = 18;  // a tube's length to its circumference
  // A tube takes some triangles to be one.
  const std::size_t tubes = std::clamp<std::size_t>(spec.triangles / 60, 1, most_tubes);
  const double each = static_cast<double>(spec.triangles) / static_cast<double>(tubes);
  const std::size_t sides = root_of(each / (2 * rings_per_side), 3);
  const std::size_t rings = std::max<std::size_t>(3, static_cast<std::size_t>(each) / (2 * sides));
  const Random random(spec.seed, 31);
  GeneratedMesh mesh;
  mesh.vertices.reserve(tubes * rings * sides);
  mesh.triangles.reserve(2 * tubes * rings * sides);
  for (std::size_t t = 0; t < tubes; ++t) {
    const KnotShape shape = shapes[t % std::size(shapes)];
    const Axes axes = any_axes(random, t);
    const Point centre = in_ball(random, t, 4) * reach;
    const std::size_t first = mesh.vertices.size();
    for (std::size_t r = 0; r < rings; ++r) {
      const double share = static_cast<double>(r) / static_cast<double>(rings);
      const SineCosine a = portable_sine_cosine(shape.along * share);
      const SineCosine b = portable_sine_cosine(shape.around * share);
      const double radius = torus + wind * b.cosine;
      const Point on_torus{radius * a.cosine, radius * a.sine, wind * b.sine};
      const Point normal{b.cosine * a.cosine, b.cosine * a.sine, b.sine};
      const Point tangent = direction_of(
          Point{-radius * a.sine, radius * a.cosine, 0} * shape.along +
          Point{-b.sine * a.cosine, -b.sine * a.sine, b.cosine} * (wind * shape.around));
      const Point binormal = cross(tangent, normal);
      for (std::size_t s = 0; s < sides; ++s) {
        const SineCosine c =
            portable_sine_cosine(static_cast<double>(s) / static_cast<double>(sides));
        const Point p = on_torus + normal * (tube * c.cosine) + binormal * (tube * c.sine);
        mesh.vertices.push_back(rounded(centre + axes.x * p.x + axes.y * p.y + axes.z * p.z));
      }
    }
    for (std::size_t r = 0; r < rings; ++r) {
      const std::size_t row = first + r * sides, next = first + (r + 1) % rings * sides;
      for (std::size_t s = 0; s < sides; ++s) {
        const std::size_t after = (s + 1) % sides;
        add_cell(mesh, row + s, next + s, next + after, row + after);
      }
    }
  }
  return mesh;
}

GeneratedMesh soup(const MeshSpec& spec) {
  // The pairs per triangle grow with n size^3.
  const double size = 2 * cube_root(soup_density / static_cast<double>(spec.triangles));
  const Random random(spec.seed, 41);
  GeneratedMesh mesh;
  mesh.vertices.reserve(3 * spec.triangles);
  mesh.triangles.reserve(spec.triangles);
  for (std::size_t t = 0; t < spec.triangles; ++t) {
    const std::uint64_t xy = random.word(t, 0), zz = random.word(t, 1);
    const Point centre{2 * unit(xy) - 1, 2 * unit_low(xy) - 1, 2 * unit(zz) - 1};
    for (unsigned k = 0; k < 3; ++k) {
      const std::uint64_t ab = random.word(t, 2 + 2 * k), c = random.word(t, 3 + 2 * k);
      const Point offset{unit(ab) - 0.5, unit_low(ab) - 0.5, unit(c) - 0.5};
      mesh.vertices.push_back(rounded(centre + offset * size));
    }
    const auto v = static_cast<std::uint32_t>(3 * t);
    mesh.triangles.push_back({v, v + 1, v + 2});
  }
  return mesh;
}

}  // namespace

const std::vector<std::string>& mesh_names() {
  static const std::vector<std::string> all = {"sphere",          "crumpled", "spiral",
                                               "spiral-touching", "knot",     "soup"};
  return all;
}

GeneratedMesh make_mesh(const MeshSpec& spec) {
  if (spec.triangles < min_mesh_triangles || spec.triangles > max_mesh_triangles) {
    throw std::invalid_argument(std::to_string(spec.triangles) + " triangles; wanted " +
                                std::to_string(min_mesh_triangles) + " to " +
                                std::to_string(max_mesh_triangles));
  }
  if (spec.name == "sphere") return sphere(spec);
  if (spec.name == "crumpled") return crumpled(spec);
  if (spec.name == "spiral") return spiral(spec, false);
  if (spec.name == "spiral-touching") return spiral(spec, true);
  if (spec.name == "knot") return knot(spec);
  if (spec.name == "soup") return soup(spec);
  std::string list;
  for (const std::string& name : mesh_names()) list += (list.empty() ? "" : ", ") + name;
  throw std::invalid_argument("no mesh has the name '" + spec.name + "'; there are: " + list);
}

}  // namespace throng::scenes
