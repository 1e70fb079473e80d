// Repeats the calls of a BroadPhase on several of them in lockstep. Each update is compared with
// two double loops: before and after.
#include <algorithm>
#include <cstring>
#include <iterator>

#include <fmt/format.h>

#include <throng/broad_phase.hpp>

#include "apps/report/format.hpp"
#include "apps/throng/failure.hpp"
#include "apps/throng/replay.hpp"

namespace throng::cli {
namespace {

using capture::Operation;
using scenes::Capture;
using scenes::CapturedCall;

constexpr const char* operation_names[capture::operation_count] = {
    "find",         "add",    "remove",        "move",      "move_all",      "set_filters",
    "shift_origin", "update", "find_overlaps", "find_hits", "restart (copy)"};

// The objects as plain arrays by id.
struct Model {
  std::vector<Box> boxes;
  std::vector<Filter> filters;
  std::vector<std::uint8_t> alive;
  std::vector<Pair> pairs;  // of the last update

  Boxes view(std::vector<Box>& storage) const {
    storage = boxes;
    for (std::size_t i = 0; i < storage.size(); ++i) {
      if (!alive[i]) storage[i] = {{1, 1, 1}, {0, 0, 0}};
    }
    Boxes v(storage.data(), storage.size());
    const std::size_t n = storage.size();
    if (n == 0) return v;
    const Filter* f = filters.data();
    v.filters = {{&f->group, n, sizeof(Filter)},
                 {&f->mask, n, sizeof(Filter)},
                 {&f->owner, n, sizeof(Filter)},
                 {&f->world, n, sizeof(Filter)},
                 {&f->is_static, n, sizeof(Filter)}};
    return v;
  }
  void put(ObjectId id, const Box& box, const Filter& filter) {
    if (id >= boxes.size()) {
      boxes.resize(id + std::size_t{1});
      filters.resize(boxes.size());
      alive.resize(boxes.size());
    }
    boxes[id] = box;
    filters[id] = filter;
    alive[id] = 1;
  }
};

void set(Filter& f, const Filters& from, std::size_t i) {
  if (from.group) f.group = from.group[i];
  if (from.mask) f.mask = from.mask[i];
  if (from.owner) f.owner = from.owner[i];
  if (from.world) f.world = from.world[i];
  if (from.is_static) f.is_static = from.is_static[i];
}

struct Replica {
  std::string name;
  BroadPhase broad_phase;
};

class Replay {
 public:
  Replay(const Capture& capture, const ReplayLimits& limits, ReplayReport& report)
      : capture_(capture), limits_(limits), report_(report), options_(capture.options) {
    options_.backend = Backend::automatic;
    for (const Isa isa : {Isa::automatic, Isa::scalar, Isa::avx2}) {
      for (const unsigned threads : {1u, 0u}) {
        Options o = options_;
        o.isa = isa;
        o.threads = threads;
        Replica replica{fmt::format("{}, {} threads", to_string(isa),
                                    threads ? fmt::to_string(threads) : "all"),
                        BroadPhase(o)};
        // Not every machine has all instruction sets.
        if (replica.broad_phase.update().ok()) replicas_.push_back(std::move(replica));
      }
    }
    if (replicas_.empty()) throw Failure("no BroadPhase can be made with the captured options");
  }

  void run() {
    std::size_t done = 0;
    for (const CapturedCall& call : capture_.calls) {
      at_ = done++;
      call_ = &call;
      if (!call.answer) end_replay("no result: the call did not return");
      // A failed call, as for lack of memory, changed nothing; here it need not fail.
      const bool failed = call.answer && call.answer->status != Status::ok;
      if (!failed) step(call);
      if (stop_ || report_.differs) break;
    }
    report_.text += fmt::format("{} calls, {} updates, on {} objects each; pairs by {}\n", done,
                                updates_, replicas_.size(), by_ ? by_ : "none: no update");
    report_.json["calls"] = done;
    report_.json["updates"] = updates_;
  }

 private:
  void end_replay(const std::string& why) {
    report_.text += fmt::format("call {} ({}): {}\n", at_, name(), why);
    report_.json["ends_with"] = why;
  }
  const char* name() const { return operation_names[static_cast<std::size_t>(call_->operation)]; }
  void differ(const std::string& who, const std::string& what) {
    if (report_.differs) return;
    report_.differs = true;
    const std::string text = fmt::format("call {} ({}), {}: {}", at_, name(), who, what);
    report_.text += text + "\n";
    report_.json["first_difference"] = text;
  }
  bool good(const Result& r, const Replica& replica) {
    if (!r.ok()) differ(replica.name, fmt::format("{}: {}", to_string(r.status), r.message));
    return r.ok();
  }
  // Whether the captured call returned the same.
  void compare_result(std::uint64_t found, std::uint64_t checksum, const char* what) {
    if (!call_->answer || !exact_) return;
    if (call_->answer->found != found || call_->answer->checksum != checksum)
      differ("the capture",
             fmt::format("{}: captured {}, here {}", what, call_->answer->found, found));
  }

