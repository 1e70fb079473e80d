// The Finder of Python, and the long calls of the module.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>

#include <nanobind/nanobind.h>

#include <throng/explain.hpp>
#include <throng/finder.hpp>

#include "python/arrays.hpp"
#include "python/device.hpp"

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

class FinderObject {
 public:
  // `once`: only the result is kept.
  FinderObject(const Options& options, Rounding rounding, bool once);

  // (m, 2) uint32. `b` may be null; both have one type. GPU results stay there, or are copied
  // `to_host`.
  nb::object find(const BoxArray& a, const BoxArray* b, const ArrayDevice& array_device,
                  bool to_host);
  void consume(const BoxArray& a, const BoxArray* b, nb::handle callback);
  // ValueError for Rounding::exact.
  Explanation explain(const BoxArray& a, const BoxArray* b);

  Rounding rounding() const noexcept { return rounding_; }
  const Result& result() const noexcept { return result_; }
  std::size_t memory_bytes() const;

 private:
  class CallGuard;
  static void require_same_dimensions(const BoxArray& a, const BoxArray* b);
  nb::object find_on_gpu(const BoxArray& a, const BoxArray* b, const ArrayDevice& array_device,
                         bool to_host);
  void search(const BoxArray& a, const BoxArray* b, const std::function<Result()>& call);

  Finder finder_;
  Rounding rounding_;
  bool single_use_;
  std::unique_ptr<DeviceFinder> on_gpu_;
  bool has_result_ = false;
  std::shared_ptr<PairBufferPool> buffers_ = std::make_shared<PairBufferPool>();
  std::atomic<bool> stop_{false};
  std::atomic<bool> busy_{false};
  Result result_;
};

}  // namespace throng::python
