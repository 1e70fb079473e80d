// BroadPhase: persistent objects.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <nanobind/stl/array.h>
#include <nanobind/stl/unique_ptr.h>

#include <throng/broad_phase.hpp>
#include <throng/broad_phase_query.hpp>
#include <throng/find_pairs.hpp>

#include "python/arrays.hpp"
#include "python/errors.hpp"
#include "python/options.hpp"
#include "python/pair_search.hpp"
#include "python/pool.hpp"
#include "python/scenes.hpp"

namespace throng::python {
namespace {

Filters filters_of(const nb::tuple& f, std::size_t n, KeepAlive& kept) {
  Filters filters;
  filters.group = import_values<std::uint32_t>(f[0], "group", n, kept);
  filters.mask = import_values<std::uint32_t>(f[1], "mask", n, kept);
  filters.owner = import_values<std::int32_t>(f[2], "owner", n, kept);
  filters.world = import_values<std::int32_t>(f[3], "world", n, kept);
  filters.is_static = import_values<std::uint8_t>(f[4], "static", n, kept);
  return filters;
}

// Boxes with filters, for an overlap query.
struct QueryBoxes {
  BoxArray boxes;
  QueryBoxes(nb::handle given, const nb::tuple& f)
      : boxes(BoxArray::one_or_more(given, "boxes", Rounding::outward)) {
    boxes.set_filters("", f[0], f[1], f[2], f[3], f[4]);
  }
  bool is_long() const noexcept { return boxes.size() >= long_from; }
};

// The smallest float box that contains `box`, extended by `rest`: it moves by a float vector where
// the given one moves by that and `rest`, and is never inside the box that contains it.
Box extended(const Box& box, const DoubleVec3& rest) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double lost[3] = {rest.x, rest.y, rest.z};
  const float lower[3] = {box.lower.x, box.lower.y, box.lower.z};
  const float upper[3] = {box.upper.x, box.upper.y, box.upper.z};
  double l[3], u[3];
  for (int k = 0; k < 3; ++k) {
    if (lower[k] > upper[k]) return box;  // inactive: it stays so
    l[k] = lower[k], u[k] = upper[k];
    // The sums are rounded; the next double is on the safe side.
    if (lost[k] < 0) l[k] = std::nextafter(l[k] + lost[k], -infinity);
    if (lost[k] > 0) u[k] = std::nextafter(u[k] + lost[k], infinity);
  }
  return round_outward(l, u);
}

// Swept boxes with filters, for a ray or shape cast.
struct QuerySweeps {
  BoxArray boxes;
  SweepHits which;
  KeepAlive kept;
  std::size_t count;
  Filters filters;
  std::unique_ptr<Sweep[]> sweeps;

  QuerySweeps(nb::handle given, nb::handle by, nb::handle wanted, const nb::tuple& f)
      : boxes(given, "boxes", Rounding::outward), which(hits_of(wanted)), count(boxes.size()) {
    std::unique_ptr<DoubleVec3[]> rest;
    const Strided<Vec3> ways = import_directions(by, "by", count, boxes.dimensions(), kept, rest);
    filters = filters_of(f, count, kept);
    sweeps.reset(new (std::nothrow) Sweep[count + 1]);
    if (!sweeps) memory_error("no memory for " + std::to_string(count) + " sweeps of 36 bytes");
    for (std::size_t i = 0; i < count; ++i) {
      const Box box = boxes.view()[i];
      sweeps[i] = {rest ? extended(box, rest[i]) : box, ways[i]};
    }
  }
  bool is_long() const noexcept { return count >= long_from / 8; }
};

// (m, 2).
nb::object pair_array(const Pairs& pairs) {
  return numpy_rows<std::uint32_t>(pairs.data(), pairs.size(), 2);
}
// ((m, 2): sweep, object; (m,): time).
nb::object hit_arrays(const SweepHitList& hits) {
  const std::size_t m = hits.size();
  auto pairs = std::make_unique<std::uint32_t[]>(2 * m + 1);
  auto times = std::make_unique<double[]>(m + 1);
  for (std::size_t i = 0; i < m; ++i) {
    pairs[2 * i] = hits[i].sweep;
    pairs[2 * i + 1] = hits[i].object;
    times[i] = hits[i].time;
  }
  return nb::make_tuple(numpy_array(std::move(pairs), {m, 2}), numpy_array(std::move(times), {m}));
}

// Queries of one thread at a time; any number of these may query one BroadPhase at once.
class QueryObject {
 public:
  explicit QueryObject(Options options) {
    options.stop = &stop_;
    query_ = BroadPhaseQuery(options);
  }
  QueryObject(nb::handle nan, nb::handle inverted, nb::handle threads, nb::handle isa)
      : QueryObject(options_of(nan, inverted, threads, isa)) {}

