// BroadPhase: objects that live.
#include <algorithm>
#include <atomic>
#include <cstring>
#include <functional>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

#include <nanobind/stl/unique_ptr.h>

#include <throng/broad_phase.hpp>

#include "python/arrays.hpp"
#include "python/errors.hpp"
#include "python/options.hpp"
#include "python/pool.hpp"
#include "python/scenes.hpp"

namespace throng::python {
namespace {

// A copy of `count` things of T as rows of `columns` values.
template <class Value, class T>
nb::object rows(const T* from, std::size_t count, std::size_t columns) {
  static_assert(sizeof(T) % sizeof(Value) == 0);
  auto copy = std::make_unique<Value[]>(std::max<std::size_t>(count * columns, 1));
  if (count) std::memcpy(copy.get(), from, count * sizeof(T));
  auto* data = copy.get();
  const nb::capsule owner(copy.release(),
                          [](void* p) noexcept { delete[] static_cast<Value*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, Value>(data, {count, columns}, owner));
}

class LiveObject {
 public:
  LiveObject(nb::handle margin, nb::handle nan, nb::handle threads, nb::handle isa) {
    Options o;
    o.margin = margin_of(margin);
    o.nan = nan_of(nan);
    o.threads = threads_of(threads);
    o.isa = isa_of(isa);
    o.executor = &executor();
    live_ = BroadPhase(o);
  }
  LiveObject(const LiveObject& other) {
    other.alone([&] { live_ = other.live_; });
    result_ = other.result_;
  }

  nb::object add(nb::handle boxes, const nb::tuple& f) {
    BoxArray given(boxes, "boxes", Rounding::exact);
    given.set_filters("", f[0], f[1], f[2], f[3], f[4]);
    const std::size_t n = given.size();
    auto ids = std::make_unique<ObjectId[]>(std::max<std::size_t>(n, 1));
    call([&] { return live_.add(given.view(), ids.get()); });
    auto* data = ids.get();
    const nb::capsule owner(ids.release(),
                            [](void* p) noexcept { delete[] static_cast<ObjectId*>(p); });
    return nb::cast(nb::ndarray<nb::numpy, ObjectId>(data, {n}, owner));
  }

  void remove(nb::handle ids) {
    const Ids list(ids);
    call([&] { return live_.remove(list.data(), list.size()); });
  }

  void move(nb::handle ids, nb::handle boxes) {
    const Ids list(ids);
    const BoxArray given(boxes, "boxes", Rounding::exact);
    if (given.size() != list.size()) {
      value_error("boxes: found " + std::to_string(given.size()) + " boxes for " +
                  std::to_string(list.size()) + " ids; give one a box");
    }
    call([&] { return live_.move(list.data(), given.view()); });
  }

  void move_all(nb::handle boxes) {
    const BoxArray given(boxes, "boxes", Rounding::exact);
    call([&] { return live_.move_all(given.view()); });
  }

  void set_filters(nb::handle ids, const nb::tuple& f) {
    const Ids list(ids);
    Kept kept;
    const Filters filters = filters_of(f, list.size(), kept);
    call([&] { return live_.set_filters(list.data(), list.size(), filters); });
  }

  void shift_origin(float x, float y, float z) {
    call([&] { return live_.shift_origin({x, y, z}); });
  }

  Result update() {
    call([&] { return live_.update(); });
    return result_;
  }

  // (m, 3): first, second, slot.
  nb::object begun() const {
    return told([&] { return live_.begun(); });
  }
  nb::object ended() const {
    return told([&] { return live_.ended(); });
  }
  nb::object pairs() {
    return told([&] { return live_.pairs(); });
  }

  nb::object find_overlaps(nb::handle boxes, const nb::tuple& f) {
    BoxArray given(boxes, "boxes", Rounding::exact);
    given.set_filters("", f[0], f[1], f[2], f[3], f[4]);
    nb::object found;
    call([&] { return live_.find_overlaps(given.view()); },
         [&] { found = rows<std::uint32_t>(live_.overlaps().data(), live_.overlaps().size(), 2); });
    return found;
  }

  bool is_alive(nb::handle id) const {
    const auto index = static_cast<ObjectId>(whole(id, "id", 0xffffffffu));
    bool alive = false;
    alone([&] { alive = live_.is_alive(index); });
    return alive;
  }

  std::uint64_t number(std::uint64_t (BroadPhase::*of)() const noexcept) const {
    std::uint64_t value = 0;
    alone([&] { value = (live_.*of)(); });
    return value;
  }

 private:
  // Ids as the library reads them, one beside the other.
  class Ids {
   public:
    explicit Ids(nb::handle value) {
      const std::string wanted = "uint32 of shape (n,)";
      if (value.is_none()) type_error("ids: found None, wanted " + wanted);
      const AnyArray array = import_array(value, "ids", wanted);
      if (array.ndim() != 1) value_error("ids: found " + described(array) + ", wanted " + wanted);
      values_ = import_values<ObjectId>(value, "ids", array.shape(0), kept_);
      if (values_.count == 0 || values_.stride_bytes == sizeof(ObjectId)) return;
      copy_ = std::make_unique<ObjectId[]>(values_.count);
      for (std::size_t i = 0; i < values_.count; ++i) copy_[i] = values_[i];
    }
    const ObjectId* data() const noexcept { return copy_ ? copy_.get() : values_.data; }
    std::size_t size() const noexcept { return values_.count; }

   private:
    Kept kept_;
    Strided<ObjectId> values_;
    std::unique_ptr<ObjectId[]> copy_;
  };

  static Filters filters_of(const nb::tuple& f, std::size_t n, Kept& kept) {
    Filters filters;
    filters.group = import_values<std::uint32_t>(f[0], "group", n, kept);
    filters.mask = import_values<std::uint32_t>(f[1], "mask", n, kept);
    filters.owner = import_values<std::int32_t>(f[2], "owner", n, kept);
    filters.world = import_values<std::int32_t>(f[3], "world", n, kept);
    filters.is_static = import_values<std::uint8_t>(f[4], "static", n, kept);
    return filters;
  }

  // No other call meanwhile, of whatever thread.
  void alone(const std::function<void()>& body) const {
    if (busy_.exchange(true)) {
      throw std::runtime_error("this BroadPhase is at work in another thread; take turns");
    }
    struct End {
      std::atomic<bool>& busy;
      ~End() { busy = false; }
    } end{busy_};
    body();
  }

  // One of the library's, without the interpreter's lock; `then` reads what it told.
  void call(
      const std::function<Result()>& body, const std::function<void()>& then = [] {}) {
    alone([&] {
      Result result;
      {
        const nb::gil_scoped_release unlocked;
        result = body();
      }
      require_ok(result);
      result_ = result;
      then();
    });
  }

  nb::object told(const std::function<LivePairs()>& pairs) const {
    nb::object array;
    alone([&] {
      const LivePairs view = pairs();
      array = rows<std::uint32_t>(view.data(), view.size(), 3);
    });
    return array;
  }

  BroadPhase live_;
  Result result_;
  mutable std::atomic<bool> busy_{false};
};

}  // namespace

void bind_live(nb::module_& m) {
  const auto number = [](std::uint64_t (BroadPhase::*of)() const noexcept) {
    return [of](const LiveObject& self) { return self.number(of); };
  };
  nb::class_<LiveObject>(m, "BroadPhase")
      .def(nb::init<nb::handle, nb::handle, nb::handle, nb::handle>(), nb::arg("margin").none(),
           nb::arg("nan").none(), nb::arg("threads").none(), nb::arg("isa").none())
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
      .def("find_overlaps", &LiveObject::find_overlaps, nb::arg("boxes").none(), nb::arg("filters"))
      .def("is_alive", &LiveObject::is_alive, nb::arg("id").none())
      .def_prop_ro("object_count", number(&BroadPhase::object_count))
      .def_prop_ro("pair_count", number(&BroadPhase::pair_count))
      .def_prop_ro("id_limit", number(&BroadPhase::id_limit))
      .def_prop_ro("slot_limit", number(&BroadPhase::slot_limit));
}

}  // namespace throng::python
