// Pairs of persistent objects in device memory: candidates, slots and the last update's events.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "pipeline/block.hpp"
#include "pipeline/live_candidates.hpp"
#include "pipeline/live_objects.hpp"
#include "pipeline/live_pair_stages.hpp"
#include "pipeline/live_stray_stages.hpp"

namespace throng::pipeline {

template <class Device>
class LivePairSet {
 public:
  explicit LivePairSet(Device& device) noexcept : device_(device) {}

  std::uint64_t count() const noexcept { return count_; }
  std::uint64_t candidate_count() const noexcept { return candidates_.count; }
  std::uint32_t slot_limit() const noexcept { return slot_limit_; }
  LivePairs begun() const noexcept { return begun_.view(); }
  LivePairs ended() const noexcept { return ended_.view(); }
  LivePairs candidates() const noexcept { return candidates_.view(); }

  // prepare_retest() reserves capacity for the usual number of changes. put_retest() launches a
  // comparison of the candidates, which depends on the device's value of `checked`, if that is not
  // null. told->changed is zero.
  void prepare_retest() {
    changes_.room((candidates_.count / 8 + 1024) * sizeof(Pair));
    make_room_for_tiles(Tiles::of(candidates_.count));
  }
  void put_retest(const LiveView& live, LiveTold* told, const Checked* checked, bool nan_allowed,
                  bool moved_before, bool gone_before) const {
    Retest retest{candidates_.list(), live, checked, nan_allowed, moved_before};
    if (!gone_before) retest.doubtful = doubtful();
    retest.all_listed = dense_ != 0;
    gather_changes(retest, told);
  }

  // Applies the changes that `changed` counts; if they did not fit, gathers them again. `live` is
  // as in put_retest(); `gone`: of objects.gone() now.
  void commit_retest(const LiveView& live, Changed changed, bool gone, LiveTold* told) {
    // On a failure, and if the list was not used, the list's pair flags are invalid.
    const bool listed = listed_ && !gone;
    listed_ = false;
    if (changed.count > CandidateFinder<Device>::room_of(changes_)) {
      make_room_for_changes(changed.count);
      device_.clear(&told->changed, sizeof(Changed));
      gather_changes(Retest{candidates_.list(), live, nullptr, true, true}, told);
      changed = device_.read(told->changed);
    }
    commit(changed, candidates_.list(), Tiles::of(candidates_.count));
    if (listed) note_density(changed.comparisons);
    listed_ = listed;
  }
  // After an update that kept all candidates: lists the uncertain ones, once candidates have been
  // kept for a while, so that it pays off. Asynchronous.
  void list_doubtful(const LiveView& live) {
    if (listed_ || candidates_.count == 0 || ++calm_ < 2) return;
    const std::uint64_t n = candidates_.count, tiles = Tiles::of(n);
    const auto bytes = static_cast<std::size_t>(n / 8 * 5 + 1024) * sizeof(Pair);
    try {
      doubtful_.room(bytes);
      finder_.scratch().room(bytes);
      doubtful_told_.room(sizeof(Changed));
      make_room_for_tiles(tiles);
    } catch (const Failure&) {
      return;  // the list is optional
    }
    list_size_ = unknown;
    auto* told = doubtful_told_.template as<Changed>();
    device_.clear(told, sizeof(Changed));
    const Tiles to = tiles_of(finder_.scratch(), tiles, told);
    device_.gather(n, LookForDoubtful{candidates_.list(), live}, to);
    listed_ = true;
    const TileWalk walk = sum_up(to);
    list_room_ = std::min(CandidateFinder<Device>::room_of(doubtful_), to.capacity);
    device_.launch(walk.count(), ListDoubtful{walk, doubtful()});
  }

  // Finds all candidates of the fat boxes again and applies the changes.
  void commit_found(const Boxes& fat, const LiveView& live, const Options& options, bool refiltered,
                    LiveTold* told, Result& r) {
    const std::uint64_t found = finder_.find_all(fat, options, r);
    next_.room(found);
    const Candidates now{next_.block.template as<LivePair>(), found};
    device_.launch(found, CarrySlots{finder_.found(), candidates_.list(), now.pairs});
    commit_next(now, live, nullptr, found, refiltered, told, r);
  }

