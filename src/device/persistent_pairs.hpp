// Pairs of persistent objects in device memory: candidates, slots and the last update's events.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "device/candidate_finder.hpp"
#include "device/device_buffer.hpp"
#include "device/outlier_stages.hpp"
#include "device/pair_update_stages.hpp"
#include "device/persistent_objects.hpp"

namespace throng::device {

template <class Device>
class PersistentPairs {
 public:
  explicit PersistentPairs(Device& device) noexcept : device_(device) {}

  std::uint64_t count() const noexcept { return count_; }
  std::uint64_t candidate_count() const noexcept { return candidates_.count; }
  std::uint32_t slot_limit() const noexcept { return slot_limit_; }
  LivePairs begun() const noexcept { return begun_.view(); }
  LivePairs ended() const noexcept { return ended_.view(); }
  LivePairs candidates() const noexcept { return candidates_.view(); }

  // prepare_retest() reserves capacity for the usual number of changes. launch_retest() launches a
  // comparison of the candidates, which depends on the device's value of `checked`, if that is not
  // null. report->changed is zero.
  void prepare_retest() {
    changes_.ensure((candidates_.count / 8 + 1024) * sizeof(Pair));
    reserve_tiles(Tiles::of(candidates_.count));
  }
  void launch_retest(const ObjectView& objects, UpdateReport* report, const CheckReport* checked,
                     bool nan_allowed, bool moved_before, bool activity_changed_before) const {
    Retest retest{candidates_.list(), objects, checked, nan_allowed, moved_before};
    if (!activity_changed_before) retest.uncertain = uncertain();
    retest.all_listed = dense_updates_left_ != 0;
    gather_changes(retest, report);
  }

  // Applies the changes that `changed` counts; if they did not fit, gathers them again. `objects`
  // is as in launch_retest(); `activity_changed`: of objects.activity_changed() now.
  void commit_retest(const ObjectView& objects, EventCounts changed, bool activity_changed,
                     UpdateReport* report) {
    // On a failure, and if the list was not used, the list's pair flags are invalid.
    const bool listed = listed_ && !activity_changed;
    listed_ = false;
    if (changed.count > CandidateFinder<Device>::capacity_of(changes_)) {
      reserve_changes(changed.count);
      device_.clear(&report->changed, sizeof(EventCounts));
      gather_changes(Retest{candidates_.list(), objects, nullptr, true, true}, report);
      changed = device_.read(report->changed);
    }
    commit(changed, candidates_.list(), Tiles::of(candidates_.count));
    if (listed) note_density(changed.comparisons);
    listed_ = listed;
  }
  // After an update that kept all candidates: lists the uncertain ones, once candidates have been
  // kept for a while, so that it pays off. Asynchronous.
  void list_uncertain(const ObjectView& objects) {
    if (listed_ || candidates_.count == 0 || ++updates_kept_ < 2) return;
    const std::uint64_t n = candidates_.count, tiles = Tiles::of(n);
    const auto bytes = static_cast<std::size_t>(n / 8 * 5 + 1024) * sizeof(Pair);
    try {
      uncertain_.ensure(bytes);
      finder_.scratch().ensure(bytes);
      uncertain_counts_.ensure(sizeof(EventCounts));
      reserve_tiles(tiles);
    } catch (const Failure&) {
      return;  // the list is optional
    }
    list_size_ = unknown;
    auto* report = uncertain_counts_.template as<EventCounts>();
    device_.clear(report, sizeof(EventCounts));
    const Tiles to = tiles_of(finder_.scratch(), tiles, report);
    device_.gather(n, FindUncertain{candidates_.list(), objects}, to);
    listed_ = true;
    const TileWalk walk = scan_tiles(to);
    list_capacity_ = std::min(CandidateFinder<Device>::capacity_of(uncertain_), to.capacity);
    device_.launch(walk.count(), StoreUncertain{walk, uncertain()});
  }

