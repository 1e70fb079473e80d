#include "live/cells.hpp"

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstring>
#include <limits>

namespace throng::live {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr Cells::Line empty_line = {
    {{nan, nan}, {nan, nan}, {nan, nan}, {nan, nan}, {nan, nan}, {nan, nan}}, {none, none}, 0, 0};
// Of so many boxes all are looked at for a plan; of more one in eight, but at least so many, and at
// most so many.
constexpr std::size_t whole_sample = 1536, least_sample = 512, most_sample = 4096;
constexpr double crowded = 4;
constexpr int most_halvings = 16;
constexpr std::size_t most_homes = std::size_t{1} << 30;

float finite(float x) noexcept { return std::clamp(x, -FLT_MAX, FLT_MAX); }

// Of all of a sample that is whole, else of the first of it, in whose order there is none.
template <class Of>
double quantile(const List<Cells::Sampled>& sample, double q, Of&& of) noexcept {
  double some[whole_sample];
  const std::size_t n = std::min(sample.size(), whole_sample);
  for (std::size_t i = 0; i < n; ++i) some[i] = of(sample[i]);
  const auto at = static_cast<std::size_t>(q * static_cast<double>(n - 1));
  std::nth_element(some, some + at, some + n);
  return some[at];
}

// How likely two of the sample begin in the same of cells that are so long. Sorts it.
double together(List<Cells::Sampled>& sample, double length) noexcept {
  for (Cells::Sampled& s : sample) {
    s.cell = 0;
    for (const float lower : s.lower) {
      const auto place = std::bit_cast<std::uint64_t>(std::floor(lower / length) + 0.0);
      s.cell = (s.cell ^ place) * 0x9e3779b97f4a7c15u;
      s.cell ^= s.cell >> 29;
    }
  }
  std::sort(sample.begin(), sample.end(),
            [](const Cells::Sampled& x, const Cells::Sampled& y) { return x.cell < y.cell; });
  double twos = 0;
  for (std::size_t i = 0, same = 0; i + 1 < sample.size(); ++i) {
    same = sample[i].cell == sample[i + 1].cell ? same + 1 : 0;
    twos += static_cast<double>(same);
  }
  const auto n = static_cast<double>(sample.size());
  return sample.size() < 2 ? 0 : 2 * twos / (n * (n - 1));
}

struct Scale {
  double span;      // of the first class
  double crowding;  // boxes in the cell of a box, of two spans
  Cells::Extent extent[3];
};

// Equal boxes shall fit into the first class, and smaller ones shall share its cells until the cell
// of a box holds about one other: large boxes look into fewer then. Where boxes lie together in an
// empty world that is less than the world has room for.
Scale measure(List<Cells::Sampled>& sample, std::size_t boxes) noexcept {
  if (sample.empty()) return {1, 0, {{0, 1}, {0, 1}, {0, 1}}};
  const auto side_of = [](const Cells::Sampled& s) { return s.side; };
  const double side = quantile(sample, 0.25, side_of) * 1.07;
  const double usual = quantile(sample, 0.5, side_of);
  const auto count = static_cast<double>(boxes);
  Scale scale;
  double volume = 1;
  for (int k = 0; k < 3; ++k) {
    const auto lower = [k](const Cells::Sampled& s) { return double{s.lower[k]}; };
    const double begin = quantile(sample, 0.05, lower);
    const double range = quantile(sample, 0.95, lower) - begin;
    const double length = std::max(std::max(range / 0.9, usual), 1e-30);
    scale.extent[k] = {begin - 0.05 * length, length};
    volume *= length;
  }
  scale.span = std::max(side, 0.5 * std::cbrt(volume / count));
  scale.crowding = count * together(sample, 2 * scale.span);
  for (int k = 0; k < most_halvings && scale.crowding > crowded && scale.span > side; ++k) {
    scale.span = std::max(side, 0.5 * scale.span);
    scale.crowding = count * together(sample, 2 * scale.span);
  }
  return scale;
}

}  // namespace