  // For few boxes that left theirs. Returns false if they are too many or there is no grid. Calls
  // begin() before fat boxes change.
  template <class Begin>
  bool commit_strays(const LiveView& live, LiveTold* told, const Begin& begin, Result& r) {
    std::uint64_t fresh = 0;
    if (candidates_.count >= no_slot || !finder_.find_few(live, told, begin, fresh)) return false;
    const Candidates before = candidates_.list();
    const std::uint32_t* sums = sums_of(before.count + 1, [&](std::uint32_t* flags) {
      device_.launch(before.count + 1, FlagKept{before, live.state, flags});
    });
    next_.room(before.count + fresh);
    const Candidates now{next_.block.template as<LivePair>(), before.count + fresh};
    const Pair* added = finder_.fresh();
    device_.launch(before.count, MergeKept{before, {added, fresh}, sums, now.pairs});
    device_.launch(fresh, MergeFresh{before, added, sums, now.pairs});
    device_.copy(&told->kept, sums + before.count, sizeof told->kept);
    commit_next(now, live, &told->kept, fresh, false, told, r);
    return true;
  }

  // Sorted; compacted on the first call after a change.
  LivePairs pairs() {
    if (count_ == candidates_.count) return candidates_.view();
    if (!gathered_) {
      const std::uint64_t n = candidates_.count;
      auto* sums = sums_of(n + 1, [&](std::uint32_t* flags) {
        device_.launch(n + 1, FlagLive{candidates_.list(), flags});
      });
      pairs_.room(count_);
      device_.launch(n, GatherLive{candidates_.list(), sums, pairs_.block.template as<LivePair>()});
      pairs_.count = count_;
      gathered_ = true;
    }
    return pairs_.view();
  }

  void reserve_for(const LivePairSet& other) {
    for (const auto& [mine, theirs] : lists(*this, other))
      mine->block.grow(theirs->count * sizeof(LivePair), mine->count * sizeof(LivePair));
    free_slots_.grow(other.slot_limit_ * slot_bytes, free_count_ * slot_bytes);
  }
  void copy(const LivePairSet& other) {
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
    forget_doubtful();
  }

  std::size_t held() const noexcept {
    std::size_t sum = finder_.held();
    for (const Block<Device>* b :
         {&candidates_.block, &next_.block, &begun_.block, &ended_.block, &next_begun_.block,
          &next_ended_.block, &pairs_.block, &free_slots_, &changes_, &flags_, &scratch_, &tiles_,
          &doubtful_, &doubtful_told_})
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
    void room(std::uint64_t wanted) {
      const auto bytes = static_cast<std::size_t>(wanted) * sizeof(LivePair);
      if (bytes > block.bytes()) count = 0;
      if (bytes > block.bytes()) block.room(bytes + bytes / 8);
    }
    void swap(List& other) noexcept {
      block.swap(other.block);
      std::swap(count, other.count);
    }
    Block<Device> block;
    std::uint64_t count = 0;
  };
  template <class Mine, class Theirs>
  static std::array<std::pair<List*, const List*>, 3> lists(Mine& mine, Theirs& theirs) noexcept {
    return {{{&mine.candidates_, &theirs.candidates_},
             {&mine.begun_, &theirs.begun_},
             {&mine.ended_, &theirs.ended_}}};
  }

  Doubtful doubtful() const noexcept {
    if (!listed_) return {};
    return {doubtful_.template as<Pair>(), list_room_, doubtful_told_.template as<Changed>()};
  }
  void forget_doubtful() noexcept {
    listed_ = false;
    calm_ = dense_ = 0;
    list_size_ = unknown;
  }
  // After an update in which most of the list had moved, the next ones are assumed to be the same.
  void note_density(std::uint64_t comparisons) {
    if (list_size_ == unknown)
      list_size_ = device_.read(*doubtful_told_.template as<Changed>()).count;
    if (dense_ != 0)
      --dense_;
    else if (comparisons > list_size_ - list_size_ / 4)
      dense_ = 7;
  }

