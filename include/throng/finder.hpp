// Finder: finds all overlapping pairs and keeps its workspace from frame to frame.
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

// A view of pairs that a Finder owns; valid until its next call.
using Pairs = ArrayView<Pair>;

// A reference to a callable bool(const Pair* pairs, std::size_t count) that receives blocks of
// pairs; it returns false to stop. The callable must outlive the call.
class Consumer {
 public:
  using Function = bool (*)(void* context, const Pair* pairs, std::size_t count);
  Consumer(Function function, void* context) noexcept : function_(function), context_(context) {}

  template <class F, class = std::enable_if_t<!std::is_same<std::decay_t<F>, Consumer>::value>>
  Consumer(F&& f) noexcept  // NOLINT(google-explicit-constructor): a function reference
      : function_([](void* context, const Pair* pairs, std::size_t count) -> bool {
          return (*reinterpret_cast<std::remove_reference_t<F>*>(context))(pairs, count);
        }),
        context_(const_cast<void*>(reinterpret_cast<const void*>(&f))) {}

  bool operator()(const Pair* pairs, std::size_t count) const {
    return function_(context_, pairs, count);
  }

 private:
  Function function_;
  void* context_;
};

// Thread safety: one call at a time per Finder, so a consumer must not call its own Finder.
// Different Finders are independent.
// A call allocates nothing if an earlier call handled a scene of the same size. Errors are reported
// in Result::status; only consume() and explain() can throw.
class THRONG_API Finder {
 public:
  Finder() noexcept = default;
  explicit Finder(const Options& options) noexcept : options_(options) {}
  ~Finder();
  Finder(Finder&& other) noexcept;
  Finder& operator=(Finder&& other) noexcept;
  Finder(const Finder&) = delete;
  Finder& operator=(const Finder&) = delete;

  // Stores the pairs in the Finder's own growing buffer; see pairs().
  // Cost: O(n + pairs); docs/how-to/choose.md, 'What each call costs', lists all calls and
  // exceptions.
  Result find(const Boxes& boxes) noexcept;
  Result find(const Boxes& a, const Boxes& b) noexcept;
  Pairs pairs() const noexcept { return pairs_; }

  // Writes the pairs to out[0 .. capacity-1]. If they do not fit: Status::buffer_too_small, the
  // exact total in `found`, and the first `written` pairs valid (none with Order::canonical).
  // Cost: O(n + pairs), independent of the capacity.
  Result find(const Boxes& boxes, Pair* out, std::size_t capacity) noexcept;
  Result find(const Boxes& a, const Boxes& b, Pair* out, std::size_t capacity) noexcept;

  // Passes blocks of pairs to `consumer`, one call at a time unless Options::concurrent_consumer is
  // set. Stores no pairs beyond a block; all memory stays under Options::memory_cap_bytes.
  // Exceptions of the consumer propagate. The consumer runs in the library's floating-point state:
  // round to nearest, denormals kept.
  // Cost: O(n + pairs); with Order::canonical one more search for each range of pairs that fits
  // under the cap.
  Result consume(const Boxes& boxes, Consumer consumer);
  Result consume(const Boxes& a, const Boxes& b, Consumer consumer);

  // The same for boxes of doubles, on the CPU only. Boxes are compared exactly as doubles, after
  // the margin is applied and rounded outward to doubles. Takes 24 bytes more per box. Not
  // captured.
  // Cost: O(n + pairs).
  Result find(const DoubleBoxes& boxes) noexcept;
  Result find(const DoubleBoxes& a, const DoubleBoxes& b) noexcept;
  Result find(const DoubleBoxes& boxes, Pair* out, std::size_t capacity) noexcept;
  Result find(const DoubleBoxes& a, const DoubleBoxes& b, Pair* out, std::size_t capacity) noexcept;
  Result consume(const DoubleBoxes& boxes, Consumer consumer);
  Result consume(const DoubleBoxes& a, const DoubleBoxes& b, Consumer consumer);

  // Runs find() on the CPU and explains its cost; see throng/explain.hpp. About 100 times slower
  // than find() on small sets. Throws Error.
  Explanation explain(const Boxes& boxes);
  Explanation explain(const Boxes& a, const Boxes& b);

  // Options may change between calls, except `memory` after the first call.
  const Options& options() const noexcept { return options_; }
  void set_options(const Options& options) noexcept { options_ = options; }

  // Bytes held now, including device and pinned memory.
  std::size_t memory_bytes() const noexcept;

 private:
  struct State;
  friend struct FinderAccess;
  State* state_ = nullptr;
  Options options_;
  Pairs pairs_;
};

}  // namespace throng
