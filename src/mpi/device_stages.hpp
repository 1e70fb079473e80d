// Kernels of a search across ranks with boxes in device memory, as function objects. No MPI, no
// CUDA: they also run on the host.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <throng/checksum.hpp>
#include <throng/types.hpp>

#include "base/bounds.hpp"
#include "base/host_device_macros.hpp"
#include "device/atomic.hpp"
#include "device/input.hpp"
#include "mpi/bisect.hpp"
#include "mpi/record.hpp"
#include "mpi/regions.hpp"

namespace throng::mpi {

// The number of threads of a kernel that computes sums: each thread adds up its part first.
constexpr std::uint64_t summing_threads = std::uint64_t{1} << 16;

// The records of a set as 4-byte words; an 8-byte id is only 4-byte aligned.
struct Records {
  std::uint32_t* data = nullptr;
  std::uint64_t count = 0;
  std::uint32_t words = 8;  // per record
  unsigned filters = 0;

  THRONG_HD std::uint64_t id(std::uint64_t i) const noexcept {
    const std::uint32_t* p = data + i * words + 6;
    return p[0] | std::uint64_t{p[1]} << 32;
  }
  // Writes box i of the caller's set as record `at`.
  THRONG_HD void write(std::uint64_t at, const device::Set& set, std::uint64_t i,
                       std::uint64_t id) const noexcept {
    std::uint32_t* p = data + at * words;
    for (int k = 0; k < 6; ++k) *p++ = std::bit_cast<std::uint32_t>(set.coordinate(i, k));
    *p++ = static_cast<std::uint32_t>(id);
    *p++ = static_cast<std::uint32_t>(id >> 32);
    if (filters & has_group) *p++ = set.group ? set.group[i] : ~0u;
    if (filters & has_mask) *p++ = set.mask ? set.mask[i] : ~0u;
    if (filters & has_owner) *p++ = set.owner ? static_cast<std::uint32_t>(set.owner[i]) : ~0u;
    if (filters & has_world) *p++ = set.world ? static_cast<std::uint32_t>(set.world[i]) : ~0u;
    if (filters & has_static) *p++ = static_word(set.is_static && set.is_static[i]);
  }
  // A view of the boxes and filters, in place.
  Boxes view() const noexcept {
    const std::size_t n = count, stride = std::size_t{words} * sizeof(std::uint32_t);
    Boxes boxes(reinterpret_cast<const Box*>(data), n, stride);
    const std::uint32_t* p = data + 8;
    const auto column = [&](auto& filter, unsigned bit) {
      using Column = std::remove_reference_t<decltype(filter)>;
      using T = std::remove_cvref_t<decltype(filter[0])>;
      if (filters & bit) filter = Column{reinterpret_cast<const T*>(p++), n, stride};
    };
    column(boxes.filters.group, has_group);
    column(boxes.filters.mask, has_mask);
    column(boxes.filters.owner, has_owner);
    column(boxes.filters.world, has_world);
    column(boxes.filters.is_static, has_static);
    return boxes;
  }
};

// Properties of the caller's arrays. Initially all zero; a mark is ~ of the first index.
struct BoxInspection {
  std::uint64_t inactive, nans, bad_worlds, id_sum;
  std::uint32_t nan_mark, bad_world_mark;
};
struct InspectBoxes {
  device::Set set;
  const std::uint64_t* ids;  // null: none
  std::uint64_t count, threads;
  BoxInspection* inspection;

  THRONG_HD void operator()(std::uint64_t thread) const noexcept {
    BoxInspection mine{};
    for (std::uint64_t i = thread; i < count; i += threads) {
      const auto mark = ~static_cast<std::uint32_t>(i);
      const Box box = set.box(i);
      mine.inactive += !base::is_active(box);
      if (base::has_nan(box) && mine.nans++ == 0) mine.nan_mark = mark;
      if (set.world && set.world[i] < -1 && mine.bad_worlds++ == 0) mine.bad_world_mark = mark;
      if (ids) mine.id_sum += mix64(ids[i]);
    }
    if (mine.inactive) device::fetch_add(&inspection->inactive, mine.inactive);
    if (mine.id_sum) device::fetch_add(&inspection->id_sum, mine.id_sum);
    if (mine.nans) {
      device::fetch_add(&inspection->nans, mine.nans);
      device::fetch_max(&inspection->nan_mark, mine.nan_mark);
    }
    if (mine.bad_worlds) {
      device::fetch_add(&inspection->bad_worlds, mine.bad_worlds);
      device::fetch_max(&inspection->bad_world_mark, mine.bad_world_mark);
    }
  }
};

// The caller's boxes and the regions that they overlap. A box that overlaps more than
// `tree_send_threshold` regions goes only to destination tree.count.
struct Routes {
  device::Set set;
  Tree tree;
  float margin;
  unsigned tree_send_threshold;

