#include "python/finder.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <stdexcept>

#include <throng/find_pairs.hpp>
#include <throng/large_pages.hpp>

#include "python/errors.hpp"
#include "python/lock.hpp"
#include "python/pool.hpp"

namespace throng::python {
namespace {

// Initial pair capacity. Pages that are not written take no memory.
constexpr std::size_t pairs_per_box = 16, min_pairs = 4096, most_pairs = std::size_t{1} << 27;

// Interprets a consumer's result: None means continue, else its truth value.
bool should_continue(nb::handle callback, const nb::object& block) {
  const auto answer = nb::steal(call_one(callback.ptr(), block.ptr()));
  if (!answer.is_valid()) throw nb::python_error();
  const int more = answer.is_none() ? 1 : is_true(answer.ptr());
  if (more < 0) throw nb::python_error();
  return more != 0;
}

struct Signals {
  std::atomic<bool>& stop;
  std::optional<nb::python_error> raised{};

  void poll() {
    if (raised) return;
    const Locked locked;
    if (PyErr_CheckSignals() == 0) return;
    raised.emplace();
    stop = true;
  }
};

struct Body {
  const std::function<void()>& run;
  std::exception_ptr thrown{};
};

void run_body(void* context) {
  auto& body = *static_cast<Body*>(context);
  try {
    body.run();
  } catch (...) {
    body.thrown = std::current_exception();
  }
}

// Calls with the boxes of both sets, all float32 or all float64.
template <class Call>
Result with_views(const BoxArray& a, const BoxArray* b, const Call& call) {
  if (a.is_double()) return b ? call(a.doubles(), b->doubles()) : call(a.doubles());
  return b ? call(a.view(), b->view()) : call(a.view());
}

}  // namespace

void run_unlocked(bool is_long, std::atomic<bool>& stop, const std::function<void()>& run) {
  Body body{run};
  Signals signals{stop};
  {
    // When the interpreter ends, the pool's threads may be blocked for ever.
    const bool in_background = is_long && !is_ending();
    const Unlocked unlocked;
    const auto poll = [](void* s) { static_cast<Signals*>(s)->poll(); };
    if (!in_background || !pool().run_in_background(run_body, &body, poll, &signals))
      run_body(&body);
  }
  if (signals.raised) throw std::move(*signals.raised);
  if (body.thrown) std::rethrow_exception(body.thrown);
}

PairBufferPool::~PairBufferPool() {
  for (Buffer& buffer : buffers_) std::free(buffer.data);
}

PairBufferPool::Buffer PairBufferPool::take(std::size_t capacity) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (Buffer& buffer : buffers_) {
      if (buffer.data && buffer.capacity >= capacity) return std::exchange(buffer, Buffer{});
    }
  }
  if (capacity <= PTRDIFF_MAX / sizeof(Pair)) {
    if (auto* data = static_cast<Pair*>(std::malloc(capacity * sizeof(Pair)))) {
      want_large_pages(data, capacity * sizeof(Pair));
      return {data, capacity};
    }
  }
  memory_error("no memory for the " + std::to_string(capacity) +
               " pairs; take them in blocks by Finder.consume");
}

void PairBufferPool::give_back(Buffer buffer) noexcept {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (Buffer& kept : buffers_) {
    if (buffer.capacity > kept.capacity) std::swap(buffer, kept);
  }
  std::free(buffer.data);
}

// One call at a time: while the lock is released, another thread or the consumer itself may call.
class FinderObject::CallGuard {
 public:
  explicit CallGuard(FinderObject& finder) : finder_(finder) {
    if (finder.busy_.exchange(true)) {
      throw std::runtime_error(
          "this Finder is searching in another thread, or called by its own consumer; give each "
          "its own Finder");
    }
  }
  ~CallGuard() { finder_.busy_ = false; }
  CallGuard(const CallGuard&) = delete;
  CallGuard& operator=(const CallGuard&) = delete;

 private:
  FinderObject& finder_;
};

FinderObject::FinderObject(const Options& options, Rounding rounding, bool once)
    : rounding_(rounding), single_use_(once) {
  Options o = options;
  o.executor = &executor();
  o.stop = &stop_;
  finder_.set_options(o);
}

std::size_t FinderObject::memory_bytes() const {
  return finder_.memory_bytes() + (on_gpu_ ? on_gpu_->memory_bytes() : 0);
}

void FinderObject::require_same_dimensions(const BoxArray& a, const BoxArray* b) {
  if (!b || a.dimensions() == b->dimensions() || a.size() == 0 || b->size() == 0) return;
  value_error("other: found " + std::to_string(b->dimensions()) + "-D boxes and " +
              std::to_string(a.dimensions()) + "-D ones in boxes, wanted the same of both");
}

