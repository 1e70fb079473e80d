#include "broad_phase/call_sequence.hpp"

#include <cmath>
#include <memory>

#include "broad_phase/model.hpp"
#include "broad_phase/query_reference.hpp"
#include "broad_phase/snapshot.hpp"

namespace throng::tests {
namespace {

void must(const testing::AssertionResult& r) {
  if (!r) throw Difference(r.message());
}
void must(bool good, const char* what) {
  if (!good) throw Difference(what);
}

// Integers; sometimes an ulp off, or the largest floats.
float coordinate(Bytes& bytes) {
  const std::uint32_t b = bytes.next();
  const float ends[] = {-INFINITY, INFINITY, 1e30f, -1e30f, 0x1p-149f, -0.0f, 3e7f, 16777216.0f};
  if (b >= 248) return ends[b - 248];
  const float x = static_cast<float>(b % 31) - 15;
  return b / 31 == 7 ? nudge(x, static_cast<int>(bytes.next() % 5) - 2) : x;
}

Box any_box(Bytes& bytes) {
  const std::uint32_t kind = bytes.next();
  const float side = static_cast<float>(kind & 7) * ((kind & 8) ? 0.25f : 1.0f);
  Box b{{coordinate(bytes), coordinate(bytes), coordinate(bytes)}, {}};
  b.upper = {b.lower.x + side, b.lower.y + side, b.lower.z + side};
  if (kind >= 240) b.upper = {coordinate(bytes), coordinate(bytes), coordinate(bytes)};
  return b;
}
bool has_nan(const Box& b) {
  return std::isnan(b.upper.x) || std::isnan(b.upper.y) || std::isnan(b.upper.z);
}

Filter any_filter(Bytes& bytes) {
  Filter f;
  const std::uint32_t b = bytes.next();
  if (b & 1) f.group = 1u << (b >> 1 & 3);
  if (b & 8) f.mask = bytes.next();
  if (b & 16) f.owner = static_cast<std::int32_t>(bytes.next() % 4) - 1;
  if (b & 32) f.world = static_cast<std::int32_t>(bytes.next() % 4) - 1;
  f.is_static = b >> 7;
  return f;
}

class CallSequence {
 public:
  explicit CallSequence(Bytes& bytes) : bytes_(bytes), flags_(bytes.next()), model_(margin()) {
    Options options;
    options.threads = 1;
    options.margin = margin();
    phase_ = BroadPhase(options);
  }

  CallSequenceCounts run() {
    while (!bytes_.empty() && count_.updates < 64) step();
    update();
    return count_;
  }

 private:
  float margin() const { return (flags_ & 3) == 3 ? 0.3f : 0.0f; }

  void step() {
    const ObjectId id = one();
    const bool any = model_.count() != 0;
    const std::uint32_t call = bytes_.next() % 20;
    if (call < 4) {
      add(call);
    } else if (call == 4 && any) {
      must(phase_.remove(id) == Status::ok, "remove");
      model_.remove(id);
    } else if (call == 5 && any) {
      const Filter f = any_filter(bytes_);
      must(phase_.set_filter(id, f) == Status::ok, "set_filter");
      model_.at(id).filter = f;
    } else if (call == 6) {
      invalid_call();
    } else if (call == 7) {
      phase_ = BroadPhase(phase_);
    } else if (call < 12 && any) {
      const Box to = any_box(bytes_);
      must(phase_.move(id, to) == (has_nan(to) ? Status::nan_box : Status::ok), "move");
      if (!has_nan(to)) model_.at(id).box = to;
    } else if (call == 12) {
      move_all();
    } else if (call == 13) {
      shift();
    } else if (call == 14) {
      query_overlaps();
    } else if (call == 15) {
      query_hits();
    } else {
      update();
    }
  }

  ObjectId one() {
    const std::vector<ObjectId> ids = model_.ids();
    return ids.empty() ? 0 : ids[bytes_.next() % ids.size()];
  }

  // A row of equal boxes: from few input bytes, enough objects for incremental updates.
  void add(std::uint32_t call) {
    Box next = any_box(bytes_);
    const Filter f = call == 3 ? any_filter(bytes_) : Filter{};
    for (std::uint32_t k = call == 0 ? 32 : 1; k > 0 && model_.count() < 150; --k) {
      ObjectId got = 0;
      const Status s = phase_.add(next, f, got);
      must(s == (has_nan(next) ? Status::nan_box : Status::ok), "add");
      if (has_nan(next)) break;
      must(model_.add(got, next, f));
      next.lower.x += 1;
      next.upper.x += 1;
    }
  }

