// Persistent objects on a device, emulated on the host: random calls, and the visible state.
#pragma once

#include <string>
#include <vector>

#include "broad_phase/actor.hpp"
#include "device/emulated_broad_phase.hpp"
#include "support/same_bits.hpp"

namespace throng::tests {

using DeviceActor = ActorOf<EmulatedBroadPhase>;

// Number of updates per kind of update.
struct UpdateCounts {
  std::size_t nothing = 0, compared = 0, repaired = 0, found = 0;
  void count(const std::string& reason) {
    nothing += reason == "nothing moved";
    compared += reason.find("compared again") != std::string::npos;
    repaired += reason.find("few boxes left") == 0;
    found += reason.find("all candidates found") == 0;
  }
};

// The whole visible state.
class VisibleState {
 public:
  explicit VisibleState(EmulatedBroadPhase& m) {
    for (const LivePairs& list : {m.begun(), m.ended(), m.pairs()}) {
      all_.insert(all_.end(), list.begin(), list.end());
      all_.push_back({no_id, no_id, static_cast<std::uint32_t>(list.size())});
    }
    all_.push_back({static_cast<ObjectId>(m.object_count()), static_cast<ObjectId>(m.id_limit()),
                    static_cast<std::uint32_t>(m.slot_limit())});
  }
  friend bool operator==(const VisibleState& a, const VisibleState& b) {
    return same_bytes(a.all_, b.all_);
  }

 private:
  static constexpr ObjectId no_id = 0xffffffffu;
  std::vector<LivePair> all_;
};

}  // namespace throng::tests