Explanation FinderObject::explain(const BoxArray& a, const BoxArray* b) {
  if (rounding_ == Rounding::exact) {
    value_error(
        "round: found 'exact', and only searches of float32 are explained; take a Finder with "
        "round='outward'");
  }
  const CallGuard busy(*this);
  Explanation explanation;
  search(a, b, [&] {
    try {
      explanation = b ? finder_.explain(a.view(), b->view()) : finder_.explain(a.view());
      return explanation.result;
    } catch (const Error& error) {
      return error.result();
    }
  });
  require_ok(result_);
  has_result_ = true;
  return explanation;
}

void FinderObject::search(const BoxArray& a, const BoxArray* b,
                          const std::function<Result()>& call) {
  require_same_dimensions(a, b);
  stop_ = false;
  run_unlocked(a.size() + (b ? b->size() : 0) >= long_from, stop_, [&] { result_ = call(); });
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
  nb::object pairs = on_gpu_->find(a, b, array_device.stream, to_host, result_);
  // A GPU counts such boxes without an index; to name one, they are checked here.
  if (finder_.options().inverted == InvertedPolicy::refuse && result_.inactive != 0)
    require_ok(on_gpu_->check(a, b));
  return pairs;
}

nb::object FinderObject::find(const BoxArray& a, const BoxArray* b, const ArrayDevice& array_device,
                              bool to_host) {
  const CallGuard busy(*this);
  if (array_device.on_gpu) return find_on_gpu(a, b, array_device, to_host);
  const std::size_t boxes = a.size() + (b ? b->size() : 0);
  std::size_t capacity = std::min(pairs_per_box * boxes + min_pairs, most_pairs);
  if (has_result_) capacity = static_cast<std::size_t>(result_.found + result_.found / 8) + 64;
  struct Owner {
    std::shared_ptr<PairBufferPool> buffer_pool;
    PairBufferPool::Buffer buffer;
    ~Owner() { buffer_pool->give_back(buffer); }
  };
  auto owner = std::unique_ptr<Owner>(new Owner{buffers_, buffers_->take(capacity)});
  PairBufferPool::Buffer& buffer = owner->buffer;
  const auto attempt = [&] {
    search(a, b, [&] {
      return with_views(a, b, [&](const auto&... sets) {
        return finder_.find(sets..., buffer.data, buffer.capacity);
      });
    });
  };
  has_result_ = false;
  attempt();
  if (result_.status == Status::buffer_too_small) {
    const auto found = static_cast<std::size_t>(result_.found);
    buffers_->give_back(std::exchange(buffer, PairBufferPool::Buffer{}));
    buffer = buffers_->take(single_use_ ? found : found + found / 8);
    attempt();
  }
  require_ok(result_);
  has_result_ = true;
  const auto found = static_cast<std::size_t>(result_.found);
  if (single_use_) {
    // Shrinks the buffer; large ones are not moved by this.
    const std::size_t kept = std::max<std::size_t>(found, 1);
    if (auto* data = static_cast<Pair*>(std::realloc(buffer.data, kept * sizeof(Pair)))) {
      buffer = {data, kept};
    }
  }
  auto* data = reinterpret_cast<std::uint32_t*>(buffer.data);
  const nb::capsule capsule(owner.release(),
                            [](void* p) noexcept { delete static_cast<Owner*>(p); });
  return nb::cast(nb::ndarray<nb::numpy, std::uint32_t>(data, {found, 2}, capsule));
}

void FinderObject::consume(const BoxArray& a, const BoxArray* b, nb::handle callback) {
  if (!PyCallable_Check(callback.ptr())) {
    type_error("callback: found " + described(callback) +
               ", wanted a function of an (k, 2) uint32 array");
  }
  if (is_ending()) {
    throw std::runtime_error("callback: the interpreter is ending, and calls none; use find");
  }
  const CallGuard busy(*this);
  std::optional<nb::python_error> raised;
  // The callback keeps each block, and blocks are small.
  auto consumer = [&](const Pair* pairs, std::size_t count) {
    const Locked locked;
    try {
      auto* copy = new Pair[count];
      std::memcpy(copy, pairs, count * sizeof(Pair));
      const nb::capsule owner(copy, [](void* p) noexcept { delete[] static_cast<Pair*>(p); });
      const nb::object block = nb::cast(nb::ndarray<nb::numpy, std::uint32_t>(
          reinterpret_cast<std::uint32_t*>(copy), {count, 2}, owner));
      return should_continue(callback, block);
    } catch (nb::python_error& error) {
      raised.emplace(std::move(error));
      return false;
    }
  };
  has_result_ = false;
  search(a, b, [&] {
    return with_views(a, b,
                      [&](const auto&... sets) { return finder_.consume(sets..., consumer); });
  });
  if (raised) throw std::move(*raised);
  if (result_.status != Status::stopped) require_ok(result_);
}

}  // namespace throng::python
