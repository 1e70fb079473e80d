#include "support/cases.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace throng::tests {

bool Set::has_nan() const {
  for (const Box& box : boxes)
    for (int k = 0; k < 6; ++k)
      if (std::isnan((&box.lower.x)[k])) return true;
  return false;
}

void Set::add(const Box& box, std::uint32_t labels) {
  boxes.push_back(box);
  group.push_back(1u << (labels & 3));
  mask.push_back(labels | (labels & 64 ? 0xfu : 0));
  owner.push_back(static_cast<std::int32_t>(labels >> 2 & 7) - 1);
  world.push_back(static_cast<std::int32_t>(labels >> 3 & 3) - 1);
  is_static.push_back(labels >> 5 & 1);
}

void Set::append(const Set& other, std::size_t i) {
  boxes.push_back(other.boxes[i]);
  group.push_back(other.group[i]);
  mask.push_back(other.mask[i]);
  owner.push_back(other.owner[i]);
  world.push_back(other.world[i]);
  is_static.push_back(other.is_static[i]);
}

void Set::erase(std::size_t begin, std::size_t end) {
  const auto cut = [&](auto& v) {
    v.erase(v.begin() + static_cast<std::ptrdiff_t>(begin),
            v.begin() + static_cast<std::ptrdiff_t>(end));
  };
  cut(boxes), cut(group), cut(mask), cut(owner), cut(world), cut(is_static);
}

Boxes Set::view(unsigned filters) const {
  Boxes v = boxes;
  const std::size_t n = boxes.size();
  if (n == 0) return v;
  if (filters & with_group) v.filters.group = {group.data(), n};
  if (filters & with_mask) v.filters.mask = {mask.data(), n};
  if (filters & with_owner) v.filters.owner = {owner.data(), n};
  if (filters & with_world) v.filters.world = {world.data(), n};
  if (filters & with_static) v.filters.is_static = {is_static.data(), n};
  return v;
}

