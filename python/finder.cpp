#include "python/finder.hpp"

#include <string>

#include <throng/find_pairs.hpp>

#include "python/errors.hpp"

namespace throng::python {
namespace {

// Calls with the boxes of both sets, all float32 or all float64.
template <class Call>
Result with_views(const BoxArray& a, const BoxArray* b, const Call& call) {
  if (a.is_double()) return b ? call(a.doubles(), b->doubles()) : call(a.doubles());
  return b ? call(a.view(), b->view()) : call(a.view());
}

std::size_t count_of(const BoxArray& a, const BoxArray* b) {
  return a.size() + (b ? b->size() : 0);
}

void require_same_dimensions(const BoxArray& a, const BoxArray* b) {
  if (!b || a.dimensions() == b->dimensions() || a.size() == 0 || b->size() == 0) return;
  value_error("other: found " + std::to_string(b->dimensions()) + "-D boxes and " +
              std::to_string(a.dimensions()) + "-D ones in boxes, wanted the same of both");
}

}  // namespace

FinderObject::FinderObject(const Options& options, Rounding rounding, bool once)
    : rounding_(rounding), search_(once) {
  finder_.set_options(search_.with_executor(options));
}

std::size_t FinderObject::memory_bytes() const {
  return finder_.memory_bytes() + (on_gpu_ ? on_gpu_->memory_bytes() : 0);
}

Explanation FinderObject::explain(const BoxArray& a, const BoxArray* b) {
  const PairSearch::Guard busy(search_);
  require_same_dimensions(a, b);
  Explanation explanation;
  search_.run(count_of(a, b), [&] {
    try {
      explanation = b ? finder_.explain(a.view(), b->view()) : finder_.explain(a.view());
      return explanation.result;
    } catch (const Error& error) {
      return error.result();
    }
  });
  require_ok(result());
  return explanation;
}

nb::object FinderObject::find_on_gpu(const BoxArray& a, const BoxArray* b,
                                     const ArrayDevice& array_device, bool to_host) {
  const Backend backend = finder_.options().backend;
  if (backend != Backend::automatic && backend != Backend::cuda) {
    value_error(std::string("backend: found '") + to_string(backend) + "' for boxes on " +
                array_device.name() + "; give 'auto', or copy them to the host");
  }
  require_same_dimensions(a, b);
  if (!on_gpu_ || on_gpu_->device() != array_device.device) {
    on_gpu_.reset();
    on_gpu_ = std::make_unique<DeviceFinder>(finder_.options(), array_device.device);
  }
  nb::object pairs = on_gpu_->find(a, b, array_device.stream, to_host, search_.result());
  // A GPU counts such boxes without an index; to name one, they are checked here.
  if (finder_.options().inverted == InvertedPolicy::refuse && result().inactive != 0)
    require_ok(on_gpu_->check(a, b));
  return pairs;
}

nb::object FinderObject::find(const BoxArray& a, const BoxArray* b, const ArrayDevice& array_device,
                              bool to_host) {
  const PairSearch::Guard busy(search_);
  if (array_device.on_gpu) return find_on_gpu(a, b, array_device, to_host);
  require_same_dimensions(a, b);
  return search_.find(count_of(a, b), [&](Pair* out, std::size_t capacity) {
    return with_views(a, b,
                      [&](const auto&... sets) { return finder_.find(sets..., out, capacity); });
  });
}

void FinderObject::consume(const BoxArray& a, const BoxArray* b, nb::handle callback) {
  const PairSearch::Guard busy(search_);
  require_same_dimensions(a, b);
  search_.consume(count_of(a, b), callback, [&](Consumer consumer) {
    return with_views(a, b,
                      [&](const auto&... sets) { return finder_.consume(sets..., consumer); });
  });
}

}  // namespace throng::python