  // Finds all candidates of the fat boxes again and applies the changes.
  void commit_all(const Boxes& fat, const ObjectView& objects, const Options& options,
                  bool filters_changed, UpdateReport* report, Result& r) {
    const std::uint64_t found = finder_.find_all(fat, options, r);
    next_.ensure(found);
    const Candidates now{next_.block.template as<LivePair>(), found};
    device_.launch(found, CarrySlots{finder_.found(), candidates_.list(), now.pairs});
    commit_next(now, objects, nullptr, found, filters_changed, report, r);
  }

  // For few boxes that left theirs. Returns false if they are too many or there is no grid. Calls
  // begin() before fat boxes change.
  template <class Begin>
  bool commit_escaped(const ObjectView& objects, UpdateReport* report, const Begin& begin,
                      Result& r) {
    std::uint64_t fresh = 0;
    if (candidates_.count >= no_slot || !finder_.find_escaped(objects, report, begin, fresh))
      return false;
    const Candidates before = candidates_.list();
    const std::uint32_t* sums = sums_of(before.count + 1, [&](std::uint32_t* flags) {
      device_.launch(before.count + 1, FlagKept{before, objects.state, flags});
    });
    next_.ensure(before.count + fresh);
    const Candidates now{next_.block.template as<LivePair>(), before.count + fresh};
    const Pair* added = finder_.fresh();
    device_.launch(before.count, MergeKept{before, {added, fresh}, sums, now.pairs});
    device_.launch(fresh, MergeFresh{before, added, sums, now.pairs});
    device_.copy(&report->kept, sums + before.count, sizeof report->kept);
    commit_next(now, objects, &report->kept, fresh, false, report, r);
    return true;
  }

  // Sorted; compacted on the first call after a change.
  LivePairs pairs() {
    if (count_ == candidates_.count) return candidates_.view();
    if (!gathered_) {
      const std::uint64_t n = candidates_.count;
      auto* sums = sums_of(n + 1, [&](std::uint32_t* flags) {
        device_.launch(n + 1, FlagPairs{candidates_.list(), flags});
      });
      pairs_.ensure(count_);
      device_.launch(n,
                     GatherPairs{candidates_.list(), sums, pairs_.block.template as<LivePair>()});
      pairs_.count = count_;
      gathered_ = true;
    }
    return pairs_.view();
  }

  void reserve_for(const PersistentPairs& other) {
    for (const auto& [mine, theirs] : lists(*this, other))
      mine->block.grow(theirs->count * sizeof(LivePair), mine->count * sizeof(LivePair));
    free_slots_.grow(other.slot_limit_ * slot_bytes, free_count_ * slot_bytes);
  }
  void copy(const PersistentPairs& other) {
    for (const auto& [mine, theirs] : lists(*this, other)) {
      mine->count = theirs->count;
      if (mine->count)
        device_.copy(mine->block.template as<char>(), theirs->block.template as<char>(),
                     mine->count * sizeof(LivePair));
    }
    if (other.free_count_)
      device_.copy(free_slots_.template as<char>(), other.free_slots_.template as<char>(),
                   other.free_count_ * slot_bytes);
    count_ = other.count_;
    slot_limit_ = other.slot_limit_;
    free_count_ = other.free_count_;
    gathered_ = false;
    finder_.forget_grid();
    clear_uncertain();
  }

  std::size_t held() const noexcept {
    std::size_t sum = finder_.held();
    for (const DeviceBuffer<Device>* b :
         {&candidates_.block, &next_.block, &begun_.block, &ended_.block, &next_begun_.block,
          &next_ended_.block, &pairs_.block, &free_slots_, &changes_, &flags_, &scratch_, &tiles_,
          &uncertain_, &uncertain_counts_})
      sum += b->bytes();
    return sum;
  }

 private:
  static constexpr std::size_t slot_bytes = sizeof(std::uint32_t);
  static constexpr std::uint64_t unknown = ~std::uint64_t{0};

