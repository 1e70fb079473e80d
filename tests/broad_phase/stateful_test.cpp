// A rapidcheck state machine: random commands against the model, shrunk to a shortest failing
// sequence. Boxes are integers in a small space, so that faces touch.
#include <rapidcheck.h>
#include <rapidcheck/state.h>

#include "broad_phase/model.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

using Machine = BroadPhase;
using Command = rc::state::Command<Model, Machine>;

rc::Gen<Box> small_box() {
  return rc::gen::map(
      rc::gen::tuple(rc::gen::inRange(-6, 7), rc::gen::inRange(-3, 4), rc::gen::inRange(-2, 3),
                     rc::gen::inRange(-1, 30)),
      [](const std::tuple<int, int, int, int>& t) {
        const auto [x, y, z, e] = t;
        const auto f = [](int i) { return static_cast<float>(i); };
        // Mostly 0 to 3 wide; inactive; or infinite.
        const float side = e < 24 ? f(e % 4) : e == 29 ? infinity : f(e);
        return Box{{f(x), f(y), f(z)}, {f(x) + (e < 0 ? -1.0f : side), f(y) + side, f(z) + side}};
      });
}
rc::Gen<Filter> any_filter() {
  return rc::gen::map(rc::gen::inRange(0, 1 << 9), [](int bits) {
    Filter f;
    if (bits & 1) f.group = 1u << (bits >> 1 & 1);
    if (bits & 1) f.mask = static_cast<std::uint32_t>(bits >> 2 & 3);
    if (bits & 16) f.owner = (bits >> 5 & 3) - 1;
    if (bits & 128) f.world = bits >> 5 & 1;
    f.is_static = static_cast<std::uint8_t>(bits >> 8 & 1);
    return f;
  });
}

void must(const testing::AssertionResult& r) {
  if (!r) RC_FAIL(r.message());
}

struct Add : Command {
  std::vector<Box> boxes = *rc::gen::container<std::vector<Box>>(
      *rc::gen::weightedElement<std::size_t>({{6, 1}, {2, 4}, {1, 40}}), small_box());
  Filter filter =
      *rc::gen::weightedOneOf<Filter>({{3, rc::gen::just(Filter{})}, {1, any_filter()}});

  void apply(Model& m) const override {
    for (const Box& box : boxes) m.add(m.free_id(), box, filter);
  }
  void run(const Model& m, Machine& b) const override {
    Model after = m;
    for (const Box& box : boxes) {
      const ObjectId want = after.free_id();
      must(after.add(want, box, filter));
      ObjectId id;
      RC_ASSERT(b.add(box, filter, id) == Status::ok);
      RC_ASSERT(id == want);
    }
  }
  void show(std::ostream& out) const override { out << "Add(" << boxes.size() << ")"; }
};

// Base of commands on one object that is alive.
struct OnOne : Command {
  ObjectId id = 0;
  explicit OnOne(const Model& m) {
    const std::vector<ObjectId> ids = m.ids();
    RC_PRE(!ids.empty());
    id = *rc::gen::elementOf(ids);
  }
  void checkPreconditions(const Model& m) const override { RC_PRE(m.alive(id)); }
};

struct Remove : OnOne {
  explicit Remove(const Model& m) : OnOne(m) {}
  void apply(Model& m) const override { m.remove(id); }
  void run(const Model&, Machine& b) const override {
    RC_ASSERT(b.remove(id) == Status::ok);
    RC_ASSERT(b.remove(id) == Status::bad_id);
  }
  void show(std::ostream& out) const override { out << "Remove(" << id << ")"; }
};

struct Move : OnOne {
  Box box = *small_box();
  explicit Move(const Model& m) : OnOne(m) {}
  void apply(Model& m) const override { m.at(id).box = box; }
  void run(const Model&, Machine& b) const override { RC_ASSERT(b.move(id, box) == Status::ok); }
  void show(std::ostream& out) const override { out << "Move(" << id << ")"; }
};

struct SetFilter : OnOne {
  Filter filter = *any_filter();
  explicit SetFilter(const Model& m) : OnOne(m) {}
  void apply(Model& m) const override { m.at(id).filter = filter; }
  void run(const Model&, Machine& b) const override {
    RC_ASSERT(b.set_filter(id, filter) == Status::ok);
  }
  void show(std::ostream& out) const override { out << "SetFilter(" << id << ")"; }
};

// All by the same step: only other commands cause events.
struct MoveAll : Command {
  float by = static_cast<float>(*rc::gen::inRange(-2, 3));
  void apply(Model& m) const override {
    for (const ObjectId id : m.ids()) {
      m.at(id).box.lower.y += by;
      m.at(id).box.upper.y += by;
    }
  }
  void run(const Model& m, Machine& b) const override {
    Model after = m;
    apply(after);
    std::vector<Box> boxes(after.limit(), Box{{1, 1, 1}, {0, 0, 0}});
    for (const ObjectId id : after.ids()) boxes[id] = after.at(id).box;
    must(after.check_call(b.move_all(boxes)));
  }
  void show(std::ostream& out) const override { out << "MoveAll(" << by << ")"; }
};

struct Update : Command {
  void apply(Model& m) const override { m.update(); }
  void run(const Model& m, Machine& b) const override {
    Model after = m;
    after.update();
    must(after.check_update(b.update()));
    must(after.check_results(b));
  }
  void show(std::ostream& out) const override { out << "Update"; }
};

// The copy replaces the object.
struct Copy : Command {
  void apply(Model&) const override {}
  void run(const Model&, Machine& b) const override { b = BroadPhase(b); }
  void show(std::ostream& out) const override { out << "Copy"; }
};

TEST(BroadPhaseStateful, MatchesTheModel) {
  EXPECT_TRUE(rc::check("results equal those of the model", [] {
    const Model model;
    BroadPhase machine;
    rc::state::check(
        model, machine,
        rc::state::gen::execOneOfWithArgs<Add, Add, Remove, Move, Move, Move, SetFilter, MoveAll,
                                          Update, Update, Update, Copy>());
  }));
}

}  // namespace
}  // namespace throng::tests
