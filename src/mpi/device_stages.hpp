// What one thread does of a search across ranks whose boxes lie in a device's memory. No MPI, no
// CUDA: the host runs it, too.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include <throng/types.hpp>

#include "core/bounds.hpp"
#include "core/hd.hpp"
#include "mpi/bisect.hpp"
#include "mpi/mixed.hpp"
#include "mpi/record.hpp"
#include "mpi/regions.hpp"
#include "pipeline/atomic.hpp"
#include "pipeline/input.hpp"

namespace throng::mpi {

// So many threads share out what ends in sums: each adds its own up first.
constexpr std::uint64_t summing_threads = std::uint64_t{1} << 16;

// Records of a set, in words of four bytes: an id of eight may lie at an odd one.
struct Records {
  std::uint32_t* data = nullptr;
  std::uint64_t count = 0;
  std::uint32_t words = 8;  // of each
  unsigned filters = 0;

  THRONG_HD std::uint64_t id(std::uint64_t i) const noexcept {
    const std::uint32_t* p = data + i * words + 6;
    return p[0] | std::uint64_t{p[1]} << 32;
  }
  // Box i of a caller's as record `at`.
  THRONG_HD void write(std::uint64_t at, const pipeline::Set& set, std::uint64_t i,
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
  // The boxes and filters where they lie.
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

// What stands in a caller's arrays. All fields start from zero; a mark is ~ of the first index.
struct Looked {
  std::uint64_t inactive, nans, bad_worlds, id_sum;
  std::uint32_t nan_mark, bad_world_mark;
};
struct LookAtBoxes {
  pipeline::Set set;
  const std::uint64_t* ids;  // null: none
  std::uint64_t count, threads;
  Looked* looked;

  THRONG_HD void operator()(std::uint64_t thread) const noexcept {
    Looked mine{};
    for (std::uint64_t i = thread; i < count; i += threads) {
      const auto mark = ~static_cast<std::uint32_t>(i);
      const Box box = set.box(i);
      mine.inactive += !core::is_active(box);
      if (core::has_nan(box) && mine.nans++ == 0) mine.nan_mark = mark;
      if (set.world && set.world[i] < -1 && mine.bad_worlds++ == 0) mine.bad_world_mark = mark;
      if (ids) mine.id_sum += mixed(ids[i]);
    }
    if (mine.inactive) pipeline::fetch_add(&looked->inactive, mine.inactive);
    if (mine.id_sum) pipeline::fetch_add(&looked->id_sum, mine.id_sum);
    if (mine.nans) {
      pipeline::fetch_add(&looked->nans, mine.nans);
      pipeline::fetch_max(&looked->nan_mark, mine.nan_mark);
    }
    if (mine.bad_worlds) {
      pipeline::fetch_add(&looked->bad_worlds, mine.bad_worlds);
      pipeline::fetch_max(&looked->bad_world_mark, mine.bad_world_mark);
    }
  }
};

// A caller's boxes and the regions that they reach. A box that reaches more than `wide` of them
// goes to none, but to one place more, number tree.count.
struct Routes {
  pipeline::Set set;
  Tree tree;
  float margin;
  unsigned wide;

  // f(place) for each place that box i goes to.
  template <class F>
  THRONG_HD void visit(std::uint64_t i, F&& f) const {
    const Reach reach = reach_of(set.box(i), margin);
    unsigned reached = 0;
    const unsigned most = wide;
    tree.visit(reach, [&](int) { return ++reached <= most; });
    if (reached > most) {
      f(tree.count);
      return;
    }
    tree.visit(reach, [&](int rank) {
      f(rank);
      return true;
    });
  }
};
struct CountRoutes {
  Routes routes;
  std::uint64_t* counts;  // a place; cleared

  THRONG_HD void operator()(std::uint64_t i) const {
    routes.visit(i, [&](int place) { (void)pipeline::claim(counts + place); });
  }
};
struct WriteRoutes {
  Routes routes;
  const std::uint64_t* ids;  // null: first_id and on
  std::uint64_t first_id;
  std::uint64_t* next;  // a place: where its next record goes
  int here;             // whose records go to `home`
  Records home, away;

  THRONG_HD void operator()(std::uint64_t i) const {
    const std::uint64_t id = ids ? ids[i] : first_id + i;
    routes.visit(i, [&](int place) {
      const std::uint64_t at = pipeline::claim(next + place);
      (place == here ? home : away).write(at, routes.set, i, id);
    });
  }
};

// Bit k of a box's mark: on axis k its lower corner is not below the region, which it reaches.
constexpr std::uint8_t at_home = 7;

struct MarkHome {
  pipeline::Set set;
  float margin;
  Bounds region;
  std::uint64_t count, threads;
  std::uint8_t* marks;  // a box
  std::uint64_t* home;  // how many are at home

  THRONG_HD void operator()(std::uint64_t thread) const noexcept {
    std::uint64_t here = 0;
    for (std::uint64_t i = thread; i < count; i += threads) {
      const Reach reach = reach_of(set.box(i), margin);
      unsigned mark = 0;
      for (int k = 0; k < 3; ++k) mark |= unsigned{reach.lower[k] >= region.lower[k]} << k;
      marks[i] = static_cast<std::uint8_t>(mark);
      here += mark == at_home;
    }
    if (here) pipeline::fetch_add(home, here);
  }
};

// Of the pairs found those whose home corner lies in the region: Share::search_part says why.
struct KeepPairs {
  const Pair* found;
  Records first, second;  // of one set the same
  const std::uint8_t *first_marks, *second_marks;
  std::uint32_t *first_halves, *second_halves;  // a box: halves of the pairs that weigh on it
  bool two_sets;
  Pair64* kept;
  std::uint64_t* count;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const Pair pair = found[i];
    const unsigned one = first_marks[pair.first], two = second_marks[pair.second];
    if ((one | two) != at_home) return;
    const std::uint64_t a = first.id(pair.first), b = second.id(pair.second);
    const bool turned = !two_sets && b < a;
    kept[pipeline::claim(count)] = turned ? Pair64{b, a} : Pair64{a, b};
    const std::uint32_t halves = one == two ? 1 : 2;
    if (one == at_home) pipeline::fetch_add(first_halves + pair.first, halves);
    if (two == at_home) pipeline::fetch_add(second_halves + pair.second, halves);
  }
};

// One box of each run of `step` as a point, as thin_out() takes them.
struct SamplePoints {
  static constexpr std::uint32_t none = ~0u;  // the weight of a box that tells nothing

  pipeline::Set set;
  float margin;
  std::uint64_t count, step;
  const std::uint8_t* marks;  // null: all boxes count, and weigh nothing
  const std::uint32_t* halves;
  std::uint64_t half_pair_work;
  Point* points;

  THRONG_HD void operator()(std::uint64_t k) const noexcept {
    const std::uint64_t first = k * step, some = first + mixed(first) % step;
    const std::uint64_t i = some < count ? some : count - 1;
    const Reach reach = reach_of(set.box(i), margin);
    const std::uint64_t weight = marks ? halves[i] * half_pair_work : 0;
    const bool counts = is_somewhere(reach) && (!marks || marks[i] == at_home);
    points[k] = {{reach.lower[0], reach.lower[1], reach.lower[2]},
                 counts ? point_weight(weight) : none};
  }
};

}  // namespace throng::mpi
