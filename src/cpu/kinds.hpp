// What static, group and mask say of two boxes, as bits that a sweep compares.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>

#include <throng/boxes.hpp>

#include "cpu/kernels.hpp"
#include "cpu/memory.hpp"

namespace throng::cpu {

struct Search;

// A box's kind is which combination of static, group and mask it has. Scenes have a handful of
// combinations, however many boxes they have. So what two boxes' filters say is looked up by their
// kinds; and where kinds behave in a few ways only, it is one AND of two words, a box's where it is
// the query and the other's where it is the target, which a sweep does anyway (see Strip).
class Kinds {
 public:
  static constexpr std::uint32_t most = 16;
  // The bits of those words that are the kinds'.
  static constexpr unsigned first_bit = 9, bit_count = 6;

  explicit Kinds(Memory& memory) noexcept
      : of_{Buffer<std::uint8_t>(memory), Buffer<std::uint8_t>(memory)} {}

  static bool needed(const Boxes& boxes) noexcept {
    return tell_kinds(boxes.filters) || boxes.filters.world;
  }
  // Reads the filters of the search's set, or sets.
  void read(Search&, unsigned task_count);
  // Whether there are boxes of two worlds, those of all worlds aside, that could meet; the greatest
  // number of a world; and how many boxes are of all.
  bool several_worlds() const noexcept { return several_worlds_; }
  std::int32_t greatest_world() const noexcept { return worlds_.greatest; }
  std::uint64_t everywhere() const noexcept { return worlds_.of_all; }
  // Whether there are static boxes, and none but these.
  bool some_static() const noexcept { return some_static_; }
  bool all_static() const noexcept { return all_static_; }
  bool is_static(bool second, std::uint32_t id) const noexcept {
    return known_[of(second)[id]].is_static != 0;
  }
  // Says what may pair with what. `static_apart`: two static boxes are not compared anyway.
  void settle(bool static_apart) noexcept;

  // Whether anything is forbidden at all; whether the words below tell some of it, and all of it.
  bool forbid() const noexcept { return forbid_; }
  bool words_tell() const noexcept { return words_tell_; }
  bool words_tell_all() const noexcept { return words_tell_all_; }
  // The words of a kind: they have a bit in common where the two may not pair.
  const std::uint16_t* as_query() const noexcept { return as_query_; }
  const std::uint16_t* as_target() const noexcept { return as_target_; }
  // The kinds with which one may not pair, a bit each.
  std::uint32_t forbidden(std::uint32_t kind) const noexcept { return forbidden_[kind]; }
  // By id, of the first set or the second.
  const std::uint8_t* of(bool second) const noexcept { return of_[second && two_sets_].data(); }

  // Says of a pair whether static allows it, and group and mask, where kinds tell these.
  struct Allowed {
    const std::uint8_t *first, *second;
    const std::uint16_t* forbidden;
    bool operator()(Pair pair) const noexcept {
      return (forbidden[first[pair.first]] >> second[pair.second] & 1) == 0;
    }
  };
  Allowed allowed() const noexcept { return {of(false), of(true), forbidden_}; }
  // Else there are too many combinations, and kinds tell static alone.
  bool grouped() const noexcept { return grouped_.load(std::memory_order_relaxed); }

 private:
  static bool tell_kinds(const Filters& f) noexcept { return f.group || f.mask || f.is_static; }
  struct Task;
  bool read_all(Search&, unsigned task_count);
  void read_tile(const Search&, const Filters&, std::size_t begin, std::size_t count,
                 std::uint8_t* kinds, Task&) noexcept;
  void learn(const FilterTile&, const std::uint8_t* kinds, Task&) noexcept;

  Buffer<std::uint8_t> of_[2];
  bool two_sets_ = false;
  bool several_worlds_ = false, some_static_ = false, all_static_ = false;
  bool forbid_ = false, words_tell_ = false, words_tell_all_ = false;
  WorldRange worlds_;
  std::atomic<bool> grouped_ = true;
  std::mutex mutex_;  // of what tasks find out
  std::uint32_t known_count_ = 0;
  Combination known_[most] = {};
  std::uint16_t forbidden_[most] = {};  // of a kind those that it may not pair with, a bit each
  std::uint16_t as_query_[most] = {}, as_target_[most] = {};
};

}  // namespace throng::cpu