  void step(const CapturedCall& call) {
    const Boxes boxes = call.sets.empty() ? Boxes() : call.sets[0].view();
    for (const ObjectId id : call.ids) {
      const bool exists = id < model_.alive.size() && model_.alive[id];
      if (call.operation != Operation::restart && !exists) {
        throw Failure(
            fmt::format("call {} ({}): id {} is not alive; the capture does not fit "
                        "together",
                        at_, name(), id));
      }
    }
    switch (call.operation) {
      case Operation::add:
        return add(boxes);
      case Operation::remove:
        for (Replica& p : replicas_)
          good(p.broad_phase.remove(call.ids.data(), call.ids.size()), p);
        for (const ObjectId id : call.ids) model_.alive[id] = 0;
        return;
      case Operation::move:
        for (Replica& p : replicas_) good(p.broad_phase.move(call.ids.data(), boxes), p);
        for (std::size_t i = 0; i < call.ids.size(); ++i) model_.boxes[call.ids[i]] = boxes[i];
        return;
      case Operation::move_all:
        for (Replica& p : replicas_) good(p.broad_phase.move_all(boxes), p);
        for (std::size_t i = 0; i < std::min(boxes.size(), model_.boxes.size()); ++i)
          model_.boxes[i] = boxes[i];
        return;
      case Operation::set_filters:
        for (Replica& p : replicas_)
          good(p.broad_phase.set_filters(call.ids.data(), call.ids.size(), boxes.filters), p);
        for (std::size_t i = 0; i < call.ids.size(); ++i)
          set(model_.filters[call.ids[i]], boxes.filters, i);
        return;
      case Operation::shift_origin:
        for (Replica& p : replicas_) good(p.broad_phase.shift_origin(call.by), p);
        // The sums are the machine's own: copied instead of recomputed.
        for (ObjectId id = 0; id < model_.boxes.size(); ++id)
          if (model_.alive[id]) model_.boxes[id] = replicas_[0].broad_phase.box(id);
        return;
      case Operation::update:
        return update();
      case Operation::find_overlaps:
        return overlaps(boxes);
      case Operation::find_hits:
        return hits(call, boxes.filters);
      case Operation::restart:
        return restart(call, boxes);
      case Operation::find:
        return;
    }
  }

  void add(const Boxes& boxes) {
    std::vector<ObjectId> ids(boxes.size()), first;
    for (Replica& p : replicas_) {
      if (!good(p.broad_phase.add(boxes, ids.data()), p)) return;
      if (&p == &replicas_[0]) first = ids;
      if (ids != first) differ(p.name, "ids differ from the first one's");
    }
    std::uint64_t id_checksum = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      Filter filter;
      set(filter, boxes.filters, i);
      model_.put(first[i], boxes[i], filter);
      id_checksum = capture::chain(id_checksum, first[i]);
    }
    if (call_->answer && !exact_ && call_->answer->checksum != id_checksum) {
      end_replay("a copy returns other ids than its original; replayed up to here");
      stop_ = true;
    }
    compare_result(replicas_[0].broad_phase.object_count(), id_checksum, "ids");
  }

  ExpectedPairs expected_pairs_of(const Boxes& a, const Boxes* b, float margin) {
    return make_expected_pairs(a, b, margin, limits_, by_);
  }

  static std::uint64_t checksum(std::uint64_t sum, const LivePairs& pairs) {
    for (const LivePair& pair : pairs) {
      sum = capture::chain(sum, std::uint64_t{pair.first} << 32 | pair.second);
      sum = capture::chain(sum, pair.slot);
    }
    return capture::chain(sum, pairs.size());
  }

  void compare_pairs(const Replica& replica, const char* which, const LivePairs& reported,
                     const std::vector<Pair>& wanted) {
    std::size_t k = 0;
    while (k < reported.size() && k < wanted.size() && reported[k].first == wanted[k].first &&
           reported[k].second == wanted[k].second)
      ++k;
    if (k == reported.size() && k == wanted.size()) return;
    const bool extra =
        k == wanted.size() ||
        (k < reported.size() &&
         (reported[k].first < wanted[k].first ||
          (reported[k].first == wanted[k].first && reported[k].second < wanted[k].second)));
    const Pair pair = extra ? Pair{reported[k].first, reported[k].second} : wanted[k];
    std::string text = fmt::format("{} {} ({}, {}); reported {}, wanted {}", which,
                                   extra ? "extra or twice" : "missing", pair.first, pair.second,
                                   reported.size(), wanted.size());
    for (const std::uint32_t id : {pair.first, pair.second}) {
      if (id < model_.boxes.size())
        text += fmt::format("\n  box {}\n{}", id, box_text(model_.boxes[id]));
    }
    differ(replica.name, text);
  }

