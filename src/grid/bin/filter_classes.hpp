// Static, group and mask as bits that the sweep compares.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include <throng/boxes.hpp>

#include "base/memory.hpp"
#include "base/mutex.hpp"
#include "grid/sweep/kernel_table.hpp"

namespace throng::grid {

struct Search;

// A box's filter class is its combination of static, group and mask. Scenes have a handful of
// classes, whatever their number of boxes, so whether two boxes may pair is a table lookup by
// class. If the classes form only a few distinct sets, it is one AND of two bit masks, one for the
// box as query and one for it as target, which the sweep does anyway (see Strip).
class FilterClasses {
 public:
  static constexpr std::uint32_t most = 16;

  explicit FilterClasses(base::Memory& memory) noexcept
      : of_{base::Buffer<std::uint8_t>(memory), base::Buffer<std::uint8_t>(memory)} {}

  static bool needed(const Boxes& boxes) noexcept {
    return has_class_filters(boxes.filters) || boxes.filters.world;
  }
  // Reads the filters of the search's set or sets.
  void read(Search&, unsigned task_count);
  // Whether boxes of different worlds (other than -1) could meet; the greatest world; and the
  // number of boxes in world -1.
  bool several_worlds() const noexcept { return several_worlds_; }
  std::int32_t greatest_world() const noexcept { return worlds_.greatest; }
  std::uint64_t everywhere() const noexcept { return worlds_.in_all_worlds; }
  // Whether some boxes are static; whether all are.
  bool some_static() const noexcept { return some_static_; }
  bool all_static() const noexcept { return all_static_; }
  bool is_static(bool second, std::uint32_t id) const noexcept {
    return known_[of(second)[id]].is_static != 0;
  }
  // Computes which classes may pair. `static_apart`: two static boxes are never compared anyway.
  void settle(bool static_apart) noexcept;

  // Whether any pair is forbidden; whether the masks below cover some of that, and all of it.
  bool forbid() const noexcept { return forbid_; }
  bool masks_cover_some() const noexcept { return masks_cover_some_; }
  bool masks_cover_all() const noexcept { return masks_cover_all_; }
  // Masks per class: two share a bit if their pair is forbidden.
  const RejectMask* as_query() const noexcept { return as_query_; }
  const RejectMask* as_target() const noexcept { return as_target_; }
  // The classes that `filter_class` must not pair with, a bit each.
  std::uint32_t forbidden(std::uint32_t filter_class) const noexcept {
    return forbidden_[filter_class];
  }
  // Classes by id, of the first or second set.
  const std::uint8_t* of(bool second) const noexcept { return of_[second && two_sets_].data(); }

  // Whether static, group and mask (as far as classes cover them) allow a pair.
  struct Allowed {
    const std::uint8_t *first, *second;
    const std::uint16_t* forbidden;
    bool operator()(Pair pair) const noexcept {
      return (forbidden[first[pair.first]] >> second[pair.second] & 1) == 0;
    }
  };
  Allowed allowed() const noexcept { return {of(false), of(true), forbidden_}; }
  // False: there are too many combinations, and classes cover static only.
  bool grouped() const noexcept { return grouped_.load(std::memory_order_relaxed); }

 private:
  static bool has_class_filters(const Filters& f) noexcept {
    return f.group || f.mask || f.is_static;
  }
  struct Task;
  bool read_all(Search&, unsigned task_count);
  void read_tile(const Search&, const Filters&, std::size_t begin, std::size_t count,
                 std::uint8_t* filter_classes, Task&) noexcept;
  void add_combinations(const FilterTile&, const std::uint8_t* filter_classes, Task&) noexcept;

  base::Buffer<std::uint8_t> of_[2];
  bool two_sets_ = false;
  bool several_worlds_ = false, some_static_ = false, all_static_ = false;
  bool forbid_ = false, masks_cover_some_ = false, masks_cover_all_ = false;
  WorldRange worlds_;
  std::atomic<bool> grouped_ = true;
  base::Mutex mutex_;  // guards what tasks share
  std::uint32_t known_count_ = 0;
  FilterCombination known_[most] = {};
  std::uint16_t forbidden_[most] = {};  // per class, a bit per class that it must not pair with
  RejectMask as_query_[most], as_target_[most];
};

}  // namespace throng::grid
