// Persistent objects on a device: the per-thread steps of a call on them. A call first runs a
// check, which changes nothing visible. The host reads its report, and then the call applies the
// change.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include <throng/broad_phase.hpp>

#include "base/bounds.hpp"
#include "device/atomic.hpp"
#include "device/input.hpp"

namespace throng::device {

// Bits of an object's state.
constexpr std::uint8_t alive_bit = 1;
// Moved since the last update. A stale bit costs comparisons but is harmless.
constexpr std::uint8_t moved_bit = 2;
// The fat box differs from that in the grid; the fat box was made in this update.
constexpr std::uint8_t outlier_bit = 8, escaped_bit = 16;

constexpr std::uint32_t no_slot = 0xffffffffu;

// The report of a check; all fields start at zero.
struct CheckReport {
  std::uint64_t nan_count = 0, bad_ids = 0, bad_worlds = 0;
  std::uint32_t nan_mark = 0, bad_id_mark = 0, bad_world_mark = 0;  // ~ of the first such index
  // Flags: some box differs; some box left its fat box or does not contain its inner box; some box
  // became inactive or active again.
  std::uint32_t moved = 0, left = 0, activity_changed = 0;

  // Whether the call may be applied.
  THRONG_HD bool good(bool nan_allowed) const noexcept {
    return bad_ids == 0 && bad_worlds == 0 && (nan_allowed || nan_count == 0);
  }
};

// Counts of begin and end events.
struct EventCounts {
  std::uint64_t count = 0, begun = 0;
  std::uint64_t comparisons = 0;
};

// Bitwise, so a box that differs only by -0 and 0 may count as moved.
THRONG_HD inline bool same_bits(const Box& a, const Box& b) noexcept {
  const auto x = [](float p, float q) {
    return std::bit_cast<std::uint32_t>(p) ^ std::bit_cast<std::uint32_t>(q);
  };
  return (x(a.lower.x, b.lower.x) | x(a.lower.y, b.lower.y) | x(a.lower.z, b.lower.z) |
          x(a.upper.x, b.upper.x) | x(a.upper.y, b.upper.y) | x(a.upper.z, b.upper.z)) == 0;
}

// The objects as a thread sees them. Filter arrays that no call has set yet are null.
struct ObjectView {
  Box *boxes, *fat;  // as set last; when candidates were found, expanded
  std::uint8_t* state;
  std::uint32_t *group, *mask;
  std::int32_t *owner, *world;
  std::uint8_t* is_static;
  std::uint64_t* marks;
  std::uint32_t limit;
  float margin, fat_margin;

  THRONG_HD static Box inactive() noexcept { return {{1, 1, 1}, {-1, -1, -1}}; }
  THRONG_HD bool is_alive(std::uint32_t id) const noexcept {
    return id < limit && (state[id] & alive_bit);
  }
  THRONG_HD Box grown(const Box& box) const noexcept {
    return margin != 0 ? base::expand(box, margin) : box;
  }
  THRONG_HD Box fat_box(const Box& box) const noexcept {
    return base::is_active(box) ? base::expand(grown(box), fat_margin) : inactive();
  }
  // The inner box: the box of fat box `f`, shrunk by as much as `f` is expanded, and by at least
  // one float step.
  THRONG_HD Box inner_box(const Box& f) const noexcept {
    const float by = 2 * fat_margin;
    return {{grown_by(f.lower.x, by), grown_by(f.lower.y, by), grown_by(f.lower.z, by)},
            {-grown_by(-f.upper.x, by), -grown_by(-f.upper.y, by), -grown_by(-f.upper.z, by)}};
  }
  THRONG_HD static bool inside(const Box& a, const Box& b) noexcept {
    return (b.lower.x <= a.lower.x) & (a.upper.x <= b.upper.x) & (b.lower.y <= a.lower.y) &
           (a.upper.y <= b.upper.y) & (b.lower.z <= a.lower.z) & (a.upper.z <= b.upper.z);
  }
  // Whether the candidates still contain all pairs of this box, and the candidates whose inner
  // boxes overlap are pairs: the box lies in its fat box and contains its inner box.
  THRONG_HD bool holds(std::uint32_t id, const Box& box) const noexcept {
    if (!base::is_active(box)) return true;
    const Box mine = grown(box), f = load_box(fat + id);
    const bool not_out = inside(mine, f), around = inside(inner_box(f), mine);
    return not_out && around;
  }
  // Reports a new box.
  THRONG_HD void report_move(std::uint32_t id, const Box& now, CheckReport& report) const noexcept {
    if (!holds(id, now)) set_flag(&report.left);
    if (!base::is_active(now)) set_flag(&report.activity_changed);
  }
  THRONG_HD void set_filters(std::uint32_t id, const Set& from, std::uint64_t i,
                             bool fresh) const noexcept {
    // A filter that the call does not give stays; a new object gets the default.
    if (group && (from.group || fresh)) group[id] = from.group ? from.group[i] : ~0u;
    if (mask && (from.mask || fresh)) mask[id] = from.mask ? from.mask[i] : ~0u;
    if (owner && (from.owner || fresh)) owner[id] = from.owner ? from.owner[i] : -1;
    if (world && (from.world || fresh)) world[id] = from.world ? from.world[i] : -1;
    if (is_static && (from.is_static || fresh))
      is_static[id] = from.is_static ? from.is_static[i] : std::uint8_t{0};
  }

