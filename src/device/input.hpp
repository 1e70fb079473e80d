// The input of a search in plain pointers, read alike by host and device threads.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <throng/boxes.hpp>
#include <throng/cuda.hpp>

#include "base/bounds.hpp"
#include "base/host_device_macros.hpp"
#include "base/size_class_grid.hpp"
#include "base/strided_array.hpp"

namespace throng::device {

using base::StridedArray;

// Loads a box that is aligned to 8 bytes: two loads, one of them aligned to 16 bytes, in place of
// six. For scattered boxes the number of loads is what counts.
THRONG_HD inline Box load_box(const Box* box) noexcept {
#if defined(__CUDA_ARCH__)
  const auto* at = reinterpret_cast<const char*>(box);
  const bool first = reinterpret_cast<std::uintptr_t>(at) % 16 == 0;
  const float4 four = *reinterpret_cast<const float4*>(first ? at : at + 8);
  const float2 two = *reinterpret_cast<const float2*>(first ? at + 16 : at);
  return first ? Box{{four.x, four.y, four.z}, {four.w, two.x, two.y}}
               : Box{{two.x, two.y, four.x}, {four.y, four.z, four.w}};
#else
  return *box;
#endif
}

// One set of boxes and its filters.
struct Set {
  const char* corner[6] = {};
  std::uint64_t stride = 0;
  bool packed = false;  // each box's coordinates are contiguous and aligned to 8 bytes
  StridedArray<std::uint32_t> group, mask;
  StridedArray<std::int32_t> owner, world;
  StridedArray<std::uint8_t> is_static;

  THRONG_HD float coordinate(std::uint64_t i, int k) const noexcept {
    return corner[k] ? *reinterpret_cast<const float*>(corner[k] + i * stride) : 0.0f;
  }
  THRONG_HD Box packed_box(std::uint64_t i) const noexcept {
    return load_box(reinterpret_cast<const Box*>(corner[0] + i * stride));
  }
  THRONG_HD Box box(std::uint64_t i) const noexcept {
    if (packed) return packed_box(i);
    return {{coordinate(i, 0), coordinate(i, 1), coordinate(i, 2)},
            {coordinate(i, 3), coordinate(i, 4), coordinate(i, 5)}};
  }
};

// One set or two. Indices of the second set follow those of the first.
struct Input {
  Set sets[2];
  std::uint32_t first_count = 0, count = 0;
  float margin = 0;
  float cell_scale = 1;
  bool two_sets = false;
  bool has_worlds = false, has_pair_filters = false, has_filters = false;
  std::uint32_t present = 0;  // group bits that occur
  // Boxes other than these will query the grid, so it is always built.
  bool has_external_queries = false;
  // Small worlds are not searched one by one.
  bool grid_only = false;
  // In the memory of the device that runs it; 0: no grid is needed. Null: a grid is needed.
  const std::uint32_t* grid_wanted = nullptr;