  // Per-tile counts, with one entry more, and places.
  void make_room_for_tiles(std::uint64_t tiles) {
    const auto sums = static_cast<std::size_t>(2 * tiles + 1);
    tiles_.room((sums + static_cast<std::size_t>(tiles)) * sizeof(std::uint32_t));
    scratch_.room(Device::scan_bytes(sums));
  }
  Tiles tiles_of(const Block<Device>& out, std::uint64_t tiles, Changed* told) const noexcept {
    auto* begins = tiles_.template as<std::uint32_t>();
    return {out.template as<Pair>(),
            CandidateFinder<Device>::room_of(out),
            begins,
            begins + 2 * tiles + 1,
            tiles,
            told};
  }
  void gather_changes(const Retest& retest, LiveTold* told) const {
    const std::uint64_t n = candidates_.count;
    device_.gather(n, retest, tiles_of(changes_, Tiles::of(n), &told->changed));
  }
  TileWalk sum_up(const Tiles& t) const {
    const auto sums = static_cast<std::size_t>(2 * t.tiles + 1);
    device_.use_scratch(scratch_.template as<char>(), scratch_.bytes());
    device_.scan(t.begins, sums);
    return {t.out, t.begins, t.bases, t.tiles};
  }
  void make_room_for_changes(std::uint64_t count) {
    changes_.room(static_cast<std::size_t>(count + count / 8 + 1024) * sizeof(Pair));
  }
  // Prefix sums of n flags, which put(flags) sets; the sum is below 2^32.
  template <class F>
  std::uint32_t* sums_of(std::uint64_t n, const F& put) {
    const auto count = static_cast<std::size_t>(n);
    auto* flags = reinterpret_cast<std::uint32_t*>(flags_.room(count * sizeof(std::uint32_t)));
    const std::size_t bytes = Device::scan_bytes(count);
    device_.use_scratch(scratch_.room(bytes), bytes);
    put(flags);
    device_.scan(flags, count);
    return flags;
  }

  // `now`, in next_, becomes the candidates. If few boxes left their fat boxes, only the device has
  // the number of candidates kept; kept plus `fresh` is the total, at most now.count.
  void commit_next(Candidates now, const LiveView& live, const std::uint32_t* kept,
                   std::uint64_t fresh, bool refiltered, LiveTold* told, Result& r) {
    forget_doubtful();
    const Candidates before = candidates_.list();
    const std::uint64_t first = Tiles::of(now.count), tiles = first + Tiles::of(before.count);
    make_room_for_tiles(tiles);
    Changed changed;
    for (;;) {
      device_.clear(&told->changed, sizeof(Changed));
      const Tiles to = tiles_of(changes_, tiles, &told->changed);
      device_.gather(now.count, LookForBegun{now, live, kept, fresh}, to);
      device_.gather(before.count, LookForEnded{before, now, live, kept != nullptr, refiltered},
                     to.after(first));
      const LiveTold seen = device_.read(*told);
      changed = seen.changed;
      if (changed.count <= CandidateFinder<Device>::room_of(changes_)) {
        if (kept) now.count = seen.kept + fresh;
        break;
      }
      make_room_for_changes(changed.count);
    }
    r.comparisons = changed.comparisons;
    commit(changed, now, tiles);
    next_.count = now.count;
    next_.swap(candidates_);
  }

  // `now` replaces the candidates. Assigns and frees slots for the changes that were gathered in
  // `tiles` tiles. All allocations precede the first modification.
  void commit(const Changed& changed, const Candidates& now, std::uint64_t tiles) {
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
    next_begun_.room(begun);
    next_ended_.room(ended);
    free_slots_.grow(static_cast<std::size_t>(slots) * slot_bytes, free_count_ * slot_bytes);
    // No allocation from here on.
    auto* b = next_begun_.block.template as<LivePair>();
    auto* e = next_ended_.block.template as<LivePair>();
    auto* free_slots = free_slots_.template as<std::uint32_t>();
    const TileWalk walk = sum_up(tiles_of(changes_, tiles, nullptr));
    if (begun)
      device_.launch(walk.count(), GiveSlots{walk, now, free_slots, free_count_, slot_limit_, b});
    free_count_ -= reused;
    if (ended)
      device_.launch(walk.count(),
                     TakeSlots{walk, candidates_.list(), now, free_slots + free_count_, e});
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
  Block<Device> free_slots_{device_};
  CandidateFinder<Device> finder_{device_};
  // Scratch of a call.
  Block<Device> changes_{device_}, flags_{device_}, scratch_{device_}, tiles_{device_};
  Block<Device> doubtful_{device_}, doubtful_told_{device_};
  std::uint64_t count_ = 0;
  std::uint32_t slot_limit_ = 0, free_count_ = 0;
  bool gathered_ = false;
  // Whether doubtful_ holds the uncertain candidates; below, updates since the candidates changed.
  bool listed_ = false;
  std::uint64_t list_room_ = 0, list_size_ = unknown;
  unsigned calm_ = 0, dense_ = 0;
};

}  // namespace throng::pipeline