  struct List {
    explicit List(Device& device) noexcept : block(device) {}
    LivePairs view() const noexcept {
      return {block.template as<LivePair>(), static_cast<std::size_t>(count)};
    }
    Candidates list() const noexcept { return {block.template as<LivePair>(), count}; }
    // The contents are lost when it grows.
    void ensure(std::uint64_t wanted) {
      const auto bytes = static_cast<std::size_t>(wanted) * sizeof(LivePair);
      if (bytes > block.bytes()) count = 0;
      if (bytes > block.bytes()) block.ensure(bytes + bytes / 8);
    }
    void swap(List& other) noexcept {
      block.swap(other.block);
      std::swap(count, other.count);
    }
    DeviceBuffer<Device> block;
    std::uint64_t count = 0;
  };
  template <class Mine, class Theirs>
  static std::array<std::pair<List*, const List*>, 3> lists(Mine& mine, Theirs& theirs) noexcept {
    return {{{&mine.candidates_, &theirs.candidates_},
             {&mine.begun_, &theirs.begun_},
             {&mine.ended_, &theirs.ended_}}};
  }

  UncertainList uncertain() const noexcept {
    if (!listed_) return {};
    return {uncertain_.template as<Pair>(), list_capacity_,
            uncertain_counts_.template as<EventCounts>()};
  }
  void clear_uncertain() noexcept {
    listed_ = false;
    updates_kept_ = dense_updates_left_ = 0;
    list_size_ = unknown;
  }
  // After an update in which most of the list had moved, the next ones are assumed to be the same.
  void note_density(std::uint64_t comparisons) {
    if (list_size_ == unknown)
      list_size_ = device_.read(*uncertain_counts_.template as<EventCounts>()).count;
    if (dense_updates_left_ != 0)
      --dense_updates_left_;
    else if (comparisons > list_size_ - list_size_ / 4)
      dense_updates_left_ = 7;
  }

  // Per-tile counts, with one entry more, and places.
  void reserve_tiles(std::uint64_t tiles) {
    const auto sums = static_cast<std::size_t>(2 * tiles + 1);
    tiles_.ensure((sums + static_cast<std::size_t>(tiles)) * sizeof(std::uint32_t));
    scratch_.ensure(Device::scan_bytes(sums));
  }
  Tiles tiles_of(const DeviceBuffer<Device>& out, std::uint64_t tiles,
                 EventCounts* report) const noexcept {
    auto* begins = tiles_.template as<std::uint32_t>();
    return {out.template as<Pair>(),
            CandidateFinder<Device>::capacity_of(out),
            begins,
            begins + 2 * tiles + 1,
            tiles,
            report};
  }
  void gather_changes(const Retest& retest, UpdateReport* report) const {
    const std::uint64_t n = candidates_.count;
    device_.gather(n, retest, tiles_of(changes_, Tiles::of(n), &report->changed));
  }
  TileWalk scan_tiles(const Tiles& t) const {
    const auto sums = static_cast<std::size_t>(2 * t.tiles + 1);
    device_.use_scratch(scratch_.template as<char>(), scratch_.bytes());
    device_.scan(t.begins, sums);
    return {t.out, t.begins, t.bases, t.tiles};
  }
  void reserve_changes(std::uint64_t count) {
    changes_.ensure(static_cast<std::size_t>(count + count / 8 + 1024) * sizeof(Pair));
  }
  // Prefix sums of n flags, which launch(flags) sets; the sum is below 2^32.
  template <class F>
  std::uint32_t* sums_of(std::uint64_t n, const F& launch) {
    const auto count = static_cast<std::size_t>(n);
    auto* flags = reinterpret_cast<std::uint32_t*>(flags_.ensure(count * sizeof(std::uint32_t)));
    const std::size_t bytes = Device::scan_bytes(count);
    device_.use_scratch(scratch_.ensure(bytes), bytes);
    launch(flags);
    device_.scan(flags, count);
    return flags;
  }

