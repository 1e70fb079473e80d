// Pairs that live in a device's memory: candidates, slots, and what the last update told.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "pipeline/block.hpp"
#include "pipeline/live_objects.hpp"
#include "pipeline/live_pair_stages.hpp"
#include "pipeline/order.hpp"
#include "pipeline/pipeline.hpp"

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

  // Makes room for the changes that there usually are, and puts a comparison of the candidates on
  // the device, which depends on what told->checked says by then.
  void prepare_retest() { changes_.room((candidates_.count / 8 + 1024) * sizeof(Pair)); }
  void put_retest(const LiveView& live, LiveTold* told, bool nan_allowed, bool moved_before) const {
    look(Retest{candidates_.list(), live, &told->checked, nan_allowed, moved_before},
         &told->report);
  }

  // Takes what changed, of which the report tells; where there was no room for it, it is found
  // again. `live` is as put_retest had it.
  void commit_retest(const LiveView& live, const Report& found, LiveTold* told) {
    if (found.found > room_for_changes()) {
      make_room_for_changes(found.found);
      device_.clear(&told->report, sizeof(Report));
      look(Retest{candidates_.list(), live, nullptr, true, true}, &told->report);
    }
    commit(found.found, candidates_.list(), live.limit, &told->report);
  }

  // Finds all candidates anew, of fat boxes, and takes what changed.
  void commit_found(const Boxes& fat, const LiveView& live, const Options& options, LiveTold* told,
                    Result& r) {
    const std::uint64_t found = find_candidates(fat, options, r);
    next_.room(found);
    const auto before = candidates_.list();
    const Candidates now{next_.block.template as<LivePair>(), found};
    device_.launch(found, CarrySlots{found_.template as<Pair>(), before, now.pairs});
    std::uint64_t changes = 0;
    for (;;) {
      device_.clear(&told->report, sizeof(Report));
      look(Retest{now, live, nullptr, true, true}, &told->report);
      look(Vanished{before, now}, &told->report);
      const Report report = device_.read(told->report);
      r.comparisons += report.comparisons;
      changes = report.found;
      if (changes <= room_for_changes()) break;
      make_room_for_changes(changes);
    }
    commit(changes, now, live.limit, &told->report);
    next_.count = found;
    next_.swap(candidates_);
  }

  // In canonical order; put together where it was not since the last change.
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
  }

  std::size_t held() const noexcept {
    std::size_t sum = 0;
    for (const Block<Device>* b :
         {&workspace_, &found_, &sorting_, &changes_, &flags_, &scratch_, &free_slots_,
          &candidates_.block, &next_.block, &begun_.block, &ended_.block, &next_begun_.block,
          &next_ended_.block, &pairs_.block})
      sum += b->bytes();
    return sum;
  }

 private:
  static constexpr std::size_t slot_bytes = sizeof(std::uint32_t);

  struct List {
    explicit List(Device& device) noexcept : block(device) {}
    LivePairs view() const noexcept {
      return {block.template as<LivePair>(), static_cast<std::size_t>(count)};
    }
    Candidates list() const noexcept { return {block.template as<LivePair>(), count}; }
    // What it holds is lost.
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

  template <class Look>
  void look(const Look& each, Report* report) const {
    const std::uint64_t n = each.bound();
    if (n)
      device_.search(n, EachOnce<Look>{each},
                     {changes_.template as<Pair>(), room_for_changes(), report});
  }
  std::uint64_t room_for_changes() const noexcept { return changes_.bytes() / sizeof(Pair); }
  void make_room_for_changes(std::uint64_t count) {
    changes_.room(static_cast<std::size_t>(count + count / 8 + 1024) * sizeof(Pair));
  }

  // Sums of flags, which put(flags) sets: n of them, whose sum is below 2^32.
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

  // In canonical order, in found_; tells how many.
  std::uint64_t find_candidates(const Boxes& fat, const Options& options, Result& r) {
    if (fat.empty()) return 0;
    Options plain;
    plain.algorithm = options.algorithm;
    plain.cell_scale = options.cell_scale;
    const Input in = make_input(fat, nullptr, plain);
    const bool brute = Pipeline<Device>::brute_force(in, plain.algorithm);
    Workspace w;
    w.carve(in.count, workspace_.room(w.carve(in.count, nullptr, Device::scan_bytes)),
            Device::scan_bytes);
    const Pipeline<Device> pipeline(device_);
    pipeline.build(in, brute, w);
    found_.room((std::size_t{4} * in.count + 512) * sizeof(Pair));
    std::uint64_t found = 0;
    for (;;) {
      const std::uint64_t room = found_.bytes() / sizeof(Pair);
      device_.clear(&w.report->found, sizeof w.report->found);
      pipeline.find(in, brute, w, {found_.template as<Pair>(), room, w.report});
      found = device_.read(*w.report).found;
      if (found <= room) break;
      found_.room(static_cast<std::size_t>(found + found / 8 + 512) * sizeof(Pair));
    }
    r.plan.algorithm = brute ? Algorithm::all_pairs : Algorithm::grid;
    sort(found_, found, in, w.report);
    return found;
  }
  void sort(Block<Device>& pairs, std::uint64_t count, const Input& in, const Report* report) {
    const auto n = static_cast<std::size_t>(count);
    const std::size_t bytes = Device::sort_bytes(n);
    auto* p = pairs.template as<Pair>();
    device_.sort(p, bytes ? sorting_.room(bytes) : nullptr, bytes, p, n, n, report, in);
  }

  // `now` takes the place of the candidates: what changed gets and gives back its slots. All
  // memory is asked for before the first of these.
  void commit(std::uint64_t changes, const Candidates& now, std::uint32_t limit,
              const Report* report) {
    if (changes >= no_slot) throw Failure{Status::out_of_memory, changes * sizeof(LivePair)};
    if (changes == 0) {
      begun_.count = ended_.count = 0;
      return;
    }
    Input in;
    in.count = in.first_count = limit;
    sort(changes_, changes, in, report);
    const auto* changed = changes_.template as<Pair>();
    const Candidates before = candidates_.list();
    const std::uint32_t* sums = sums_of(changes + 1, [&](std::uint32_t* flags) {
      device_.launch(changes + 1, FlagBegun{changed, changes, before, flags});
    });
    const std::uint32_t begun = device_.read(sums[changes]);
    const auto ended = static_cast<std::uint32_t>(changes - begun);
    const std::uint32_t reused = std::min(begun, free_count_);
    const std::uint64_t slots = std::uint64_t{slot_limit_} + begun - reused;
    if (slots >= no_slot) throw Failure{Status::out_of_memory, slots * slot_bytes};
    next_begun_.room(begun);
    next_ended_.room(ended);
    free_slots_.grow(static_cast<std::size_t>(slots) * slot_bytes, free_count_ * slot_bytes);
    // From here on nothing is asked for.
    auto* b = next_begun_.block.template as<LivePair>();
    auto* e = next_ended_.block.template as<LivePair>();
    auto* free_slots = free_slots_.template as<std::uint32_t>();
    device_.launch(changes, SplitChanges{changed, before, sums, b, e});
    device_.launch(begun, GiveSlots{b, now, free_slots, free_count_, slot_limit_});
    free_count_ -= reused;
    device_.launch(ended, TakeSlots{e, now, free_slots + free_count_});
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
  // Of a call.
  Block<Device> workspace_{device_}, found_{device_}, sorting_{device_}, changes_{device_},
      flags_{device_}, scratch_{device_};
  std::uint64_t count_ = 0;
  std::uint32_t slot_limit_ = 0, free_count_ = 0;
  bool gathered_ = false;
};

}  // namespace throng::pipeline
