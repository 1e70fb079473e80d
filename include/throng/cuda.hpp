// GPU users: device pointers in and out, on a stream of the caller's. Standard C++ only, so that
// any compiler takes it; a build without the GPU backend answers Status::no_device.
//
// A throng::Boxes view may show device memory: it is never read on the host. All filters lie in
// device memory, too. Arrays in host memory: throng::Finder with Backend::cuda.
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

// What a call tells in device memory, when the work before it on the stream is done.
struct Report {
  std::uint64_t found = 0;        // pairs there are, exact even where there was no room
  std::uint64_t inactive = 0;     // boxes that overlap nothing, those with a NaN among them
  std::uint64_t nan_count = 0;    // boxes with a NaN
  std::uint64_t bad_worlds = 0;   // boxes with a world below -1; they count as -1
  std::uint64_t comparisons = 0;  // candidate pairs compared
  std::uint32_t nan_mark = 0;     // ~ of the first such index: all fields start from zero
  std::uint32_t bad_world_mark = 0;
  std::uint32_t active = 0;  // boxes stored; 0 where brute force was used
  std::uint32_t unused = 0;

  // Of two sets the indices of the second follow those of the first.
  constexpr std::uint32_t first_nan() const noexcept { return ~nan_mark; }
  constexpr std::uint32_t first_bad_world() const noexcept { return ~bad_world_mark; }
};

// Where device memory comes from; null functions: cudaMalloc and cudaFree. `allocate` returns null
// where there is none; what it returns is aligned to 256 bytes. Work on `stream` alone uses it.
// What a Finder still holds when it ends is given back on the stream of its last call.
struct MemoryResource {
  void* (*allocate)(void* self, std::size_t bytes, Stream stream) = nullptr;
  void (*deallocate)(void* self, void* p, std::size_t bytes, Stream stream) = nullptr;
  void* self = nullptr;
};

// Status ok where there is a GPU that this build can use; else no_device, and the message says why.
THRONG_API Result available() noexcept;

// One Finder serves one GPU, that which is current at its first call, and one stream at a time.
// Options: algorithm, order, nan, margin, measure_stages and cell_scale are heeded. 1.8e9 boxes at
// most, of both sets together. There is no consumer form: on a device who takes pairs is a kernel,
// which can follow on the stream.
class THRONG_API Finder {
 public:
  explicit Finder(const Options& options = {}, const MemoryResource& memory = {}) noexcept
      : options_(options), memory_(memory) {}
  ~Finder();
  Finder(Finder&& other) noexcept;
  Finder& operator=(Finder&& other) noexcept;
  Finder(const Finder&) = delete;
  Finder& operator=(const Finder&) = delete;

  // Takes the memory that calls with up to so many boxes (of both sets) need: 49 bytes a box, of
  // more than 3.5 million 57; under canonical order 16 bytes more for each of `pairs`. Waits for
  // the stream. Asking for more than before moves that memory: graphs captured until then must be
  // captured anew.
  Result reserve(std::size_t boxes, std::size_t pairs, Stream stream) noexcept;

  // Pairs into device memory, out[0 .. capacity-1]; waits for the stream. Where they do not fit:
  // status buffer_too_small, the exact total in `found`, the first `written` valid (canonical: none
  // are written). Takes memory where reserve() has not. Where a NaN is refused, what stands
  // in `out` is of no use.
  // Cost: n + pairs, of all forms; up to 4,096 boxes n^2 / 2.
  Result find(const Boxes& boxes, Pair* out, std::size_t capacity, Stream stream) noexcept;
  Result find(const Boxes& a, const Boxes& b, Pair* out, std::size_t capacity,
              Stream stream) noexcept;

  // Pairs into device memory of the Finder's own, which grows: see pairs(). Waits for the stream.
  // The first call takes 32 bytes a box for them; where there are more, room is made and they are
  // found once more.
  Result find(const Boxes& boxes, Stream stream) noexcept;
  Result find(const Boxes& a, const Boxes& b, Stream stream) noexcept;
  // In device memory; good until the next call.
  Pairs pairs() const noexcept { return pairs_; }

  // As find() into `out`, only put on the stream: nothing is waited for and no memory is taken, so
  // it can be captured into a graph, and a replay is right for whatever boxes then lie there. What
  // was found stands in *report, in device memory; the status is that of putting it there,
  // not_reserved where reserve() was not called for so many boxes (and, under canonical order, for
  // `capacity` pairs). A box with a NaN counts as inactive: see Report::nan_count. Under canonical
  // order all of a `capacity` of more than 3.8 million is sorted, so give no more than is needed.
  // Up to there one kernel orders the pairs, which begins when it has the whole GPU: it waits for
  // kernels beside it to end, and a kernel that in turn waits for it keeps both from ending.
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

// What update_boxes tells in device memory, when the work before it on the stream is done.
struct BodyReport {
  std::uint64_t bad_shapes = 0;  // bodies whose shape is wrong; their boxes are NaN
  std::uint32_t bad_shape_mark = 0;

  constexpr std::uint32_t first_bad_shape() const noexcept { return ~bad_shape_mark; }
};

// throng::update_boxes (see there) on bodies, boxes and report in the memory of the stream's
// device: the same bits, but for those of a NaN. Takes no memory. Of the options the margin is
// heeded. At most max_box_count bodies. This one waits for the stream, and its Result tells of bad
// shapes.
THRONG_API Result update_boxes(const Bodies& bodies, Box* out, BodyReport* report, Stream stream,
                               const UpdateOptions& options = {},
                               std::size_t stride_bytes = sizeof(Box)) noexcept;

// The same, only put on the stream, so that it can be captured into a graph. Of bad shapes the
// report alone tells; it may be null.
THRONG_API Result update_boxes_async(const Bodies& bodies, Box* out, BodyReport* report,
                                     Stream stream, const UpdateOptions& options = {},
                                     std::size_t stride_bytes = sizeof(Box)) noexcept;

}  // namespace throng::cuda