  nb::object find_overlaps(const BroadPhase& objects, const QueryBoxes& query) {
    nb::object found;
    call(
        query.is_long(), [&] { return query_.find_overlaps(objects, query.boxes.view()); },
        [&] { found = pair_array(query_.overlaps()); });
    return found;
  }

  nb::object find_hits(const BroadPhase& objects, const QuerySweeps& query) {
    nb::object found;
    call(
        query.is_long(),
        [&] {
          return query_.find_hits(objects, query.sweeps.get(), query.count, query.which,
                                  query.filters);
        },
        [&] { found = hit_arrays(query_.hits()); });
    return found;
  }

 private:
  static Options options_of(nb::handle nan, nb::handle inverted, nb::handle threads,
                            nb::handle isa) {
    Options o;
    o.nan = nan_of(nan);
    o.inverted = inverted_of(inverted);
    o.threads = threads_of(threads);
    o.isa = isa_of(isa);
    o.executor = &executor();
    return o;
  }

  template <class F, class Then>
  void call(bool is_long, const F& body, const Then& then) {
    if (busy_.exchange(true)) {
      throw std::runtime_error(
          "this BroadPhaseQuery is in use by another thread; give each thread its own");
    }
    struct End {
      std::atomic<bool>& busy;
      ~End() { busy = false; }
    } end{busy_};
    Result result;
    stop_ = false;
    run_unlocked(is_long, stop_, [&] { result = body(); });
    require_ok(result);
    then();
  }

