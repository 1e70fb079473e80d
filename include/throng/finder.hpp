// Finder: finds all overlapping pairs, frame after frame, and keeps its workspace.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <type_traits>
#include <utility>

#include <throng/export.h>
#include <throng/boxes.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>

namespace throng {

struct Explanation;

// A view of pairs that a Finder owns; good until its next call.
struct Pairs {
  const Pair* data_ = nullptr;
  std::size_t size_ = 0;

  const Pair* data() const noexcept { return data_; }
  std::size_t size() const noexcept { return size_; }
  bool empty() const noexcept { return size_ == 0; }
  const Pair* begin() const noexcept { return data_; }
  const Pair* end() const noexcept { return data_ + size_; }
  const Pair& operator[](std::size_t i) const noexcept { return data_[i]; }
};

// Who takes pairs as they are found. Refers to the callable, which must outlive the call:
// bool (const Pair* pairs, std::size_t count), false to stop.
class Consumer {
 public:
  using Function = bool (*)(void* context, const Pair* pairs, std::size_t count);
  Consumer(Function function, void* context) noexcept : function_(function), context_(context) {}

  template <class F, class = std::enable_if_t<!std::is_same<std::decay_t<F>, Consumer>::value>>
  Consumer(F&& f) noexcept  // NOLINT(google-explicit-constructor): a function reference
      : function_([](void* context, const Pair* pairs, std::size_t count) -> bool {
          return (*static_cast<std::remove_reference_t<F>*>(context))(pairs, count);
        }),
        context_(const_cast<void*>(static_cast<const void*>(&f))) {}

  bool operator()(const Pair* pairs, std::size_t count) const {
    return function_(context_, pairs, count);
  }

 private:
  Function function_;
  void* context_;
};

// One Finder serves one call at a time, so it must not be called by a consumer of its own;
// different Finders are independent. A Finder that has seen a scene of a size allocates nothing for
// the next of that size. Every call reports through Result::status and never throws of its own.
class THRONG_API Finder {
 public:
  Finder() noexcept = default;
  explicit Finder(const Options& options) noexcept : options_(options) {}
  ~Finder();
  Finder(Finder&& other) noexcept;
  Finder& operator=(Finder&& other) noexcept;
  Finder(const Finder&) = delete;
  Finder& operator=(const Finder&) = delete;

  // Pairs into the Finder's own memory, which grows: see pairs().
  // Cost: n + pairs; docs/choosing.md, 'What each call costs', has all calls and their exceptions.
  Result find(const Boxes& boxes) noexcept;
  Result find(const Boxes& a, const Boxes& b) noexcept;
  Pairs pairs() const noexcept { return pairs_; }

  // Pairs into out[0 .. capacity-1]. Where they do not fit: status buffer_too_small, the exact
  // total in `found`, the first `written` valid (under canonical order none are written).
  // Cost: n + pairs, however few there is room for.
  Result find(const Boxes& boxes, Pair* out, std::size_t capacity) noexcept;
  Result find(const Boxes& a, const Boxes& b, Pair* out, std::size_t capacity) noexcept;

  // Pairs in blocks to `consumer`, one call at a time unless Options::concurrent_consumer; nothing
  // else is stored, and all memory taken stays under Options::memory_cap_bytes. What the consumer
  // throws comes through. It runs in the library's floating-point state: nearest, denormals kept.
  // Cost: n + pairs; sorted, one search more for each range of pairs that the cap has room for.
  Result consume(const Boxes& boxes, Consumer consumer);
  Result consume(const Boxes& a, const Boxes& b, Consumer consumer);

  // The same for boxes of doubles, on the CPU: exactly the pairs of those that overlap as doubles,
  // those grown by the margin rounded outward to doubles. Takes 24 bytes a box more. Not captured.
  // Cost: n + pairs.
  Result find(const DoubleBoxes& boxes) noexcept;
  Result find(const DoubleBoxes& a, const DoubleBoxes& b) noexcept;
  Result find(const DoubleBoxes& boxes, Pair* out, std::size_t capacity) noexcept;
  Result find(const DoubleBoxes& a, const DoubleBoxes& b, Pair* out, std::size_t capacity) noexcept;
  Result consume(const DoubleBoxes& boxes, Consumer consumer);
  Result consume(const DoubleBoxes& a, const DoubleBoxes& b, Consumer consumer);

  // Finds the pairs as find() does, and tells why that costs what it does: see throng/explain.hpp.
  // By the CPU alone. Takes some 100 times as long as find() for small sets; throws Error.
  Explanation explain(const Boxes& boxes);
  Explanation explain(const Boxes& a, const Boxes& b);

  // May be changed between calls; but not `memory` after the first call.
  const Options& options() const noexcept { return options_; }
  void set_options(const Options& options) noexcept { options_ = options; }

  // Bytes that the Finder holds now, those of a device and pinned ones included.
  std::size_t memory_bytes() const noexcept;

 private:
  struct State;
  friend struct FinderAccess;
  State* state_ = nullptr;
  Options options_;
  Pairs pairs_;
};

}  // namespace throng
