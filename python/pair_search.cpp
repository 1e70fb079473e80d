#include "python/pair_search.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <optional>
#include <stdexcept>
#include <utility>

#include <nanobind/ndarray.h>

#include <throng/large_pages.hpp>

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

PairSearch::Guard::Guard(PairSearch& search) : search_(search) {
  if (search.busy_.exchange(true)) {
    throw std::runtime_error(
        "this Finder is searching in another thread, or called by its own consumer; give each "
        "its own Finder");
  }
}

PairSearch::Guard::~Guard() { search_.busy_ = false; }

Options PairSearch::with_executor(const Options& options) const {
  Options o = options;
  o.executor = &executor();
  o.stop = &stop_;
  return o;
}

void PairSearch::run(std::size_t elements, const std::function<Result()>& call) {
  stop_ = false;
  run_unlocked(elements >= long_from, stop_, [&] { result_ = call(); });
}

nb::object PairSearch::find(std::size_t elements,
                            const std::function<Result(Pair* out, std::size_t capacity)>& call) {
  std::size_t capacity = std::min(pairs_per_box * elements + min_pairs, most_pairs);
  if (has_estimate_) capacity = static_cast<std::size_t>(result_.found + result_.found / 8) + 64;
  struct Owner {
    std::shared_ptr<PairBufferPool> buffer_pool;
    PairBufferPool::Buffer buffer;
    ~Owner() { buffer_pool->give_back(buffer); }
  };
  auto owner = std::unique_ptr<Owner>(new Owner{buffers_, buffers_->take(capacity)});
  PairBufferPool::Buffer& buffer = owner->buffer;
  const auto attempt = [&] { run(elements, [&] { return call(buffer.data, buffer.capacity); }); };
  has_estimate_ = false;
  attempt();
  if (result_.status == Status::buffer_too_small) {
    const auto found = static_cast<std::size_t>(result_.found);
    buffers_->give_back(std::exchange(buffer, PairBufferPool::Buffer{}));
    buffer = buffers_->take(single_use_ ? found : found + found / 8);
    attempt();
  }
  require_ok(result_);
  has_estimate_ = true;
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

void PairSearch::consume(std::size_t elements, nb::handle callback,
                         const std::function<Result(Consumer)>& call) {
  if (!PyCallable_Check(callback.ptr())) {
    type_error("callback: found " + described(callback) +
               ", wanted a function of an (k, 2) uint32 array");
  }
  if (is_ending()) {
    throw std::runtime_error("callback: the interpreter is ending, and calls none; use find");
  }
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
  has_estimate_ = false;
  run(elements, [&] { return call(consumer); });
  if (raised) throw std::move(*raised);
  if (result_.status != Status::stopped) require_ok(result_);
}

}  // namespace throng::python