  // Calls f(place) for each destination of box i.
  template <class F>
  THRONG_HD void visit(std::uint64_t i, F&& f) const {
    const KeyBox key_box = key_box_of(set.box(i), margin);
    unsigned reached = 0;
    const unsigned most = tree_send_threshold;
    tree.visit(key_box, [&](int) { return ++reached <= most; });
    if (reached > most) {
      f(tree.count);
      return;
    }
    tree.visit(key_box, [&](int rank) {
      f(rank);
      return true;
    });
  }
};
struct CountRoutes {
  Routes routes;
  std::uint64_t* counts;  // per destination; initially zero

  THRONG_HD void operator()(std::uint64_t i) const {
    routes.visit(i, [&](int place) { (void)device::fetch_increment(counts + place); });
  }
};
struct WriteRoutes {
  Routes routes;
  const std::uint64_t* ids;  // null: first_id + i
  std::uint64_t first_id;
  std::uint64_t* next;  // per destination: the index of its next record
  int here;             // the rank whose records are not sent away
  Records owned, away;

  THRONG_HD void operator()(std::uint64_t i) const {
    const std::uint64_t id = ids ? ids[i] : first_id + i;
    routes.visit(i, [&](int place) {
      const std::uint64_t at = device::fetch_increment(next + place);
      (place == here ? owned : away).write(at, routes.set, i, id);
    });
  }
};

// Bit k of a box's mark: on axis k its lower corner is not below the region. The box overlaps the
// region.
constexpr std::uint8_t all_above = 7;

struct MarkOwned {
  device::Set set;
  float margin;
  Bounds region;
  std::uint64_t count, threads;
  std::uint8_t* marks;   // per box
  std::uint64_t* owned;  // number of owned boxes

  THRONG_HD void operator()(std::uint64_t thread) const noexcept {
    std::uint64_t here = 0;
    for (std::uint64_t i = thread; i < count; i += threads) {
      const KeyBox key_box = key_box_of(set.box(i), margin);
      unsigned mark = 0;
      for (int k = 0; k < 3; ++k) mark |= unsigned{key_box.lower[k] >= region.lower[k]} << k;
      marks[i] = static_cast<std::uint8_t>(mark);
      here += mark == all_above;
    }
    if (here) device::fetch_add(owned, here);
  }
};

// Keeps the pairs whose reference corner lies in the region; proof in RegionSearch::search_part.
struct KeepPairs {
  const Pair* found;
  Records first, second;  // equal for one set
  const std::uint8_t *first_marks, *second_marks;
  std::uint32_t *first_halves, *second_halves;  // per box: half the number of pairs charged to it
  bool two_sets;
  Pair64* kept;
  std::uint64_t* count;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const Pair pair = found[i];
    const unsigned one = first_marks[pair.first], two = second_marks[pair.second];
    if ((one | two) != all_above) return;
    const std::uint64_t a = first.id(pair.first), b = second.id(pair.second);
    const bool turned = !two_sets && b < a;
    kept[device::fetch_increment(count)] = turned ? Pair64{b, a} : Pair64{a, b};
    const std::uint32_t halves = one == two ? 1 : 2;
    if (one == all_above) device::fetch_add(first_halves + pair.first, halves);
    if (two == all_above) device::fetch_add(second_halves + pair.second, halves);
  }
};

// Samples one box of each run of `step` as a point, like subsample().
struct SamplePoints {
  static constexpr std::uint32_t none = ~0u;  // the weight of a box without a position

  device::Set set;
  float margin;
  std::uint64_t count, step;
  const std::uint8_t* marks;  // null: take all boxes, with weight 0
  const std::uint32_t* halves;
  std::uint64_t half_pair_work;
  Point* points;

  THRONG_HD void operator()(std::uint64_t k) const noexcept {
    const std::uint64_t first = k * step, some = first + mix64(first) % step;
    const std::uint64_t i = some < count ? some : count - 1;
    const KeyBox key_box = key_box_of(set.box(i), margin);
    const std::uint64_t weight = marks ? halves[i] * half_pair_work : 0;
    const bool counts = is_finite(key_box) && (!marks || marks[i] == all_above);
    points[k] = {{key_box.lower[0], key_box.lower[1], key_box.lower[2]},
                 counts ? point_weight(weight) : none};
  }
};

}  // namespace throng::mpi