 private:
  THRONG_HD static float grown_by(float x, float by) noexcept {
    const float y = x + by;
    return y > x ? y : -base::next_down(-x);
  }
};

THRONG_HD inline void report_nan(CheckReport& report, std::uint32_t i) noexcept {
  fetch_add(&report.nan_count, std::uint64_t{1});
  fetch_max(&report.nan_mark, ~i);
}
THRONG_HD inline void check_world(const Set& from, std::uint32_t i, CheckReport& report) noexcept {
  if (!from.world || from.world[i] >= -1) return;
  fetch_add(&report.bad_worlds, std::uint64_t{1});
  fetch_max(&report.bad_world_mark, ~i);
}

template <class T>
struct Fill {
  T* values;
  T value;
  THRONG_HD void operator()(std::uint64_t i) const noexcept { values[i] = value; }
};

// ---- ids ----------------------------------------------------------------------------------------

// Each id is claimed by its first position in the list, for any order of threads.
struct ClaimIds {
  ObjectView objects;
  const ObjectId* ids;
  std::uint32_t token;  // different per call

  THRONG_HD static std::uint64_t claim_mark(std::uint32_t token, std::uint32_t i) noexcept {
    return std::uint64_t{token} << 32 | ~i;
  }
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const ObjectId id = ids[i];
    if (objects.is_alive(id))
      fetch_max(objects.marks + id, claim_mark(token, static_cast<std::uint32_t>(i)));
  }
};

// After ClaimIds: checks the ids, boxes and worlds of a list, and whether a box leaves its fat box.
struct CheckList {
  ObjectView objects;
  const ObjectId* ids;
  std::uint32_t token;
  Set boxes;
  bool has_boxes;
  CheckReport* report;

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    const ObjectId id = ids[i];
    check_world(boxes, i, *report);
    if (!objects.is_alive(id) || objects.marks[id] != ClaimIds::claim_mark(token, i)) {
      fetch_add(&report->bad_ids, std::uint64_t{1});
      fetch_max(&report->bad_id_mark, ~i);
      return;
    }
    if (!has_boxes) return;
    const Box box = boxes.box(i);
    if (base::has_nan(box)) report_nan(*report, i);
    objects.report_move(id, box, *report);
  }
};

struct MoveList {
  ObjectView objects;
  const ObjectId* ids;
  Set boxes;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const ObjectId id = ids[i];
    objects.boxes[id] = boxes.box(i);
    objects.state[id] |= moved_bit;
  }
};
struct SetListFilters {
  ObjectView objects;
  const ObjectId* ids;
  Set filters;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    objects.set_filters(ids[i], filters, i, false);
  }
};
// A removed object has an inactive box until the update that reports its end events.
struct RemoveList {
  ObjectView objects;
  const ObjectId* ids;
  ObjectId* removed;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    const ObjectId id = ids[i];
    objects.boxes[id] = ObjectView::inactive();
    objects.state[id] = moved_bit;
    removed[i] = id;
  }
};

// ---- all ----------------------------------------------------------------------------------------

struct CheckNew {
  Set boxes;
  CheckReport* report;
  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    check_world(boxes, i, *report);
    if (base::has_nan(boxes.box(i))) report_nan(*report, i);
  }
};
// Most recently freed ids are reused first.
struct AddBoxes {
  ObjectView objects;
  Set boxes;
  const ObjectId* free_ids;
  std::uint32_t free_count;
  ObjectId* ids;

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    const ObjectId id =
        i < free_count ? free_ids[free_count - 1 - i] : objects.limit + i - free_count;
    objects.boxes[id] = boxes.box(i);
    objects.fat[id] = ObjectView::inactive();
    objects.state[id] = alive_bit | moved_bit;
    objects.set_filters(id, boxes, i, true);
    if (ids) ids[i] = id;
  }
};