  // Whether each group and class has the bounds of its boxes, so that a search skips distant ones.
  // Without groups the bounds would contain nearly every box that searches.
  THRONG_HD bool bounds_occupied() const noexcept { return has_external_queries || present != 0; }
  THRONG_HD bool wants_grid() const noexcept { return !grid_wanted || *grid_wanted != 0; }
  THRONG_HD bool in_second(std::uint32_t i) const noexcept { return i >= first_count; }
  THRONG_HD const Set& set_of(std::uint32_t i) const noexcept { return sets[in_second(i)]; }
  // A box's index in its own set.
  THRONG_HD std::uint32_t local(std::uint32_t i) const noexcept {
    return in_second(i) ? i - first_count : i;
  }
  // A world below -1 is an error, which is reported elsewhere; here it counts as -1.
  THRONG_HD std::int32_t world(std::uint32_t i) const noexcept {
    const Set& s = set_of(i);
    const std::int32_t world = s.world ? s.world[local(i)] : -1;
    return world < 0 ? -1 : world;
  }
  THRONG_HD std::uint32_t group_bits(std::uint32_t i) const noexcept {
    const Set& s = set_of(i);
    std::uint32_t bits = two_sets && in_second(i) ? base::second_bit : 0;
    if (s.is_static && s.is_static[local(i)]) bits |= base::static_bit;
    if (has_worlds && world(i) < 0) bits |= base::everywhere_bit;
    return bits;
  }
  // Whether all filters allow the pair. With two sets, i and j are of different sets.
  THRONG_HD bool allowed(std::uint32_t i, std::uint32_t j) const noexcept {
    if (!has_filters) return true;
    const Set &a = set_of(i), &b = set_of(j);
    const std::uint32_t p = local(i), q = local(j);
    if (has_worlds) {
      const std::int32_t v = a.world ? a.world[p] : -1, w = b.world ? b.world[q] : -1;
      if (v != w && v >= 0 && w >= 0) return false;
    }
    if (a.is_static && b.is_static && a.is_static[p] && b.is_static[q]) return false;
    if (!has_pair_filters) return true;
    if (a.owner && b.owner && a.owner[p] != -1 && a.owner[p] == b.owner[q]) return false;
    const std::uint32_t ga = a.group ? a.group[p] : ~0u, ma = a.mask ? a.mask[p] : ~0u;
    const std::uint32_t gb = b.group ? b.group[q] : ~0u, mb = b.mask ? b.mask[q] : ~0u;
    return (ga & mb) != 0 && (gb & ma) != 0;
  }
  THRONG_HD Pair pair(std::uint32_t i, std::uint32_t j) const noexcept {
    if (two_sets) return in_second(i) ? Pair{j, local(i)} : Pair{i, local(j)};
    return i < j ? Pair{i, j} : Pair{j, i};
  }
};

// The view may lie in device memory, so nothing is dereferenced here.
inline Set make_set(const Boxes& boxes) noexcept {
  Set s;
  for (int k = 0; k < 6; ++k) s.corner[k] = boxes.corner_data(k);
  s.stride = boxes.stride_bytes();
  const auto at = reinterpret_cast<std::uintptr_t>(boxes.packed_data());
  s.packed = at != 0 && at % 8 == 0 && s.stride % 8 == 0;
  const Filters& f = boxes.filters;
  s.group = base::strided_array(f.group);
  s.mask = base::strided_array(f.mask);
  s.owner = base::strided_array(f.owner);
  s.world = base::strided_array(f.world);
  s.is_static = base::strided_array(f.is_static);
  return s;
}

inline Input make_input(const Boxes& a, const Boxes* b, const Options& options) noexcept {
  Input in;
  in.sets[0] = make_set(a);
  in.first_count = static_cast<std::uint32_t>(a.size());
  in.count = static_cast<std::uint32_t>(a.size() + (b ? b->size() : 0));
  in.two_sets = b != nullptr;
  if (b) in.sets[1] = make_set(*b);
  in.margin = options.margin;
  in.cell_scale = options.cell_scale;
  for (const Set& s : in.sets) {
    in.has_worlds |= bool(s.world);
    in.has_pair_filters |= s.group || s.mask || s.owner;
    if (s.is_static) in.present |= base::static_bit;
  }
  in.has_filters = in.has_worlds || in.has_pair_filters || in.present;
  if (in.has_worlds) in.present |= base::everywhere_bit;
  if (in.two_sets) in.present |= base::second_bit;
  return in;
}

// A box as it is stored and compared: expanded by the margin, with its index. 32 bytes: one sector
// of device memory.
struct alignas(32) Record {
  Vec3 lower;
  std::uint32_t id;
  Vec3 upper;
  std::uint32_t unused;

  THRONG_HD Box box() const noexcept { return {lower, upper}; }
};

// Two loads of 16 bytes through the read-only cache; the records are not written meanwhile.
THRONG_HD inline Record load(const Record* at) noexcept {
#if defined(__CUDA_ARCH__)
  const float4 a = __ldg(reinterpret_cast<const float4*>(at));
  const float4 b = __ldg(reinterpret_cast<const float4*>(at) + 1);
  return {{a.x, a.y, a.z}, __float_as_uint(a.w), {b.x, b.y, b.z}, __float_as_uint(b.w)};
#else
  return *at;
#endif
}

// One store of 16 bytes: the lower corner with the index, or the upper corner.
THRONG_HD inline void store_half(Record* to, bool upper, const Record& r) noexcept {
#if defined(__CUDA_ARCH__)
  reinterpret_cast<float4*>(to)[upper] =
      upper ? float4{r.upper.x, r.upper.y, r.upper.z, 0.0f}
            : float4{r.lower.x, r.lower.y, r.lower.z, __uint_as_float(r.id)};
#else
  if (upper) {
    to->upper = r.upper;
  } else {
    to->lower = r.lower;
    to->id = r.id;
  }
#endif
}

// One flag per group and class. If in.bounds_occupied(), the bounds of each one's boxes follow: six
// integers that sort as the floats do and are above 0, lower ends negated, so that all are maxima.
constexpr std::uint32_t occupied_flags = 8 * base::max_size_classes;
constexpr std::uint32_t occupied_words = 7 * occupied_flags;

THRONG_HD inline std::uint32_t in_order(float x) noexcept {
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return bits >> 31 ? ~bits : bits | 1u << 31;
}
THRONG_HD inline float float_in_order(std::uint32_t number) noexcept {
  return std::bit_cast<float>(number >> 31 ? number & ~(1u << 31) : ~number);
}
// The bounds of a group and class that has boxes.
THRONG_HD inline Box occupied_bounds(const std::uint32_t* occupied,
                                     std::uint32_t class_index) noexcept {
  const std::uint32_t* const most = occupied + occupied_flags + 6 * class_index;
  return {{-float_in_order(most[0]), -float_in_order(most[1]), -float_in_order(most[2])},
          {float_in_order(most[3]), float_in_order(most[4]), float_in_order(most[5])}};
}

// A search's report, in the memory of the device that runs it.
using cuda::Report;

}  // namespace throng::device
