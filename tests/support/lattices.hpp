// Lattices of touching boxes, to test exactness. Random boxes never meet face to face, so a rule
// that is wrong only on equality passes there; here nearly every pair is such a pair.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "support/random.hpp"

namespace throng::tests {

struct Lattice {
  int count[3] = {1, 1, 1};  // boxes along each axis
  float pitch[3] = {1, 1, 1};
  float origin[3] = {0, 0, 0};
  int span = 1;   // steps that each box covers: 1 touches, 2 and 3 overlap too
  int nudge = 0;  // each coordinate moves by up to this many ulps
  std::uint64_t seed = 1;

  std::string describe() const {
    char text[240];
    std::snprintf(text, sizeof text,
                  "%dx%dx%d pitch %a %a %a origin %a %a %a span %d nudge %d seed %llu", count[0],
                  count[1], count[2], static_cast<double>(pitch[0]), static_cast<double>(pitch[1]),
                  static_cast<double>(pitch[2]), static_cast<double>(origin[0]),
                  static_cast<double>(origin[1]), static_cast<double>(origin[2]), span, nudge,
                  static_cast<unsigned long long>(seed));
    return text;
  }
};

// Neighbours share the same float for their common face (unless nudged), however origin + i * pitch
// is rounded. In random order.
inline std::vector<Box> make_lattice(const Lattice& lattice) {
  Random random(lattice.seed);
  std::vector<float> edge[3];
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i <= lattice.count[axis] + lattice.span - 1; ++i)
      edge[axis].push_back(lattice.origin[axis] + static_cast<float>(i) * lattice.pitch[axis]);
  std::vector<Box> boxes;
  const auto moved = [&](float x) {
    return lattice.nudge == 0 ? x : nudge(x, random.between(-lattice.nudge, lattice.nudge));
  };
  for (int x = 0; x < lattice.count[0]; ++x)
    for (int y = 0; y < lattice.count[1]; ++y)
      for (int z = 0; z < lattice.count[2]; ++z) {
        const auto xs = static_cast<std::size_t>(x), ys = static_cast<std::size_t>(y),
                   zs = static_cast<std::size_t>(z), span = static_cast<std::size_t>(lattice.span);
        boxes.push_back(
            {{moved(edge[0][xs]), moved(edge[1][ys]), moved(edge[2][zs])},
             {moved(edge[0][xs + span]), moved(edge[1][ys + span]), moved(edge[2][zs + span])}});
      }
  shuffle(boxes, random);
  return boxes;
}

// A lattice of about `target` boxes drawn from `seed`: some or all axes one to three boxes wide;
// pitches equal or different, powers of two or not; at the origin, near it, or so far away that few
// bits of a pitch remain.
inline Lattice random_lattice(std::uint64_t seed, int target) {
  Random random(seed);
  Lattice lattice;
  lattice.seed = seed;
  lattice.nudge = random.between(0, 2);
  lattice.span = random.one_in(3) ? random.between(2, 3) : 1;
  const bool same_pitch = !random.one_in(4), round_pitch = random.one_in(3);
  const int exponent = random.between(-8, 8);
  for (int axis = 0; axis < 3; ++axis) {
    float& pitch = lattice.pitch[axis];
    if (axis > 0 && same_pitch) {
      pitch = lattice.pitch[0];
    } else {
      pitch =
          std::ldexp(round_pitch ? 1.0f : 1.0f + random.unit(), exponent + random.between(-2, 2));
    }
    switch (random.below(5)) {
      case 0:
        lattice.origin[axis] = 0;
        break;
      case 1:
        lattice.origin[axis] = -pitch * static_cast<float>(random.between(1, 40));
        break;
      case 2:
        lattice.origin[axis] = pitch * random.in(-100, 100);
        break;
      case 3:
        lattice.origin[axis] = pitch * random.in(-3, 3);
        break;
      default:
        lattice.origin[axis] = pitch * random.in(-0x1p16f, 0x1p16f);
        break;
    }
  }
  // Some axes are one to three boxes wide; the last of the others takes the remaining count.
  const int narrow = random.between(0, 2), first = random.between(0, 2);
  int left = target;
  for (int step = 0; step < 3; ++step) {
    int& count = lattice.count[(first + step) % 3];
    if (step < narrow)
      count = random.between(1, 3);
    else if (step == 2)
      count = left;
    else if (step == 1 && narrow == 1)
      count = random.between(2, 20);
    else
      count = random.between(4, 15);
    left = left / count > 1 ? left / count : 1;
  }
  return lattice;
}

// Floats mapped to integers in order, so that a difference is a number of ulps; -0 and 0 are equal.
inline std::int64_t ordinal(float x) {
  std::int32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits >= 0 ? bits : -static_cast<std::int64_t>(bits & 0x7fffffff);
}

// Whether they meet face to face on some axis, within four ulps.
inline bool touching(const Box& a, const Box& b) {
  const auto near = [](float p, float q) {
    const std::int64_t d = ordinal(p) - ordinal(q);
    return -4 <= d && d <= 4;
  };
  return near(a.lower.x, b.upper.x) || near(a.upper.x, b.lower.x) || near(a.lower.y, b.upper.y) ||
         near(a.upper.y, b.lower.y) || near(a.lower.z, b.upper.z) || near(a.upper.z, b.lower.z);
}

}  // namespace throng::tests
