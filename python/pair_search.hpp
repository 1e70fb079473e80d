// What the Finders of Python share: calls without the interpreter's lock, and their pairs as
// arrays.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

#include <nanobind/nanobind.h>

#include <throng/finder.hpp>

#include "python/errors.hpp"

namespace throng::python {

// Below this many boxes a search is too short to interrupt, and a switch of threads would matter.
inline constexpr std::size_t long_from = 32768;

// Runs `body` without the interpreter's lock. A long one runs on a thread of the pool, so that the
// caller notices Ctrl-C: then *stop becomes true, and after `body` the signal handler's exception
// is thrown.
void run_unlocked(bool is_long, std::atomic<bool>& stop, const std::function<void()>& body);

// Buffers for pairs. A released array's buffer serves the next search, so a loop over frames
// touches no fresh memory.
class PairBufferPool {
 public:
  struct Buffer {
    Pair* data = nullptr;
    std::size_t capacity = 0;
  };
  PairBufferPool() = default;
  ~PairBufferPool();
  PairBufferPool(const PairBufferPool&) = delete;
  PairBufferPool& operator=(const PairBufferPool&) = delete;

  // MemoryError if there is none.
  Buffer take(std::size_t capacity);
  void give_back(Buffer buffer) noexcept;

 private:
  static constexpr int most = 2;
  std::mutex mutex_;
  Buffer buffers_[most];
};

// The calls of one finder object. `elements` is the number of boxes or triangles of a call.
class PairSearch {
 public:
  // One call at a time: while the lock is released, another thread or the consumer itself may
  // call. RuntimeError if one is in progress.
  class Guard {
   public:
    explicit Guard(PairSearch& search);
    ~Guard();
    Guard(const Guard&) = delete;
    Guard& operator=(const Guard&) = delete;

   private:
    PairSearch& search_;
  };

  // `single_use`: the buffer of the pairs is shrunk to them.
  explicit PairSearch(bool single_use) noexcept : single_use_(single_use) {}

  // The options, with this module's threads, and the flag that Ctrl-C sets.
  Options with_executor(const Options& options) const;

  // (m, 2) uint32. `call` writes up to `capacity` pairs, and is called again if there are more.
  nb::object find(std::size_t elements,
                  const std::function<Result(Pair* out, std::size_t capacity)>& call);
  // Passes blocks of pairs to `callback`.
  void consume(std::size_t elements, nb::handle callback,
               const std::function<Result(Consumer)>& call);
  // Any other call; its result is not checked.
  void run(std::size_t elements, const std::function<Result()>& call);

  const Result& result() const noexcept { return result_; }
  // For a result from elsewhere. The caller holds a Guard.
  Result& result() noexcept { return result_; }

 private:
  bool single_use_;
  bool has_estimate_ = false;  // result_.found estimates the pairs of the next call
  std::shared_ptr<PairBufferPool> buffers_ = std::make_shared<PairBufferPool>();
  std::atomic<bool> stop_{false};
  std::atomic<bool> busy_{false};
  Result result_;
};

}  // namespace throng::python