namespace {

// A third of the coordinates repeat an earlier one, exactly or within two ulps.
float any_coordinate(Bytes& bytes, std::vector<float>& seen) {
  const std::uint32_t kind = bytes.next();
  float x;
  if (kind % 3 == 0 && !seen.empty()) {
    x = nudge(seen[bytes.next() % seen.size()], static_cast<int>(kind / 3 % 5) - 2);
  } else if (kind % 3 == 1) {
    x = static_cast<float>(static_cast<int>(bytes.next()) - 128) * ((kind & 16) ? 0.1f : 1.0f);
  } else {
    const std::uint32_t bits = bytes.word();
    std::memcpy(&x, &bits, sizeof x);
  }
  seen.push_back(x);
  return x;
}

float special_coordinate(Bytes& bytes) {
  constexpr float values[] = {
      -infinity, -float_max, -0x1.fffffep126f, -1.0f, -0x1p-126f,  -denormal, -0.0f,      0.0f,
      denormal,  0x1p-126f,  0x1p-24f,         1.0f,  16777216.0f, float_max, 0x1.8p127f, infinity};
  return values[bytes.next() % 16];
}

Box sorted(const float (&c)[6]) {
  Box box{{c[0], c[1], c[2]}, {c[3], c[4], c[5]}};
  for (int k = 0; k < 3; ++k)
    if (c[k] > c[k + 3]) std::swap((&box.lower.x)[k], (&box.upper.x)[k]);
  return box;
}

using Maker = BoxList (*)(Bytes&, std::size_t);

// Six numbers per box, straight from the bytes; sometimes the same box repeated along x.
BoxList free_boxes(Bytes& bytes, std::size_t n) {
  BoxList boxes;
  std::vector<float> seen;
  const bool rows = bytes.one_in(4), unsorted = bytes.one_in(8);
  while (!bytes.empty() && boxes.size() < n) {
    float c[6];
    for (float& x : c) x = any_coordinate(bytes, seen);
    const Box box = unsorted ? Box{{c[0], c[1], c[2]}, {c[3], c[4], c[5]}} : sorted(c);
    for (int r = 0; r < (rows ? 24 : 1) && boxes.size() < n; ++r) {
      boxes.push_back(box);
      boxes.back().lower.x += static_cast<float>(r);
      boxes.back().upper.x += static_cast<float>(r);
    }
  }
  return boxes;
}

BoxList special_boxes(Bytes& bytes, std::size_t n) {
  BoxList boxes;
  while (!bytes.empty() && boxes.size() < n) {
    float c[6];
    for (float& x : c) x = special_coordinate(bytes);
    boxes.push_back(sorted(c));
  }
  return boxes;
}

BoxList lattice_boxes(Bytes& bytes, std::size_t n) {
  return make_lattice(random_lattice(bytes.word(), static_cast<int>(n)));
}

// Cells of nested grids whose pitches differ by powers of two: each face is a cell boundary on
// every finer level, so boxes of all size classes touch. Moved by up to two ulps.
BoxList octree_boxes(Bytes& bytes, std::size_t n) {
  Random random(bytes.word());
  const int levels = 1 + bytes.between(1, 12), deepest = bytes.between(-12, 4);
  const int ulps = bytes.between(0, 2);
  const float side = std::ldexp(1.0f, levels + deepest);
  BoxList boxes;
  for (std::size_t i = 0; i < n; ++i) {
    // Favours small boxes: the minimum of two draws.
    const int level = std::min(random.between(0, levels), random.between(0, levels));
    const float pitch = std::ldexp(1.0f, level + deepest);
    const int cells = 1 << std::min(levels - level, 4);
    const int slim = random.one_in(4) ? random.between(0, 2) : 3;
    float c[6];
    for (int k = 0; k < 3; ++k) {
      const int at = random.between(0, cells - 1);
      c[k] = static_cast<float>(at) * pitch - (random.one_in(8) ? side : 0);
      c[k + 3] = c[k] + (k == slim ? side : pitch);
    }
    for (float& x : c)
      if (ulps) x = nudge(x, random.between(-ulps, ulps));
    boxes.push_back(sorted(c));
  }
  return boxes;
}

// Each box is placed at a face, an edge or a corner of an earlier one, exactly or off by up to two
// ulps; sizes from half to twice, or a thousand times.
BoxList adjacent_boxes(Bytes& bytes, std::size_t n) {
  Random random(bytes.word());
  const float start = bytes.one_in(3) ? random.in(-1e6f, 1e6f) : random.in(-2, 2);
  const float unit = std::ldexp(1.0f + random.unit(), bytes.between(-20, 20));
  const std::uint32_t apart = 2 + bytes.next();
  BoxList boxes = {cube(start, start, start, unit)};
  while (boxes.size() < n) {
    const Box& old = boxes[random.below(static_cast<std::uint32_t>(boxes.size()))];
    float c[6];
    for (int k = 0; k < 3; ++k) {
      const float low = (&old.lower.x)[k], high = (&old.upper.x)[k];
      const float size =
          unit * (random.one_in(apart) ? random.magnitude(-10, 10) : random.in(0.5f, 2));
      const int off = random.between(-2, 2);
      switch (random.below(4)) {
        case 0:  // above
          c[k] = nudge(high, off);
          c[k + 3] = c[k] + size;
          break;
        case 1:  // below
          c[k + 3] = nudge(low, off);
          c[k] = c[k + 3] - size;
          break;
        case 2:  // flush
          c[k] = low;
          c[k + 3] = random.one_in(2) ? high : low + size;
          break;
        default:
          c[k] = low + size * random.in(-1, 1);
          c[k + 3] = c[k] + size;
          break;
      }
    }
    boxes.push_back(sorted(c));
  }
  return boxes;
}

// Like most scenes: boxes in a volume, a plane or clumps, of one size or many; few overlap.
BoxList scattered_boxes(Bytes& bytes, std::size_t n) {
  Random random(bytes.word());
  const std::uint32_t kind = bytes.next();
  const int spread = kind & 1 ? 0 : bytes.between(1, 8), flat = kind & 2 ? 2 : 3;
  const bool clumps = (kind & 12) == 12;
  // From a dense heap to a tenth of a pair per box.
  const float apart = std::ldexp(1.0f, bytes.between(-1, 1));
  const float side = apart * (flat == 3 ? std::cbrt(static_cast<float>(n)) * 0.75f
                                        : std::sqrt(static_cast<float>(n)));
  Vec3 middle = random.point(0, side);
  BoxList boxes;
  while (boxes.size() < n) {
    if (clumps && random.one_in(50)) middle = random.point(-20 * side, 20 * side);
    Vec3 at = random.point(-side, side);
    if (kind & 16)
      at = {std::floor(at.x * 4) * 0.25f, std::floor(at.y), std::floor(at.z * 2) * 0.5f};
    Box box = cube(clumps ? middle.x + at.x * 0.25f : at.x, clumps ? middle.y + at.y * 0.25f : at.y,
                   flat == 3 ? at.z : 0.0f, 1);
    if (spread)
      for (int k = 0; k < 3; ++k)
        (&box.upper.x)[k] =
            (&box.lower.x)[k] + std::ldexp(1.0f + random.unit(), -random.between(0, spread));
    boxes.push_back(box);
  }
  return boxes;
}

// One of the named scenes of the tests.
BoxList known_boxes(Bytes& bytes, std::size_t n) {
  const std::uint32_t which = bytes.next();
  const std::uint64_t seed = bytes.word();
  const int count = static_cast<int>(n);
  constexpr BoxList (*makers[])(int, std::uint64_t) = {uniform_boxes,
                                                       huge_among_small,
                                                       far_from_origin,
                                                       denormal_boxes,
                                                       infinite_bounds,
                                                       near_overflow,
                                                       with_inverted,
                                                       points,
                                                       sizes_to_10000,
                                                       rods,
                                                       sheets,
                                                       one_cell,
                                                       clusters_and_outliers,
                                                       faces_edges_corners};
  constexpr std::size_t maker_count = sizeof makers / sizeof *makers;
  if (which % 20 < maker_count) return makers[which % 20](count, seed);
  switch (which % 20) {
    case 14:
      return snapped_boxes(count, 4 + static_cast<int>(n / 8), 0.1f, seed);
    case 15:
      return line_of_boxes(count, static_cast<int>(seed % 4), seed);
    case 16:
      return identical_boxes(std::min(count, 64), seed);
    case 17:
      return nested_boxes(std::min(count, 64), seed);
    case 18:
      return signed_zeros(std::min(count, 200), seed);
    default:
      return many_huge(std::min(count, 200), seed);
  }
}

struct Shape {
  const char* name;
  Maker make;
};
constexpr Shape shapes[] = {
    {"free", free_boxes},           {"lattice", lattice_boxes},     {"octree", octree_boxes},
    {"adjacent", adjacent_boxes},   {"known", known_boxes},         {"special", special_boxes},
    {"lattice", lattice_boxes},     {"scattered", scattered_boxes}, {"scattered", scattered_boxes},
    {"scattered", scattered_boxes},
};
constexpr std::size_t shape_count = sizeof shapes / sizeof *shapes;

// Makes one box a special case.
Box special_case(Bytes& bytes, Box box) {
  float* c = &box.lower.x;
  const std::uint32_t kind = bytes.next(), k = bytes.next() % 3;
  switch (kind % 8) {
    case 0:  // a half space
      c[k] = -infinity;
      break;
    case 1:  // a plane
      for (std::uint32_t j = 0; j < 3; ++j)
        if (j != k) c[j] = -infinity, c[j + 3] = infinity;
      break;
    case 2:  // everything
      return {{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
    case 3:  // inverted by an ulp
      c[k] = nudge(c[k + 3], 1);
      break;
    case 4:  // a point
      return {box.lower, box.lower};
    case 5:  // huge
      c[k] = -1e30f, c[k + 3] = 1e30f;
      break;
    case 6:
      c[k + 3 * (kind >> 7)] = std::numeric_limits<float>::quiet_NaN();
      break;
    default:
      c[k] = c[k] == 0 ? -c[k] : c[k + 3];  // negated zero, or zero extent
      break;
  }
  return box;
}

}  // namespace

Case make_case(Bytes& bytes, std::size_t most) {
  Case c;
  const Shape& shape = shapes[bytes.next() % shape_count];
  const std::uint32_t flags = bytes.next(), filters = bytes.next(), size = bytes.word();
  c.shape = shape.name;
  c.two_sets = flags % 4 == 1;
  c.nan = flags & 4 ? NanPolicy::refuse : NanPolicy::inactive;
  // Mostly some filters, sometimes different ones on the two sets; none in a quarter of the cases.
  c.filters_a = flags & 24 ? filters & all_filters : 0;
  c.filters_b = flags & 32 ? c.filters_a : (c.filters_a ^ filters >> 5) & all_filters;
  constexpr float margins[] = {0, 0, 0, 0, 0, 0.1f, 1.0f, denormal};
  constexpr float scales[] = {1, 1, 1, 1, 1, 1, 0.125f, 8.0f};
  const std::uint32_t options = bytes.next();
  c.margin = margins[options & 7];
  c.cell_scale = scales[options >> 3 & 7];
  const std::uint32_t worlds = 1 + bytes.next() % 7;
  const std::uint64_t label_seed = bytes.word();
  const std::size_t special_count = bytes.next() % 16;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> rarities;
  const std::size_t n = 2 + (size >> 8) % ((size & 3) ? most / 4 : most - 1);
  BoxList boxes = shape.make(bytes, n);
  if (boxes.size() > most) boxes.resize(most);
  for (std::size_t r = 0; r + 12 < special_count && !boxes.empty(); ++r) {
    Box& box = boxes[bytes.word() % boxes.size()];
    box = special_case(bytes, box);
  }
  Random random(label_seed);
  // Sometimes the same boxes in several worlds.
  const std::size_t copies = (options >> 6) == 3 ? worlds : 1;
  if (copies > 1) c.filters_a |= with_world, c.filters_b |= with_world;
  const std::size_t kept = std::max<std::size_t>(boxes.size() / copies, 1);
  for (std::size_t w = 0; w < copies; ++w)
    for (std::size_t i = 0; i < boxes.size() && i < kept; ++i) {
      Set& set = c.two_sets && random.one_in(3) ? c.b : c.a;
      set.add(boxes[i], static_cast<std::uint32_t>(random.next() >> 40));
      if (copies > 1) set.world.back() = random.one_in(16) ? -1 : static_cast<std::int32_t>(w);
    }
  return c;
}

bool has_close_pair(const Case& c) {
  const BoxList& left = c.a.boxes;
  const BoxList& right = c.two_sets ? c.b.boxes : c.a.boxes;
  const auto close = [](const Box& a, const Box& b) {
    bool some = false;
    for (int k = 0; k < 3; ++k) {
      const float al = (&a.lower.x)[k], au = (&a.upper.x)[k];
      const float bl = (&b.lower.x)[k], bu = (&b.upper.x)[k];
      if (!(al <= au && bl <= bu)) return false;
      const std::int64_t above = ordinal(bl) - ordinal(au), below = ordinal(al) - ordinal(bu);
      if (above > 2 || below > 2) return false;
      some = some || above >= -2 || below >= -2;
    }
    return some;
  };
  for (std::size_t i = 0; i < left.size(); ++i)
    for (std::size_t j = c.two_sets ? 0 : i + 1; j < right.size(); ++j)
      if (close(left[i], right[j])) return true;
  return false;
}

}  // namespace throng::tests