  // Moves every n-th box by one, and passes the others unchanged.
  void move_all() {
    const std::uint32_t each = 1 + bytes_.next() % 16;
    const float by = static_cast<float>(bytes_.next() % 5) - 2;
    std::vector<Box> boxes(model_.limit());
    for (const ObjectId id : model_.ids()) {
      Box& box = model_.at(id).box;
      if (id % each == 0) box.lower.y += by, box.upper.y += by;
      boxes[id] = box;
    }
    must(model_.check_call(phase_.move_all(boxes)));
  }

  void shift() {
    const Vec3 by = {static_cast<float>(bytes_.next()) - 128, 0.1f, -3};
    must(model_.check_call(phase_.shift_origin(by)));
    for (const ObjectId id : model_.ids()) {
      Box& b = model_.at(id).box;
      b = shifted_box(b, by);
    }
  }

  void query_overlaps() {
    const bool filtered = bytes_.next() & 1;
    std::vector<Box> boxes;
    std::vector<Filter> filters;
    for (std::uint32_t k = 1 + bytes_.next() % 6; k > 0; --k) {
      const Box box = any_box(bytes_);
      const Filter f = any_filter(bytes_);
      if (has_nan(box)) continue;
      boxes.push_back(box);
      filters.push_back(f);
    }
    if (boxes.empty()) return;
    if (++count_.queries % 2)
      must(same_overlaps(phase_, model_, boxes, filters, filtered));
    else
      must(same_overlaps(client_, model_, boxes, filters, filtered));
  }

  void query_hits() {
    std::vector<Sweep> sweeps;
    std::vector<Filter> filters;
    for (std::uint32_t k = 1 + bytes_.next() % 6; k > 0; --k) {
      Sweep s{any_box(bytes_), {}};
      const std::uint32_t kind = bytes_.next();
      float* by = &s.by.x;
      for (int axis = 0; axis < 3; ++axis) {
        by[axis] = static_cast<float>(bytes_.next() % 17) - 8;
        if (kind >= 250) by[axis] *= 1e30f;
      }
      if (kind & 1) s.box.upper = s.box.lower;  // a ray
      const Filter f = any_filter(bytes_);
      if (has_nan(s.box)) continue;
      sweeps.push_back(s);
      filters.push_back(f);
    }
    if (sweeps.empty()) return;
    if (++count_.queries % 2)
      must(same_hits(phase_, model_, sweeps, filters));
    else
      must(same_hits(client_, model_, sweeps, filters));
  }

  void invalid_call() {
    const Snapshot before(phase_);
    const std::uint32_t what = bytes_.next();
    const ObjectId id = bytes_.next() * 7;
    const Box nan{{0, 0, NAN}, {1, 1, 1}}, some{{0, 0, 0}, {1, 1, 1}};
    Status status = Status::busy;
    if (what % 4 == 0) {
      status = phase_.add(nan, {}, *std::make_unique<ObjectId>());
    } else if (model_.alive(id)) {
      const ObjectId twice[] = {id, id};
      const Box two[] = {some, some};
      status = what % 4 == 1   ? phase_.move(id, nan)
               : what % 4 == 2 ? phase_.remove(twice, 2).status
                               : phase_.move(twice, Boxes(two, 2)).status;
    } else {
      status = what % 2 ? phase_.remove(id) : phase_.move(id, some);
    }
    must(status == Status::nan_box || status == Status::bad_id, "an invalid call was not refused");
    must(Snapshot(phase_) == before, "a refused call changed something");
  }

  void update() {
    const Result r = phase_.update();
    model_.update();
    must(model_.check_update(r));
    must(model_.check(phase_, bytes_.next() % 2 == 0));
    for (std::uint64_t i = 0; i < 4 && model_.limit() != 0; ++i) {
      const std::uint64_t id = (5 * count_.updates + i) % model_.limit();
      must(model_.check_pairs_of(phase_, static_cast<ObjectId>(id)));
    }
    ++count_.updates;
    count_.boxes += model_.count();
    count_.pairs += phase_.pair_count();
  }

  Bytes& bytes_;
  std::uint32_t flags_;
  BroadPhase phase_;
  BroadPhaseQuery query_;  // used by every other query
  QueryClient client_{phase_, query_};
  Model model_;
  CallSequenceCounts count_;
};

}  // namespace

CallSequenceCounts run_call_sequence(Bytes& bytes) { return CallSequence(bytes).run(); }

}  // namespace throng::tests
