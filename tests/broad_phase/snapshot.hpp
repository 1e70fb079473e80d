// The observable state of a BroadPhase, for comparisons.
#pragma once

#include <cstring>
#include <ostream>
#include <string>
#include <tuple>
#include <vector>

#include <throng/throng.hpp>

namespace throng::tests {

// Pairs with their slots, for comparisons.
using Row = std::tuple<ObjectId, ObjectId, std::uint32_t>;
inline std::vector<Row> rows(const LivePairs& pairs) {
  std::vector<Row> all;
  for (const LivePair& p : pairs) all.emplace_back(p.first, p.second, p.slot);
  return all;
}
// Pairs without their slots.
inline std::vector<Pair> plain(const LivePairs& pairs) {
  std::vector<Pair> all;
  for (const LivePair& p : pairs) all.push_back({p.first, p.second});
  return all;
}

// Whether an update was incremental rather than a full search.
inline bool was_incremental(const Result& r) {
  return std::string(r.plan.reason).find("incremental") != std::string::npos;
}

struct Snapshot {
  explicit Snapshot(BroadPhase& b) {
    for (const LivePairs& list : {b.begun(), b.ended(), b.pairs()}) {
      put(list.size());
      for (const LivePair& p : list) put(p);
    }
    put(b.object_count());
    put(b.pair_count());
    put(b.id_limit());
    put(b.slot_limit());
    for (std::uint64_t i = 0; i < b.id_limit(); ++i) {
      const auto id = static_cast<ObjectId>(i);
      put(b.is_alive(id));
      if (!b.is_alive(id)) continue;
      const Filter f = b.filter(id);
      put(b.box(id));
      put(f.group), put(f.mask), put(f.owner), put(f.world), put(f.is_static);
    }
  }
  friend bool operator==(const Snapshot& a, const Snapshot& b) { return a.bytes_ == b.bytes_; }
  friend std::ostream& operator<<(std::ostream& out, const Snapshot& s) {
    return out << s.bytes_.size() << " bytes";
  }

 private:
  template <class T>
  void put(const T& value) {
    const auto* p = reinterpret_cast<const unsigned char*>(&value);
    bytes_.insert(bytes_.end(), p, p + sizeof value);
  }
  std::vector<unsigned char> bytes_;
};

}  // namespace throng::tests