  void update() {
    ++updates_;
    std::vector<Box> storage;
    const ExpectedPairs expected_pairs =
        expected_pairs_of(model_.view(storage), nullptr, options_.margin);
    const std::vector<Pair>& now = expected_pairs.pairs();
    std::vector<Pair> begun, ended;
    std::set_difference(now.begin(), now.end(), model_.pairs.begin(), model_.pairs.end(),
                        std::back_inserter(begun));
    std::set_difference(model_.pairs.begin(), model_.pairs.end(), now.begin(), now.end(),
                        std::back_inserter(ended));
    model_.pairs = now;
    for (Replica& p : replicas_) {
      const Result r = p.broad_phase.update();
      if (!good(r, p)) return;
      compare_pairs(p, "begun", p.broad_phase.begun(), begun);
      compare_pairs(p, "ended", p.broad_phase.ended(), ended);
      compare_pairs(p, "pairs", p.broad_phase.pairs(), now);
      if (r.found != now.size()) differ(p.name, fmt::format("reported {} pairs", r.found));
    }
    const BroadPhase& first = replicas_[0].broad_phase;
    compare_result(now.size(), checksum(checksum(0, first.begun()), first.ended()),
                   "begin and end events");
  }

  void overlaps(const Boxes& boxes) {
    std::vector<Box> storage;
    const Boxes objects = model_.view(storage);
    ExpectedPairs expected_pairs = expected_pairs_of(boxes, &objects, 0);
    for (Replica& p : replicas_) {
      if (!good(p.broad_phase.find_overlaps(boxes), p)) return;
      const Pairs reported = p.broad_phase.overlaps();
      const auto wrong = expected_pairs.differences(reported.data(), reported.size(), true);
      if (!wrong.empty()) differ(p.name, wrong[0]);
    }
    compare_result(expected_pairs.pairs().size(),
                   pair_checksum(expected_pairs.pairs().data(), expected_pairs.pairs().size()),
                   "overlaps");
  }

  // Only the library has the formula that decides a sweep's hits: results are compared with each
  // other.
  void hits(const CapturedCall& call, const Filters& filters) {
    std::uint64_t first = 0, count = 0;
    for (Replica& p : replicas_) {
      const auto which = static_cast<SweepHits>(call.form);
      if (!good(p.broad_phase.find_hits(call.sweeps.data(), call.sweeps.size(), which, filters), p))
        return;
      std::uint64_t sum = 0;
      for (const SweepHit& hit : p.broad_phase.hits()) {
        std::uint64_t time;
        std::memcpy(&time, &hit.time, sizeof time);
        sum = capture::chain(sum, std::uint64_t{hit.sweep} << 32 | hit.object);
        sum = capture::chain(sum, time);
      }
      if (&p == &replicas_[0]) {
        first = sum;
        count = p.broad_phase.hits().size();
      }
      if (sum != first) differ(p.name, "hits differ from the first one's");
    }
    compare_result(count, first, "hits");
  }

  // The object became a copy of another. A new one gets the same objects and reports their pairs;
  // the original's slots and next ids are unknown.
  void restart(const CapturedCall& call, const Boxes& boxes) {
    model_ = {};
    exact_ = false;
    options_.margin = call.by.x;
    std::vector<ObjectId> dead;
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      Filter filter;
      set(filter, boxes.filters, i);
      model_.put(static_cast<ObjectId>(i), boxes[i], filter);
      model_.alive[i] = call.ids[i] != 0;
      if (!model_.alive[i]) dead.push_back(static_cast<ObjectId>(i));
    }
    for (Replica& p : replicas_) {
      Options o = p.broad_phase.options();
      o.margin = options_.margin;
      p.broad_phase = BroadPhase(o);
      std::vector<ObjectId> ids(boxes.size());
      if (!good(p.broad_phase.add(boxes, ids.data()), p) ||
          !good(p.broad_phase.remove(dead.data(), dead.size()), p) ||
          !good(p.broad_phase.update(), p))
        return;
    }
    std::vector<Box> storage;
    model_.pairs = expected_pairs_of(model_.view(storage), nullptr, options_.margin).pairs();
  }

  const Capture& capture_;
  const ReplayLimits& limits_;
  ReplayReport& report_;
  Options options_;
  std::vector<Replica> replicas_;
  Model model_;
  const CapturedCall* call_ = nullptr;
  std::size_t at_ = 0, updates_ = 0;
  const char* by_ = nullptr;
  bool exact_ = true;  // the captured results were reproduced, down to the slots
  bool stop_ = false;
};

}  // namespace

void replay_broad_phase(const Capture& capture, const ReplayLimits& limits, ReplayReport& report) {
  if (capture.truncated) report.text += "the file ends within a call, which is ignored\n";
  report.json["truncated"] = capture.truncated;
  Replay(capture, limits, report).run();
}

}  // namespace throng::cli