  // `now`, in next_, becomes the candidates. If few boxes left their fat boxes, only the device has
  // the number of candidates kept; kept plus `fresh` is the total, at most now.count.
  void commit_next(Candidates now, const ObjectView& objects, const std::uint32_t* kept,
                   std::uint64_t fresh, bool filters_changed, UpdateReport* report, Result& r) {
    clear_uncertain();
    const Candidates before = candidates_.list();
    const std::uint64_t first = Tiles::of(now.count), tiles = first + Tiles::of(before.count);
    reserve_tiles(tiles);
    EventCounts changed;
    for (;;) {
      device_.clear(&report->changed, sizeof(EventCounts));
      const Tiles to = tiles_of(changes_, tiles, &report->changed);
      device_.gather(now.count, FindBegun{now, objects, kept, fresh}, to);
      device_.gather(before.count,
                     FindEnded{before, now, objects, kept != nullptr, filters_changed},
                     to.after(first));
      const UpdateReport seen = device_.read(*report);
      changed = seen.changed;
      if (changed.count <= CandidateFinder<Device>::capacity_of(changes_)) {
        if (kept) now.count = seen.kept + fresh;
        break;
      }
      reserve_changes(changed.count);
    }
    r.comparisons = changed.comparisons;
    commit(changed, now, tiles);
    next_.count = now.count;
    next_.swap(candidates_);
  }

  // `now` replaces the candidates. Assigns and frees slots for the changes that were gathered in
  // `tiles` tiles. All allocations precede the first modification.
  void commit(const EventCounts& changed, const Candidates& now, std::uint64_t tiles) {
    if (changed.count >= no_slot)
      throw Failure{Status::out_of_memory, changed.count * sizeof(LivePair)};
    if (changed.count == 0) {
      begun_.count = ended_.count = 0;
      return;
    }
    const auto begun = static_cast<std::uint32_t>(changed.begun);
    const auto ended = static_cast<std::uint32_t>(changed.count - changed.begun);
    const std::uint32_t reused = std::min(begun, free_count_);
    const std::uint64_t slots = std::uint64_t{slot_limit_} + begun - reused;
    if (slots >= no_slot) throw Failure{Status::out_of_memory, slots * slot_bytes};
    next_begun_.ensure(begun);
    next_ended_.ensure(ended);
    free_slots_.grow(static_cast<std::size_t>(slots) * slot_bytes, free_count_ * slot_bytes);
    // No allocation from here on.
    auto* b = next_begun_.block.template as<LivePair>();
    auto* e = next_ended_.block.template as<LivePair>();
    auto* free_slots = free_slots_.template as<std::uint32_t>();
    const TileWalk walk = scan_tiles(tiles_of(changes_, tiles, nullptr));
    if (begun)
      device_.launch(walk.count(), AssignSlots{walk, now, free_slots, free_count_, slot_limit_, b});
    free_count_ -= reused;
    if (ended)
      device_.launch(walk.count(),
                     FreeSlots{walk, candidates_.list(), now, free_slots + free_count_, e});
    free_count_ += ended;
    slot_limit_ = static_cast<std::uint32_t>(slots);
    count_ = count_ + begun - ended;
    next_begun_.count = begun;
    next_ended_.count = ended;
    begun_.swap(next_begun_);
    ended_.swap(next_ended_);
    gathered_ = false;
  }

  Device& device_;
  List candidates_{device_}, next_{device_};
  List begun_{device_}, ended_{device_}, next_begun_{device_}, next_ended_{device_};
  List pairs_{device_};
  DeviceBuffer<Device> free_slots_{device_};
  CandidateFinder<Device> finder_{device_};
  // Scratch of a call.
  DeviceBuffer<Device> changes_{device_}, flags_{device_}, scratch_{device_}, tiles_{device_};
  DeviceBuffer<Device> uncertain_{device_}, uncertain_counts_{device_};
  std::uint64_t count_ = 0;
  std::uint32_t slot_limit_ = 0, free_count_ = 0;
  bool gathered_ = false;
  // Whether uncertain_ holds the uncertain candidates; below, updates since the candidates changed.
  bool listed_ = false;
  std::uint64_t list_capacity_ = 0, list_size_ = unknown;
  unsigned updates_kept_ = 0, dense_updates_left_ = 0;
};

}  // namespace throng::device
