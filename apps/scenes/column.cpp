// The falling column: unit cubes in layers above a plane start to fall at frame 0, land in turn on
// the heap, and slide down its slope to rest. No dynamics: the position of box i at frame f is a
// formula.
//
// The heap. Column and heap are round. When the share tau of the boxes has landed, the heap's foot
// has the radius R(tau), R^3 = Rc^3 + tau (Rm^3 - Rc^3), where Rc is the column's radius; a box
// that lands at radius r of the column rests at r R / Rc. If boxes spread evenly over the disc of
// radius R while R grows so, the height at r is slope (R - max(r, Rc)): a cone with a cut-off top
// that keeps its slope and fills evenly, for every n.
#include <algorithm>
#include <cmath>

#include "apps/scenes/generator.hpp"

namespace throng::scenes {
namespace {

constexpr double pi = 3.14159265358979324;
constexpr double slope = 0.6;
constexpr double aspect = 4;         // the column's height in diameters
constexpr double drop = 4;           // of the lowest layer, above the plane
constexpr double fall_frames = 100;  // until the highest layer would reach the plane
constexpr double sunk = 0.5;         // boxes below this height lie on the plane itself
constexpr int table = 4096;

class Column : public Generator {
 public:
  Column(const Spec& spec, const Random& random) : random_(random), movers_(spec.moving) {
    const double n = spec.objects > 1 ? static_cast<double>(spec.objects - 1) : 1;
    // 8 unit volumes hold two interval lengths on each axis: a box overlaps half of 8 / volume
    // others.
    const double volume = 4 / spec.density;             // of the heap, per box
    pitch_ = std::max(1.25, 1.05 * cube_root(volume));  // the heap must not outgrow the column
    const double wanted = cube_root(n * pitch_ * pitch_ * pitch_ / (2 * aspect * pi));
    fill_layer(wanted);
    layers_ = std::ceil(n / static_cast<double>(cells_.size()));
    fall_ = 2 * (drop + layers_ * pitch_) / (fall_frames * fall_frames);

    column_radius_ = std::max(wanted, pitch_ / 2);
    const double rc3 = column_radius_ * column_radius_ * column_radius_;
    const double growth = 3 * volume * n / (pi * slope);
    radius_.resize(table + 2);
    for (int k = 0; k <= table; ++k) {
      radius_[static_cast<std::size_t>(k)] = cube_root(rc3 + growth * k / table);
    }
    radius_[table + 1] = radius_[table];
    const float edge = static_cast<float>(1.5 * radius_[table] + 4);
    plane_ = {{-edge, -edge, -1}, {edge, edge, 0}};
  }

  void boxes(std::size_t f, std::size_t begin, std::size_t end, Box* out) const override {
    for (std::size_t i = begin; i < end; ++i, ++out) *out = i == 0 ? plane_ : cube(i, f);
  }

  bool moves(std::size_t i) const noexcept override { return i > 0 && movers_(random_.word(i, 1)); }
  double side() const noexcept override {
    const double height = drop + layers_ * pitch_;
    return std::max(height, 2 * radius_[table]) + 1;
  }

 private:
  struct Cell {
    double x, y;
  };

  // The lattice points of one layer: a disc.
  void fill_layer(double radius) {
    const int reach = static_cast<int>(radius / pitch_);
    for (int a = -reach; a <= reach; ++a) {
      for (int b = -reach; b <= reach; ++b) {
        const Cell cell = {a * pitch_, b * pitch_};
        if (cell.x * cell.x + cell.y * cell.y <= radius * radius) cells_.push_back(cell);
      }
    }
  }

  double radius_at(double tau) const noexcept {
    const double at = tau * table;
    const auto k = static_cast<std::size_t>(at);
    return radius_[k] + (radius_[k + 1] - radius_[k]) * (at - static_cast<double>(k));
  }

  // Height of the heap with foot radius `foot`, at (x, y).
  double surface(double foot, double x, double y) const noexcept {
    const double r = std::sqrt(x * x + y * y);
    const double h = slope * (foot - (r > column_radius_ ? r : column_radius_)) - sunk;
    return h > 0 ? h : 0;
  }

  Box cube(std::size_t i, std::size_t f) const noexcept {
    const std::size_t layer = (i - 1) / cells_.size();
    const Cell& cell = cells_[(i - 1) % cells_.size()];
    const std::uint64_t jitter = random_.word(i, 0), other = random_.word(i, 1);
    const double jx = unit(jitter) - 0.5, jy = unit_low(jitter) - 0.5;

    // At most a fifth of the gap between neighbours in the column, so that none of them touch.
    const double play = (pitch_ - 1) * 0.4;
    const double x0 = cell.x + jx * play, y0 = cell.y + jy * play;
    const double z0 = drop + static_cast<double>(layer) * pitch_;
    const double tau = (static_cast<double>(layer) + unit(other)) / layers_;
    const double foot = radius_at(tau), spread = foot / column_radius_;
    const double x1 = (cell.x + jx * pitch_) * spread, y1 = (cell.y + jy * pitch_) * spread;

    const double landing = surface(foot, x0, y0);
    const double fallen = std::sqrt(2 * (z0 > landing ? z0 - landing : 0) / fall_);
    const double time = static_cast<double>(f);
    const bool moving = movers_(other);
    if (moving && time < fallen) return centred(x0, y0, z0 - fall_ * time * time / 2);

    const double dx = x1 - x0, dy = y1 - y0;
    const double way = std::sqrt(dx * dx + dy * dy);
    const double slide = 8 + 1.5 * std::sqrt(way);  // frames
    double s = moving ? (time - fallen) / slide : 1;
    if (s >= 1) return centred(x1, y1, surface(foot, x1, y1));
    const double hop = (0.5 + 0.3 * way) * unit_low(random_.word(i, 2)) * 4 * s * (1 - s);
    s = s * (2 - s);  // fast at first
    const double x = x0 + dx * s, y = y0 + dy * s;
    return centred(x, y, surface(foot, x, y) + hop);
  }

  static Box centred(double x, double y, double z) noexcept {
    return box_at(x - 0.5, y - 0.5, z, 1, 1, 1);
  }

  Random random_;
  Movers movers_;
  std::vector<Cell> cells_;
  std::vector<double> radius_;
  double pitch_ = 0;
  double layers_ = 0;
  double fall_ = 0;  // units per frame, squared
  double column_radius_ = 0;
  Box plane_{};
};

}  // namespace

std::unique_ptr<Generator> make_column(Spec& spec) {
  if (spec.name != "column") return nullptr;
  if (spec.density == 0) spec.density = 3;
  return std::make_unique<Column>(spec, Random(spec.seed, 101));
}

}  // namespace throng::scenes