// Whether any object that is alive has a different box. Contiguous boxes are compared by words of
// 16 bytes, three per two boxes. New boxes are read with a streaming hint, so that the objects'
// boxes stay in the cache.
struct FindMoved {
  static constexpr std::uint64_t word = 16;

  ObjectView objects;
  Set boxes;
  std::uint32_t* moved;
  bool compares_words = boxes.packed && boxes.stride == sizeof(Box) &&
                        reinterpret_cast<std::uintptr_t>(boxes.corner[0]) % word == 0;

  std::uint64_t count() const noexcept {
    return compares_words ? (std::uint64_t{objects.limit} * sizeof(Box) + word - 1) / word
                          : objects.limit;
  }
  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    if (!compares_words) return compare(index);
    const std::uint64_t at = index * word, bytes = std::uint64_t{objects.limit} * sizeof(Box);
    const char* const before = reinterpret_cast<const char*>(objects.boxes) + at;
    const char* const now = boxes.corner[0] + at;
    if (bytes - at >= word ? same_word<2>(before, now) : same_word<1>(before, now)) return;
    compare(at / sizeof(Box));
    const std::uint64_t last = (at + word - 1) / sizeof(Box);
    if (last != at / sizeof(Box) && last < objects.limit) compare(last);
  }

 private:
  THRONG_HD void compare(std::uint64_t i) const noexcept {
    if ((objects.state[i] & alive_bit) && !same_bits(boxes.box(i), load_box(objects.boxes + i)))
      set_flag(moved);
  }
  // Compares `eights` * 8 bytes.
  template <int eights>
  THRONG_HD static bool same_word(const char* before, const char* now) noexcept {
#if defined(__CUDA_ARCH__)
    if constexpr (eights == 2) {
      const uint4 a = *reinterpret_cast<const uint4*>(before);
      const uint4 b = __ldcs(reinterpret_cast<const uint4*>(now));
      return ((a.x ^ b.x) | (a.y ^ b.y) | (a.z ^ b.z) | (a.w ^ b.w)) == 0;
    } else {
      const uint2 a = *reinterpret_cast<const uint2*>(before);
      const uint2 b = *reinterpret_cast<const uint2*>(now);
      return ((a.x ^ b.x) | (a.y ^ b.y)) == 0;
    }
#else
    return std::memcmp(before, now, 8 * eights) == 0;
#endif
  }
};

// A box for every id: flags those that moved and those that left their fat boxes.
struct CheckAll {
  ObjectView objects;
  Set boxes;
  CheckReport* report;
  bool moved_before;  // since the last update: then moved bits stay

  THRONG_HD void operator()(std::uint64_t index) const noexcept {
    const auto i = static_cast<std::uint32_t>(index);
    // No load depends on another.
    const std::uint8_t state = objects.state[i];
    const Box now = boxes.box(i), before = load_box(objects.boxes + i);
    if (!(state & alive_bit)) return;
    const bool moved = !same_bits(now, before);
    const std::uint8_t others = moved_before ? state : state & ~moved_bit;
    const auto after = static_cast<std::uint8_t>(moved ? others | moved_bit : others);
    if (after != state) objects.state[i] = after;
    if (!moved) return;
    if (base::has_nan(now)) report_nan(*report, i);
    set_flag(&report->moved);
    objects.report_move(i, now, *report);
  }
};
// Launched after CheckAll without reading its report: does nothing if that refuses. Resets the
// change counts.
struct MoveAll {
  ObjectView objects;
  Set boxes;
  const CheckReport* report;
  bool nan_allowed;
  EventCounts* changed;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (i == 0) *changed = EventCounts{};
    if (!report->moved || !report->good(nan_allowed)) return;
    constexpr std::uint8_t both = alive_bit | moved_bit;
    if ((objects.state[i] & both) == both) objects.boxes[i] = boxes.box(i);
  }
};

struct ShiftOrigin {
  ObjectView objects;
  Vec3 by;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (!(objects.state[i] & alive_bit)) return;
    objects.boxes[i] = base::shifted(objects.boxes[i], by);
  }
};

// ---- an update ----------------------------------------------------------------------------------

// Fat boxes around the objects' present boxes.
struct Fatten {
  ObjectView objects;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    objects.fat[i] = objects.fat_box(load_box(objects.boxes + i));
    if (objects.state[i] & (outlier_bit | escaped_bit)) objects.state[i] &= alive_bit | moved_bit;
  }
};
struct ClearMoved {
  ObjectView objects;
  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    if (objects.state[i] & (moved_bit | escaped_bit)) objects.state[i] &= alive_bit | outlier_bit;
  }
};

}  // namespace throng::device