  BroadPhaseQuery query_;
  std::atomic<bool> stop_{false}, busy_{false};
};

// Three coordinates, rounded to the nearest float32.
using Vector = std::array<double, 3>;
Vec3 vector_of(const Vector& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

class LiveObject {
 public:
  LiveObject(nb::handle margin, nb::handle nan, nb::handle inverted, nb::handle threads,
             nb::handle isa) {
    Options o;
    o.margin = margin_of(margin);
    o.nan = nan_of(nan);
    o.inverted = inverted_of(inverted);
    o.threads = threads_of(threads);
    o.isa = isa_of(isa);
    o.executor = &executor();
    o.stop = &stop_;
    live_ = BroadPhase(o);
  }
  LiveObject(const LiveObject& other) {
    other.together([&] {
      Options o = other.live_.options();
      o.stop = &stop_;
      live_ = BroadPhase(o);
      require_ok(live_.copy_from(other.live_));
      result_ = other.result_;
      changed_count_ = other.changed_count_;
    });
  }

  nb::object add(nb::handle boxes, const nb::tuple& f) {
    BoxArray given = BoxArray::one_or_more(boxes, "boxes", Rounding::outward);
    given.set_filters("", f[0], f[1], f[2], f[3], f[4]);
    const std::size_t n = given.size();
    auto ids = std::make_unique<ObjectId[]>(std::max<std::size_t>(n, 1));
    change(n, [&] { return live_.add(given.view(), ids.get()); });
    return numpy_array(std::move(ids), {n});
  }

  void remove(nb::handle ids) {
    const Ids list(ids);
    change(list.size(), [&] { return live_.remove(list.data(), list.size()); });
  }

  void move(nb::handle ids, nb::handle boxes) {
    const Ids list(ids);
    const BoxArray given = BoxArray::one_or_more(boxes, "boxes", Rounding::outward);
    if (given.size() != list.size()) {
      value_error("boxes: found " + std::to_string(given.size()) + " boxes for " +
                  std::to_string(list.size()) + " ids; give one per box");
    }
    change(list.size(), [&] { return live_.move(list.data(), given.view()); });
  }

  void move_all(nb::handle boxes) {
    const BoxArray given(boxes, "boxes", Rounding::outward);
    change(given.size(), [&] { return live_.move_all(given.view()); });
  }

  void set_filters(nb::handle ids, const nb::tuple& f) {
    const Ids list(ids);
    KeepAlive kept;
    const Filters filters = filters_of(f, list.size(), kept);
    change(list.size(), [&] { return live_.set_filters(list.data(), list.size(), filters); });
  }

  void shift_origin(float x, float y, float z) {
    change(live_.object_count(), [&] { return live_.shift_origin({x, y, z}); });
  }

  Result update() {
    call(
        changed_count_ >= long_from, [&] { return live_.update(); }, [&] { changed_count_ = 0; });
    return result_;
  }

  // (m, 3): first, second, slot.
  nb::object begun() const {
    return read([](const BroadPhase& live) { return live_pairs_array(live.begun()); });
  }
  nb::object ended() const {
    return read([](const BroadPhase& live) { return live_pairs_array(live.ended()); });
  }
  nb::object pairs() {
    nb::object found;
    alone([&] { found = live_pairs_array(live_.pairs()); });  // sorts them on demand
    return found;
  }

  nb::object pairs_of(nb::handle id) const {
    const auto index = static_cast<ObjectId>(parse_integer(id, "id", 0xffffffffu));
    return read([index](const BroadPhase& live) {
      std::vector<LivePair> pairs(live.pairs_of(index, nullptr, 0));
      live.pairs_of(index, pairs.data(), pairs.size());
      return live_pairs_array({pairs.data(), pairs.size()});
    });
  }

  // Queries may run together, each by a query object of its own.
  template <class Call>
  nb::object query(const Call& call) const {
    nb::object found;
    together([&] {
      std::unique_ptr<QueryObject> one;
      if (free_queries_.empty()) {
        one = std::make_unique<QueryObject>(live_.options());
      } else {
        one = std::move(free_queries_.back());
        free_queries_.pop_back();
      }
      struct End {
        std::unique_ptr<QueryObject>& one;
        std::vector<std::unique_ptr<QueryObject>>& free;
        ~End() { free.push_back(std::move(one)); }
      } end{one, free_queries_};
      found = call(*one, live_);
    });
    return found;
  }

  nb::object find_overlaps(nb::handle boxes, const nb::tuple& f) const {
    const QueryBoxes given(boxes, f);
    return query([&](QueryObject& q, const BroadPhase& b) { return q.find_overlaps(b, given); });
  }

  nb::object find_hits(nb::handle boxes, nb::handle by, nb::handle which,
                       const nb::tuple& f) const {
    const QuerySweeps given(boxes, by, which, f);
    return query([&](QueryObject& q, const BroadPhase& b) { return q.find_hits(b, given); });
  }

  // None, or (object, distance, point, normal).
  nb::object raycast(const Vector& origin, const Vector& direction, double max_distance,
                     std::uint32_t layer_mask, std::int64_t world) const {
    if (world > 0x7fffffff)
      value_error("world: found " + std::to_string(world) + ", wanted at most 2147483647");
    Filter of_ray;
    of_ray.mask = layer_mask;
    of_ray.world = static_cast<std::int32_t>(world);
    std::optional<RayHit> hit;
    Result result;
    std::atomic<bool> not_stopped{false};
    together([&] {
      run_unlocked(false, not_stopped, [&] {
        result =
            live_.raycast(vector_of(origin), vector_of(direction), max_distance, of_ray, {}, hit);
      });
    });
    require_ok(result);
    if (!hit) return nb::none();
    const auto tuple_of = [](const Vec3& v) { return nb::make_tuple(v.x, v.y, v.z); };
    return nb::make_tuple(hit->object, hit->distance, tuple_of(hit->point), tuple_of(hit->normal));
  }

  bool is_alive(nb::handle id) const {
    const auto index = static_cast<ObjectId>(parse_integer(id, "id", 0xffffffffu));
    bool alive = false;
    together([&] { alive = live_.is_alive(index); });
    return alive;
  }

  nb::object box(nb::handle id) const {
    const Box b = of_object(id, &BroadPhase::box);
    auto values = std::make_unique<float[]>(6);
    std::memcpy(values.get(), &b, sizeof b);
    return numpy_array(std::move(values), {6});
  }
  nb::tuple filter(nb::handle id) const {
    const Filter f = of_object(id, &BroadPhase::filter);
    return nb::make_tuple(f.group, f.mask, f.owner, f.world, f.is_static != 0);
  }

  // For calls that only read.
  template <class Call>
  nb::object read(const Call& call) const {
    nb::object found;
    together([&] { found = call(live_); });
    return found;
  }

  std::uint64_t number(std::uint64_t (BroadPhase::*of)() const noexcept) const {
    std::uint64_t value = 0;
    together([&] { value = (live_.*of)(); });
    return value;
  }

 private:
  // Ids as the library reads them: contiguous.
  class Ids {
   public:
    explicit Ids(nb::handle value) {
      const std::string wanted = "uint32 of shape (n,), or one id";
      if (value.is_none()) type_error("ids: found None, wanted " + wanted);
      std::size_t count = 1;
      if (!PyLong_Check(value.ptr()) &&
          !nb::getattr(value, "ndim", nb::none()).equal(nb::int_(0))) {
        const AnyArray array = import_array(value, "ids", wanted);
        if (array.ndim() != 1) value_error("ids: found " + described(array) + ", wanted " + wanted);
        count = array.shape(0);
      }
      values_ = import_values<ObjectId>(value, "ids", count, kept_);
      if (count <= 1 || values_.stride_bytes == sizeof(ObjectId)) return;
      copy_ = std::make_unique<ObjectId[]>(values_.count);
      for (std::size_t i = 0; i < values_.count; ++i) copy_[i] = values_[i];
    }
    const ObjectId* data() const noexcept { return copy_ ? copy_.get() : values_.data; }
    std::size_t size() const noexcept { return values_.count; }

   private:
    KeepAlive kept_;
    Strided<ObjectId> values_;
    std::unique_ptr<ObjectId[]> copy_;
  };

  // The filters of an object; ValueError unless it is alive.
  template <class Value>
  Value of_object(nb::handle id, Value (BroadPhase::*of)(ObjectId) const noexcept) const {
    const auto index = static_cast<ObjectId>(parse_integer(id, "id", 0xffffffffu));
    Value value;
    bool alive = false;
    together([&] {
      alive = live_.is_alive(index);
      if (alive) value = (live_.*of)(index);
    });
    if (!alive)
      value_error("id: found " + std::to_string(index) +
                  ", wanted that of an object, is_alive(id)");
    return value;
  }

  // Excludes calls from other threads.
  void alone(const std::function<void()>& body) const {
    int nobody = 0;
    if (!users_.compare_exchange_strong(nobody, exclusive)) {
      throw std::runtime_error(
          nobody == exclusive
              ? "this BroadPhase is in use by another thread; make one call at a time"
              : "this BroadPhase is queried by another thread; change it between queries");
    }
    struct End {
      std::atomic<int>& users;
      ~End() { users = 0; }
    } end{users_};
    body();
  }

  // Excludes calls of alone() from other threads.
  void together(const std::function<void()>& body) const {
    int users = users_;
    do {
      if (users == exclusive) {
        throw std::runtime_error(
            "this BroadPhase is being changed by another thread; query it between changes");
      }
    } while (!users_.compare_exchange_weak(users, users + 1));
    struct End {
      std::atomic<int>& users;
      ~End() { --users; }
    } end{users_};
    body();
  }

  // One library call without the interpreter's lock; `then` reads its result.
  template <class F, class Then>
  void call(bool is_long, const F& body, const Then& then) {
    alone([&] {
      Result result;
      stop_ = false;
      run_unlocked(is_long, stop_, [&] { result = body(); });
      require_ok(result);
      result_ = result;
      then();
    });
  }
  // For `count` objects; the next update has more work.
  template <class F>
  void change(std::size_t count, const F& body) {
    call(false, body, [&] { changed_count_ += count; });
  }

  static nb::object live_pairs_array(const LivePairs& pairs) {
    return numpy_rows<std::uint32_t>(pairs.data(), pairs.size(), 3);
  }

  BroadPhase live_;
  Result result_;
  std::size_t changed_count_ = 0;  // objects named by calls since the last update
  std::atomic<bool> stop_{false};
  static constexpr int exclusive = -1;
  mutable std::atomic<int> users_{0};  // the number of calls of together(), or `exclusive`
  mutable std::vector<std::unique_ptr<QueryObject>> free_queries_;  // by the interpreter's lock
};

}  // namespace

void bind_live(nb::module_& m) {
  const auto number = [](std::uint64_t (BroadPhase::*of)() const noexcept) {
    return [of](const LiveObject& self) { return self.number(of); };
  };
  nb::class_<LiveObject>(m, "BroadPhase")
      .def(nb::init<nb::handle, nb::handle, nb::handle, nb::handle, nb::handle>(),
           nb::arg("margin").none(), nb::arg("nan").none(), nb::arg("inverted").none(),
           nb::arg("threads").none(), nb::arg("isa").none())
      .def("copy", [](const LiveObject& self) { return std::make_unique<LiveObject>(self); })
      .def("add", &LiveObject::add, nb::arg("boxes").none(), nb::arg("filters"))
      .def("remove", &LiveObject::remove, nb::arg("ids").none())
      .def("move", &LiveObject::move, nb::arg("ids").none(), nb::arg("boxes").none())
      .def("move_all", &LiveObject::move_all, nb::arg("boxes").none())
      .def("set_filters", &LiveObject::set_filters, nb::arg("ids").none(), nb::arg("filters"))
      .def("shift_origin", &LiveObject::shift_origin, nb::arg("x"), nb::arg("y"), nb::arg("z"))
      .def("update", &LiveObject::update)
      .def("begun", &LiveObject::begun)
      .def("ended", &LiveObject::ended)
      .def("pairs", &LiveObject::pairs)
      .def("pairs_of", &LiveObject::pairs_of, nb::arg("id").none())
      .def("find_overlaps", &LiveObject::find_overlaps, nb::arg("boxes").none(), nb::arg("filters"))
      .def("find_hits", &LiveObject::find_hits, nb::arg("boxes").none(), nb::arg("by").none(),
           nb::arg("which").none(), nb::arg("filters"))
      .def("raycast", &LiveObject::raycast, nb::arg("origin"), nb::arg("direction"),
           nb::arg("max_distance"), nb::arg("layer_mask"), nb::arg("world"))
      .def("is_alive", &LiveObject::is_alive, nb::arg("id").none())
      .def("box", &LiveObject::box, nb::arg("id").none())
      .def("filter", &LiveObject::filter, nb::arg("id").none())
      .def_prop_ro("object_count", number(&BroadPhase::object_count))
      .def_prop_ro("pair_count", number(&BroadPhase::pair_count))
      .def_prop_ro("id_limit", number(&BroadPhase::id_limit))
      .def_prop_ro("slot_limit", number(&BroadPhase::slot_limit));
  nb::class_<QueryObject>(m, "BroadPhaseQuery")
      .def(nb::init<nb::handle, nb::handle, nb::handle, nb::handle>(), nb::arg("nan").none(),
           nb::arg("inverted").none(), nb::arg("threads").none(), nb::arg("isa").none())
      .def(
          "find_overlaps",
          [](QueryObject& self, const LiveObject& objects, nb::handle boxes, const nb::tuple& f) {
            const QueryBoxes given(boxes, f);
            return objects.read(
                [&](const BroadPhase& live) { return self.find_overlaps(live, given); });
          },
          nb::arg("objects"), nb::arg("boxes").none(), nb::arg("filters"))
      .def(
          "find_hits",
          [](QueryObject& self, const LiveObject& objects, nb::handle boxes, nb::handle by,
             nb::handle which, const nb::tuple& f) {
            const QuerySweeps given(boxes, by, which, f);
            return objects.read(
                [&](const BroadPhase& live) { return self.find_hits(live, given); });
          },
          nb::arg("objects"), nb::arg("boxes").none(), nb::arg("by").none(),
          nb::arg("which").none(), nb::arg("filters"));
}

}  // namespace throng::python
