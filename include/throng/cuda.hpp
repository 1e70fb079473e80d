// GPU interface: device pointers in and out, on the caller's stream. Standard C++ only, so that any
// compiler accepts it; a build without the GPU backend returns Status::no_device.
//
// A throng::Boxes view may refer to device memory: it is never dereferenced on the host. All
// filters must lie in device memory, too. For arrays in host memory: throng::Finder with
// Backend::cuda.
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>

#include <throng/export.h>
#include <throng/boxes.hpp>
#include <throng/finder.hpp>
#include <throng/options.hpp>
#include <throng/types.hpp>
#include <throng/update_boxes.hpp>

struct CUstream_st;

namespace throng::cuda {

using Stream = CUstream_st*;  // cudaStream_t; null: the default stream

// A call's report in device memory, valid when the work before it on the stream is done.
struct Report {
  std::uint64_t found = 0;        // all pairs, exact even if they did not fit
  std::uint64_t inactive = 0;     // boxes that overlap nothing, including those with a NaN
  std::uint64_t nan_count = 0;    // boxes with a NaN
  std::uint64_t bad_worlds = 0;   // boxes with a world below -1; they count as -1
  std::uint64_t comparisons = 0;  // candidate pairs compared
  std::uint32_t nan_mark = 0;     // ~ of the first such index, so that all fields start at zero
  std::uint32_t bad_world_mark = 0;
  std::uint32_t active = 0;  // boxes stored; 0 if brute force was used
  std::uint32_t unused = 0;

  // With two sets, indices of the second follow those of the first.
  constexpr std::uint32_t first_nan() const noexcept { return ~nan_mark; }
  constexpr std::uint32_t first_bad_world() const noexcept { return ~bad_world_mark; }
};

// Source of device memory; null functions: cudaMalloc and cudaFree. `allocate` returns memory
// aligned to 256 bytes, or null if none is left. Only work on `stream` uses it. Memory that a
// Finder holds at its destruction is released on the stream of its last call.
struct MemoryResource {
  void* (*allocate)(void* self, std::size_t bytes, Stream stream) = nullptr;
  void (*deallocate)(void* self, void* p, std::size_t bytes, Stream stream) = nullptr;
  void* self = nullptr;
};

// Status ok if there is a GPU that this build can use; otherwise no_device, with the reason.
THRONG_API Result available() noexcept;

// A Finder belongs to one GPU, the current one at its first call, and serves one stream at a time.
// It uses the options algorithm, order, nan, margin, measure_stages and cell_scale. At most 1.8e9
// boxes, both sets together. There is no consumer form: a kernel that follows on the stream can
// consume the pairs.
class THRONG_API Finder {
 public:
  explicit Finder(const Options& options = {}, const MemoryResource& memory = {}) noexcept
      : options_(options), memory_(memory) {}
  ~Finder();
  Finder(Finder&& other) noexcept;
  Finder& operator=(Finder&& other) noexcept;
  Finder(const Finder&) = delete;
  Finder& operator=(const Finder&) = delete;

  // Allocates the memory for calls with up to `boxes` boxes (both sets): 49 bytes per box, 57 above
  // 3.5 million boxes; with sorted order 16 bytes more for each of `pairs`. Synchronizes with the
  // stream. A larger reservation than before moves the memory: graphs captured before must be
  // captured again.
  Result reserve(std::size_t boxes, std::size_t pairs, Stream stream) noexcept;

  // Writes pairs to device memory, out[0 .. capacity-1]; synchronizes with the stream. If they do
  // not fit: status buffer_too_small, the exact total in `found`, the first `written` valid (sorted
  // order: none are written). Allocates memory unless reserve() has. If a NaN is refused, the
  // contents of `out` are unspecified. Cost of all forms: n + pairs; up to 4,096 boxes n^2 / 2.
  Result find(const Boxes& boxes, Pair* out, std::size_t capacity, Stream stream) noexcept;
  Result find(const Boxes& a, const Boxes& b, Pair* out, std::size_t capacity,
              Stream stream) noexcept;

  // Writes pairs to the Finder's own device memory, which grows: see pairs(). Synchronizes with the
  // stream. The first call allocates 32 bytes per box for them; if there are more pairs, the memory
  // grows and the search runs again.
  Result find(const Boxes& boxes, Stream stream) noexcept;
  Result find(const Boxes& a, const Boxes& b, Stream stream) noexcept;
  // In device memory; valid until the next call.
  Pairs pairs() const noexcept { return pairs_; }

  // As find() into `out`, but asynchronous: it neither synchronizes nor allocates, so it can be
  // captured into a graph, and a replay is correct for any boxes in that memory. The results are in
  // *report, in device memory. The status is that of the launch: not_reserved if reserve() was not
  // called for as many boxes (and, with sorted order, for `capacity` pairs). A box with a NaN
  // counts as inactive: see Report::nan_count. With sorted order, a `capacity` above 3.8 million is
  // sorted whole, so give no more than needed. Up to there one cooperative kernel sorts the pairs.
  // It starts once the whole GPU is free: it waits for concurrent kernels to end, and deadlocks
  // with a kernel that waits for it.
  Result find_async(const Boxes& boxes, Pair* out, std::size_t capacity, Report* report,
                    Stream stream) noexcept;
  Result find_async(const Boxes& a, const Boxes& b, Pair* out, std::size_t capacity, Report* report,
                    Stream stream) noexcept;

  // Bytes of device memory that the Finder holds now.
  std::size_t memory_bytes() const noexcept;

 private:
  struct State;
  friend struct FinderAccess;
  State* state_ = nullptr;
  Options options_;
  MemoryResource memory_;
  Pairs pairs_;
};

// The report of update_boxes in device memory, valid when the work before it on the stream is done.
struct BodyReport {
  std::uint64_t bad_shapes = 0;  // bodies with an invalid shape; their boxes are NaN
  std::uint32_t bad_shape_mark = 0;

  constexpr std::uint32_t first_bad_shape() const noexcept { return ~bad_shape_mark; }
};

// throng::update_boxes (see there) with bodies, boxes and report in the memory of the stream's
// device: the same bits, except in NaNs. Allocates nothing. Of the options it uses the margin. At
// most max_box_count bodies. Synchronizes with the stream; the Result reports bad shapes.
THRONG_API Result update_boxes(const Bodies& bodies, Box* out, BodyReport* report, Stream stream,
                               const UpdateOptions& options = {},
                               std::size_t stride_bytes = sizeof(Box)) noexcept;

// The same, asynchronous, so that it can be captured into a graph. Only the report, which may be
// null, reports bad shapes.
THRONG_API Result update_boxes_async(const Bodies& bodies, Box* out, BodyReport* report,
                                     Stream stream, const UpdateOptions& options = {},
                                     std::size_t stride_bytes = sizeof(Box)) noexcept;

}  // namespace throng::cuda
