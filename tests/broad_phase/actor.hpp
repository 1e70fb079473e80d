// Random calls on a BroadPhase, or a class with the same calls, and the same on its model.
#pragma once

#include <string>
#include <type_traits>

#include "broad_phase/model.hpp"
#include "broad_phase/query_reference.hpp"
#include "support/hard_boxes.hpp"
#include "support/random.hpp"

namespace throng::tests {

template <class Implementation>
class ActorOf {
 public:
  template <class... More>
  ActorOf(const Options& options, std::uint64_t seed, float side, const More&... more)
      : broad_phase(options, more...), model(options.margin), random(seed), side_(side) {}

  Implementation broad_phase;
  Model model;
  Random random;
  bool in_worlds = true;  // whether filters set worlds
  bool thin = false;      // whether most boxes are axis-aligned rods or plates

  // Mostly of one size; sometimes a point, a slab, a plane, all of space, or an inactive box.
  Box any_box() {
    const Vec3 at = random.point(0, side_);
    const float e = random.one_in(4) ? random.magnitude(-3, 3) : 1.0f;
    Box box = {at, {at.x + e, at.y + e, at.z + e}};
    if (random.one_in(4)) {  // integers: faces that touch
      const auto whole = [](float x) { return std::floor(x); };
      box = {{whole(at.x), whole(at.y), whole(at.z)},
             {whole(at.x) + 1, whole(at.y) + 1, whole(at.z) + 1}};
    }
    if (thin && !random.one_in(4)) box = rod_or_plate(at);
    switch (random.below(120)) {
      case 0:
        return {at, at};
      case 1:
        return {{-infinity, at.y, -infinity}, {infinity, at.y, infinity}};
      case 2:
        return {{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
      case 3:
        return {box.upper, box.lower};
      case 4:
        return {{at.x, at.y, at.z}, {at.x + 4 * side_, at.y, at.z}};
      case 5:
        return {{1e30f, at.y, at.z}, {infinity, at.y, at.z}};
      case 6:
        return {{at.x, -float_max, at.z}, {at.x, float_max, at.z}};
      default:
        return box;
    }
  }
  Box rod_or_plate(const Vec3& at) {
    const float thickness = random.one_in(2) ? 0.25f : 0.5f;
    const float length = thickness * static_cast<float>(random.between(9, 40));
    const unsigned long_axes = 1 + random.below(6);
    const auto extent = [&](unsigned axis) { return long_axes >> axis & 1 ? length : thickness; };
    return {at, {at.x + extent(0), at.y + extent(1), at.z + extent(2)}};
  }
  Box moved(const Box& box) {
    if (random.one_in(12)) return any_box();                       // a teleport
    if (thin && random.one_in(6)) return rod_or_plate(box.lower);  // grows or turns
    Vec3 by = random.point(-0.5f, 0.5f);
    if (random.one_in(8)) by = {1, 0, 0};
    const auto add = [&](const Vec3& v) { return Vec3{v.x + by.x, v.y + by.y, v.z + by.z}; };
    return {add(box.lower), add(box.upper)};
  }
  Sweep any_sweep() {
    Sweep s{any_box(), random.point(-2, 2)};
    if (random.one_in(2)) s.box.upper = s.box.lower;  // a ray
    if (random.one_in(3)) s.by = random.point(-2 * side_, 2 * side_);
    if (random.one_in(8)) s.by = random.point(-1e4f, 1e4f);
    if (random.one_in(30)) s.by = {1e30f, -1e37f, 1};
    if (random.one_in(6)) s.by.x = 0;
    if (random.one_in(6)) s.by.y = s.by.z = 0;
    return s;
  }
  Filter any_filter() {
    Filter f;
    if (random.one_in(4)) f.group = 1u << random.below(3);
    if (random.one_in(4)) f.mask = random.below(8);
    if (random.one_in(4)) f.owner = random.between(-1, 3);
    if (in_worlds && random.one_in(3)) f.world = random.between(-1, 2);
    f.is_static = random.one_in(4);
    return f;
  }
  // Up to `most` distinct ids that are alive.
  std::vector<ObjectId> some_ids(std::size_t most) {
    std::vector<ObjectId> ids = model.ids();
    shuffle(ids, random);
    if (ids.size() > most) ids.resize(most);
    return ids;
  }

  testing::AssertionResult add(std::size_t count, bool filtered) {
    BoxList boxes;
    std::vector<Filter> filters;
    for (std::size_t i = 0; i < count; ++i) {
      boxes.push_back(any_box());
      filters.push_back(filtered ? any_filter() : Filter{});
    }
    Boxes view = boxes;
    if (filtered && count) view.filters = given(filters);
    std::vector<ObjectId> ids(count);
    const Result r = broad_phase.add(view, ids.data());
    if (!r.ok()) return testing::AssertionFailure() << "add: " << r.message;
    for (std::size_t i = 0; i < count; ++i)
      if (testing::AssertionResult a = model.add(ids[i], boxes[i], filters[i]); !a) return a;
    return model.check_call(r);
  }
  testing::AssertionResult remove(std::size_t count) {
    const std::vector<ObjectId> ids = some_ids(count);
    const Result r = broad_phase.remove(ids.data(), ids.size());
    for (ObjectId id : ids) model.remove(id);
    return model.check_call(r) << " (remove)";
  }
  testing::AssertionResult move(std::size_t count) {
    const std::vector<ObjectId> ids = some_ids(count);
    BoxList boxes;
    for (ObjectId id : ids) {
      boxes.push_back(moved(model.at(id).box));
      model.at(id).box = boxes.back();
    }
    const Result r = broad_phase.move(ids.data(), boxes);
    return model.check_call(r);
  }
  testing::AssertionResult move_all(unsigned one_in) {
    BoxList boxes(model.limit(), Box{{infinity, 0, 0}, {std::nanf(""), 0, 0}});
    for (ObjectId id : model.ids()) {
      Box& box = model.at(id).box;
      if (random.one_in(one_in)) box = moved(box);
      boxes[id] = box;
    }
    const Result r = broad_phase.move_all(boxes);
    return model.check_call(r);
  }
  testing::AssertionResult set_filters(std::size_t count) {
    const std::vector<ObjectId> ids = some_ids(count);
    std::vector<Filter> filters;
    for (ObjectId id : ids) {
      filters.push_back(random.one_in(3) ? Filter{} : any_filter());
      model.at(id).filter = filters.back();
    }
    if (ids.empty()) return testing::AssertionSuccess();
    const Result r = broad_phase.set_filters(ids.data(), ids.size(), given(filters));
    return model.check_call(r);
  }
  // Up to two calls before an update: on few objects or, unless `calm`, on many; at most twice
  // `objects` exist.
  testing::AssertionResult some_calls(bool calm, std::size_t objects, bool filtered,
                                      bool with_move_all) {
    const std::size_t few = calm ? 1 + random.below(4) : 1 + random.below(400);
    testing::AssertionResult result = testing::AssertionSuccess();
    for (std::uint32_t k = random.below(3); k-- > 0 && result;) {
      switch (random.below(calm ? 12 : 8)) {
        case 0:
          if (model.count() < 2 * objects) result = add(few, filtered);
          break;
        case 1:
          result = remove(random.one_in(40) ? objects / 2 : few);
          break;
        case 2:
          if (filtered) result = set_filters(few);
          break;
        case 3:
          result = with_move_all ? move_all(calm ? 300 : 2) : move(few);
          break;
        default:
          result = move(few);
          break;
      }
    }
    return result;
  }
  testing::AssertionResult update(bool compare_pairs = true) {
    const Result r = broad_phase.update();
    if (!r.ok()) return testing::AssertionFailure() << "update: " << r.message;
    model.update();
    if (testing::AssertionResult a = model.check(broad_phase, compare_pairs); !a)
      return a << " (" << r.plan.reason << ")";
    // the device class does not count inactive objects
    if constexpr (!std::is_same_v<Implementation, BroadPhase>) {
      if (r.found != broad_phase.pair_count())
        return testing::AssertionFailure() << r.found << " pairs found";
      return testing::AssertionSuccess();
    }
    return model.check_update(r) << " (" << r.plan.reason << ")";
  }

  // Worlds only if `in_worlds`.
  Filters given(const std::vector<Filter>& f) const {
    Filters view = view_of(f);
    if (!in_worlds) view.world = {};
    return view;
  }

 private:
  float side_;
};
using Actor = ActorOf<BroadPhase>;

}  // namespace throng::tests