void Cells::plan(const Objects& objects) {
  const std::size_t count = objects.count();
  const std::size_t limit = objects.limit();
  const std::size_t wanted =
      limit <= whole_sample ? limit : std::clamp(limit / 8, least_sample, most_sample);
  sample_.renew(wanted);
  std::size_t thin = 0;
  for (std::uint32_t i = 0; i < wanted; ++i) {
    // By the golden section: evenly, but in no steps of one length, as ids may have a rhythm. None
    // twice where there are three as many.
    const std::uint32_t part = i * 0x9e3779b9u;
    const std::uint64_t at = wanted == limit ? i : std::uint64_t{part} * limit >> 32;
    const auto id = static_cast<ObjectId>(at);
    if (!objects.is_active(id)) continue;
    const Box b = objects.grown(id);
    const float lower[3] = {finite(b.lower.x), finite(b.lower.y), finite(b.lower.z)};
    const float upper[3] = {finite(b.upper.x), finite(b.upper.y), finite(b.upper.z)};
    double side = 0, thickness = DBL_MAX;
    for (int k = 0; k < 3; ++k) {
      const double extent = double{upper[k]} - double{lower[k]};
      side = std::max(side, extent);
      thickness = std::min(thickness, extent);
    }
    if (thickness < side / (1 << thinner)) {
      side /= 1 << thinner;
      ++thin;
    }
    sample_.push({side, {lower[0], lower[1], lower[2]}, 0});
  }
  thin_ = thin > sample_.size() / 2;
  const Scale scale = measure(sample_, std::max<std::size_t>(count, 1));
  const std::size_t most = count + count / 4 + 64;
  scale_ = static_cast<float>(std::clamp((1 << span_bits) / scale.span, 1e-30, 1e30));
  // 27 cells of one or two boxes rather than 8 of many, which would lie in long chains.
  cell_bits_ = scale.crowding > crowded ? 4 : 5;
  const std::size_t homes = lay_out(scale.extent, count);
  most_objects_ = 0;
  lines_.renew(lines_for(homes, most));
  most_objects_ = most;
  free_ = 0;
  for (auto& counts : class_count_) std::fill(counts, counts + classes + 1, 0);
  std::fill(used_, used_ + thin_sets, 0);
  for (auto& spans : span_) std::fill(spans, spans + 3, 0);
  lines_.resize(homes + 1);
  std::fill(lines_.begin(), lines_.end(), empty_line);
}

// Cells row by row where there are no more than two a box, else about one home a box. One to two
// boxes a cell: most of them then lie in its own line, and the lines in the cache.
std::size_t Cells::lay_out(const Extent (&extent)[3], std::size_t count) noexcept {
  const auto limit = static_cast<double>(std::clamp<std::size_t>(count, 64, most_homes));
  double cells[3], all = 1;
  for (int k = 0; k < 3; ++k) {
    cells[k] = std::floor(units(extent[k].length) / (1 << cell_bits_)) + 2;
    all *= cells[k];
  }
  const bool full = all <= 2 * limit;
  homes_ = static_cast<std::uint32_t>(std::max(full ? all : 1.4 * limit, limit / 2));
  std::uint32_t stride = 1;
  for (int k = 0; k < 3; ++k) {
    Axis& axis = axis_[k];
    axis.period = full ? static_cast<std::uint32_t>(cells[k]) : k == 0 ? homes_ : 0;
    axis.stride = stride;
    axis.lift = static_cast<std::uint32_t>(k) << 30;  // of a hashed one only to tell y from z
    if (axis.period == 0) continue;
    stride *= axis.period;
    const double most = most_units;
    axis.origin = static_cast<std::int32_t>(std::clamp(units(extent[k].begin), -most, most)) -
                  (1 << cell_bits_);
    axis.lift = ((1u << 26) / axis.period + 1) * axis.period;
  }
  return homes_;
}

Cells::Place Cells::place(const Box& box, Worlds worlds) const noexcept {
  const Range r = quantise(box);
  const int c = class_of(r);
  Place p{wide_home(), c, lines_of(r, c, worlds)};
  if (c == classes) return p;
  p.home = first_part(c, worlds.own);
  for (int k = 0; k < 3; ++k)
    p.home = sum(p.home, cursor(r.lower[k] >> (cell_bits_ + level(c, k)), c, k).part);
  return p;
}

void Cells::insert(ObjectId id, const Box& box, const Place& place) noexcept {
  count_class(place.size_class, 1);
  hold(box, place.size_class);
  Line& head = lines_[place.home];
  if (head.used == 2) {
    // The full line goes behind a fresh one.
    std::uint32_t moved = free_;
    if (moved != 0) {
      free_ = lines_[moved].next;
    } else {
      moved = static_cast<std::uint32_t>(lines_.size());
      lines_.resize(lines_.size() + 1);
    }
    lines_[moved] = head;
    head = empty_line;
    head.next = moved;
  }
  head.set(head.used, box);
  head.id[head.used++] = id;
}

