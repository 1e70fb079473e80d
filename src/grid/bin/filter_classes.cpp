#include "grid/bin/filter_classes.hpp"

#include <algorithm>

#include "base/threads.hpp"
#include "grid/search.hpp"

namespace throng::grid {
namespace {

// Neutral values of absent filters.
struct NeutralValues {
  std::uint32_t ones[filter_tile] = {};
  std::uint8_t zeros[filter_tile] = {};
  constexpr NeutralValues() { std::fill(ones, ones + filter_tile, 0xffffffffu); }
};
constexpr NeutralValues neutral_values;

// A tile's values as an array: the filter's own memory if a full tile is contiguous, else a copy in
// `buffer`, padded with the last value.
template <class T>
const T* contiguous_values(const Strided<T>& filter, std::size_t begin, std::size_t count,
                           const T* absent, T* buffer) noexcept {
  if (!filter) return absent;
  if (filter.stride_bytes == sizeof(T) && count == filter_tile) return filter.data + begin;
  for (std::size_t i = 0; i < count; ++i) buffer[i] = filter[begin + i];
  std::fill(buffer + count, buffer + filter_tile, buffer[count - 1]);
  return buffer;
}

}  // namespace

// One task's copy of the known combinations, and scratch for a tile's filters.
struct FilterClasses::Task {
  bool grouped = true;  // the value of grouped() when this pass started
  std::uint32_t known_count = 0;
  FilterCombination known[most] = {};
  WorldRange worlds;
  alignas(64) std::uint32_t group[filter_tile], mask[filter_tile];
  alignas(64) std::int32_t world[filter_tile];
  alignas(64) std::uint8_t is_static[filter_tile];
};

// Adds the tile's new combinations and takes those that other tasks found. If there are too many,
// clears grouped_.
void FilterClasses::add_combinations(const FilterTile& tile, const std::uint8_t* filter_classes,
                                     Task& task) noexcept {
  const std::lock_guard<base::Mutex> lock(mutex_);
  for (std::size_t i = 0; i < filter_tile; ++i) {
    if (filter_classes[i] != unknown_class) continue;
    const FilterCombination one{tile.group[i], tile.mask[i], tile.is_static[i] != 0};
    FilterCombination* const end = known_ + known_count_;
    if (std::find(known_, end, one) != end) continue;
    if (known_count_ == most) {
      grouped_ = false;
      return;
    }
    known_[known_count_++] = one;
  }
  std::copy(known_, known_ + known_count_, task.known);
  task.known_count = known_count_;
}

void FilterClasses::read_tile(const Search& search, const Filters& f, std::size_t begin,
                              std::size_t count, std::uint8_t* filter_classes,
                              Task& task) noexcept {
  const Kernels& kernels = *search.kernels;
  if (f.world) {
    const std::int32_t* const none = nullptr;
    kernels.read_worlds(contiguous_values(f.world, begin, count, none, task.world),
                        static_cast<std::uint32_t>(count), task.worlds);
  }
  if (!filter_classes) return;
  const Strided<std::uint32_t> none;
  const FilterTile tile{
      contiguous_values(task.grouped ? f.group : none, begin, count, neutral_values.ones,
                        task.group),
      contiguous_values(task.grouped ? f.mask : none, begin, count, neutral_values.ones, task.mask),
      contiguous_values(f.is_static, begin, count, neutral_values.zeros, task.is_static)};
  while (
      !kernels.match_filter_classes(tile, task.known, task.known_count, filter_classes + begin) &&
      task.grouped == grouped())
    add_combinations(tile, filter_classes + begin, task);
}

// Returns false if there are too many combinations.
bool FilterClasses::read_all(Search& search, unsigned task_count) {
  const bool grouped = this->grouped();
  known_count_ = 0;
  worlds_ = {};
  const bool has_classes =
      has_class_filters(search.a->filters) || has_class_filters(search.b->filters);
  for (const bool second : {false, true}) {
    if (second && !two_sets_) continue;
    const Boxes& boxes = second ? *search.b : *search.a;
    std::uint8_t* const filter_classes =
        has_classes ? of_[second].ensure(boxes.size() + filter_tile) : nullptr;
    base::ChunkQueue shares(boxes.size(), task_count, filter_tile);
    auto read = [&](unsigned t) {
      Task task;
      task.grouped = grouped;
      std::size_t begin, end;
      while (!search.over() && shares.take(t, begin, end)) {
        for (std::size_t at = begin; at < end && grouped == this->grouped(); at += filter_tile)
          read_tile(search, boxes.filters, at, std::min<std::size_t>(filter_tile, end - at),
                    filter_classes, task);
      }
      const std::lock_guard<base::Mutex> lock(mutex_);
      worlds_.add(task.worlds);
    };
    base::run_tasks(*search.executor, task_count, read);
  }
  several_worlds_ = worlds_.several() && search.a->filters.world && search.b->filters.world;
  return grouped == this->grouped();
}

void FilterClasses::read(Search& search, unsigned task_count) {
  two_sets_ = search.two_sets;
  grouped_ = true;
  if (!read_all(search, task_count)) read_all(search, task_count);
  const auto is_static = [](const FilterCombination& one) { return one.is_static != 0; };
  some_static_ = std::any_of(known_, known_ + known_count_, is_static);
  all_static_ = std::all_of(known_, known_ + known_count_, is_static);
}

void FilterClasses::settle(bool static_apart) noexcept {
  const auto both_static = [&](const FilterCombination& x, const FilterCombination& y) {
    return !static_apart && (x.is_static & y.is_static) != 0;
  };
  forbid_ = !grouped();
  for (std::uint32_t k = 0; k < known_count_; ++k) {
    const FilterCombination& one = known_[k];
    unsigned row = 0;
    for (std::uint32_t j = 0; j < known_count_; ++j) {
      const FilterCombination& other = known_[j];
      const bool never =
          (one.group & other.mask) == 0 || (other.group & one.mask) == 0 || both_static(one, other);
      row |= unsigned{never} << j;
    }
    forbidden_[k] = static_cast<std::uint16_t>(row);
    forbid_ = forbid_ || row != 0;
  }

  // A target's bit names the set of classes that it must not pair with, if any. A query has the
  // bits of all sets that contain its class.
  std::uint16_t rows[RejectMask::filter_bits];
  unsigned row_count = 0;
  bool fit = true;
  for (std::uint32_t k = 0; k < known_count_; ++k) {
    as_target_[k] = {};
    if (forbidden_[k] == 0) continue;
    const auto row = static_cast<unsigned>(std::find(rows, rows + row_count, forbidden_[k]) - rows);
    fit = row < RejectMask::filter_bits;
    if (!fit) break;
    if (row == row_count) rows[row_count++] = forbidden_[k];
    as_target_[k] = RejectMask::of_filter(row);
  }
  // Fallback: static alone.
  if (!fit) {
    for (std::uint32_t k = 0; k < known_count_; ++k)
      as_target_[k] = both_static(known_[k], known_[k]) ? RejectMask::of_filter(0) : RejectMask();
  }
  masks_cover_some_ = false;
  for (std::uint32_t k = 0; k < known_count_; ++k) {
    as_query_[k] = fit ? RejectMask() : as_target_[k];
    for (std::uint32_t j = 0; j < known_count_ && fit; ++j)
      if (forbidden_[k] >> j & 1) as_query_[k] = as_query_[k] | as_target_[j];
    masks_cover_some_ |= !as_query_[k].is_empty();
  }
  masks_cover_all_ = fit && grouped();
}

}  // namespace throng::grid