void Cells::erase(ObjectId id, std::uint32_t home) noexcept {
  Line& head = lines_[home];
  for (std::uint32_t i = home;; i = lines_[i].next) {
    Line& line = lines_[i];
    const std::uint32_t k = line.id[0] == id ? 0 : 1;
    if (line.id[k] != id) continue;
    count_class(class_in(line, k), -1);
    const std::uint32_t last = --head.used;
    for (int c = 0; c < 6; ++c) {
      line.corner[c][k] = head.corner[c][last];
      head.corner[c][last] = nan;
    }
    line.id[k] = head.id[last];
    head.id[last] = none;
    break;
  }
  const std::uint32_t next = head.next;
  if (static_cast<int>(head.used != 0) | static_cast<int>(next == 0)) return;
  head = lines_[next];
  lines_[next] = empty_line;
  lines_[next].next = free_;
  free_ = next;
}

void Cells::replace(ObjectId id, const Box& box, const Place& place) noexcept {
  for (std::uint32_t i = place.home;; i = lines_[i].next) {
    Line& line = lines_[i];
    const std::uint32_t k = line.id[0] == id ? 0 : 1;
    if (line.id[k] != id) continue;
    if (const int c = class_in(line, k); c != place.size_class) {
      count_class(c, -1);
      count_class(place.size_class, 1);
    }
    hold(box, place.size_class);
    line.set(k, box);
    return;
  }
}

std::uint64_t Cells::exact_lines(const Range& range, Worlds worlds) const noexcept {
  if (worlds.all) return lines_.size();
  std::uint64_t count = class_count_[0][classes] / 2;
  each_class([&](int c) { count += lines_in(cells_of(range, c)) * (worlds.everywhere ? 2 : 1); });
  return std::min<std::uint64_t>(count, lines_.size());
}

void Cells::reach(const Box& box, Worlds worlds, Reach& reach) const noexcept {
  reach.count = Reach::most + 1;
  if (worlds.all) return;
  const Range range = quantise(box);
  const std::uint64_t most = std::min<std::uint64_t>(Reach::most, lines_.size());
  std::uint64_t left = most - std::min<std::uint64_t>(most, class_count_[0][classes] / 2);
  std::uint32_t* to = reach.homes;
  const auto list = [&to, all = lines_.data()](std::uint32_t home) {
    cpu::prefetch(all + home);
    *to++ = home;
  };
  each_class([&](int c) {
    const Range cells = cells_of(range, c);
    left -= std::min(left, lines_in(cells) * (worlds.everywhere ? 2 : 1));
    if (left == 0) return;
    each_home(cells, c, worlds.own, list);
    if (worlds.everywhere) each_home(cells, c, -1, list);
  });
  if (left == 0) return;
  if (class_count_[0][classes] != 0) list(wide_home());
  reach.count = static_cast<std::uint32_t>(to - reach.homes);
}

// Chains are put on the list and hits noted at no branch: nobody can guess where they are.
std::uint32_t Cells::search_few(const Box& box, ObjectId self, Reach& reach, ObjectId* hits,
                                std::uint64_t& compared) const noexcept {
  if (reach.count > Reach::most) return most_hits + 1;
  const cpu::PackedQuery query(box);
  const Line* const lines = lines_.data();
  std::uint32_t count = reach.count, hit_count = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    const Line& line = lines[reach.homes[k]];
    if (count < Reach::room) [[likely]] {
      reach.homes[count] = line.next;
      count += line.next != 0;
    } else if (line.next != 0) {
      return most_hits + 1;
    }
    const std::uint32_t hit = query.overlaps(line);
    hits[hit_count] = line.id[0];
    hit_count += hit & std::uint32_t{line.id[0] != self};
    hits[hit_count] = line.id[1];
    hit_count += hit >> 1 & std::uint32_t{line.id[1] != self};
  }
  compared += 2 * std::uint64_t{count};
  return hit_count;
}

void Cells::copy(const Cells& other) noexcept {
  lines_.copy(other.lines_);
  homes_ = other.homes_;
  std::copy(other.axis_, other.axis_ + 3, axis_);
  free_ = other.free_;
  most_objects_ = other.most_objects_;
  scale_ = other.scale_;
  cell_bits_ = other.cell_bits_;
  thin_ = other.thin_;
  std::memcpy(span_, other.span_, sizeof span_);
  for (int axes = 0; axes < thin_sets; ++axes) {
    std::copy(other.class_count_[axes], other.class_count_[axes] + classes + 1, class_count_[axes]);
    used_[axes] = other.used_[axes];
  }
}

}  // namespace throng::live
