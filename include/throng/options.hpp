// Options of a call, and its Result.
#pragma once

#include <throng/cpp17.hpp>

#include <atomic>
#include <cstddef>
#include <cstdint>

#include <throng/export.h>
#include <throng/memory_resource.hpp>
#include <throng/types.hpp>

namespace throng {

enum class Order : std::uint8_t {
  any,        // fastest; the order differs from run to run with several threads
  canonical,  // sorted by first, then second: identical bytes on every backend
};

enum class Algorithm : std::uint8_t {
  automatic,  // the planner chooses from a sample of the boxes
  all_pairs,  // tiled brute force
  grid,       // columns of cells, each swept along the third axis; on a GPU, cells by size class
};

enum class Backend : std::uint8_t {
  // The CPU; or a GPU from a Finder's second call with at least 200,000 boxes on, if one is present
  // and the CPU has at most four threads for the call. Thresholds measured on an H200. Never a GPU
  // if executor, memory or isa is set. If the GPU fails, the CPU computes the result and
  // plan.reason states why.
  automatic,
  cpu,
  cuda,      // a GPU; boxes in host memory are copied to it
  emulated,  // the GPU algorithm executed on the CPU: slow, for tests and debugging
};

enum class Isa : std::uint8_t {
  automatic,  // the widest that this processor supports, or the one named by the environment
              // variable THRONG_ISA
  scalar,
  sse4,
  avx2,
  avx512,  // the subset of Ice Lake, Zen 4 and later
  neon,
  wasm,  // WebAssembly, 128 bits
};
// All instruction sets; of those of one processor, the later, the wider.
inline constexpr Isa all_isas[] = {Isa::scalar, Isa::sse4, Isa::avx2,
                                   Isa::avx512, Isa::neon, Isa::wasm};

enum class NanPolicy : std::uint8_t {
  refuse,    // a box with a NaN is an error
  inactive,  // a box with a NaN overlaps nothing
};

// What to do with a box that has lower > upper on some axis and no NaN. Many such boxes nearly
// always mean a wrong layout: center and size instead of corners, swapped corners, or another order
// of the six numbers.
enum class InvertedPolicy : std::uint8_t {
  automatic,  // find_pairs refuses it; Finder and BroadPhase treat it as inactive
  refuse,     // an error: Status::inverted_box; the message names the likely cause
  inactive,   // an empty slot: it overlaps nothing and is counted in Result::inactive
};

enum class Status : std::uint8_t {
  ok,
  buffer_too_small,      // `found` is exact; raise the capacity to it
  stopped,               // the consumer returned false, or Options::stop was set
  nan_box,               // see first_invalid, invalid_count
  bad_boxes,             // a coordinate array is missing, or the stride is not a multiple of 4
  bad_filter,            // wrong length or stride, or a world below -1; see first_invalid
  bad_option,            // e.g. a negative margin
  too_many_boxes,        // more than max_box_count in one set
  out_of_memory,         // see bytes_needed
  memory_cap_too_small,  // see bytes_needed
  unsupported_isa,       // this processor or build lacks the requested instruction set
  no_device,             // no GPU, no driver, or a build without the GPU backend
  device_error,          // the message contains CUDA's error text
  not_reserved,          // see cuda::Finder::reserve
  bad_bodies,            // an array is missing, or has a wrong length or stride
  bad_shape,             // a body has an invalid shape; see first_invalid, invalid_count
  bad_id,                // not alive, or twice in one list; see first_invalid, invalid_count
  busy,                  // another thread is in a call on the same object
  ranks_disagree,        // MPI ranks passed different options, or the same id twice
  rank_failed,           // an MPI rank timed out, or MPI failed; the message says which
  inverted_box,          // lower > upper where that is refused; see first_invalid, invalid_count
  bad_mesh,              // an array is missing, has a wrong length or stride, an index is out of
                         // range, or a used vertex is not finite; see first_invalid, invalid_count
};

THRONG_API const char* to_string(Algorithm) noexcept;
THRONG_API const char* to_string(Backend) noexcept;
THRONG_API const char* to_string(Isa) noexcept;
THRONG_API const char* to_string(Status) noexcept;

// A task executor. `run` calls task(context, i) exactly once for every i in [0, count), in any
// order and on any threads, and returns when all calls have returned. With count 1 it may run on
// the calling thread. `run` must not throw: an exception that leaves it terminates the program.
// A CPU search calls `run` once. Each task stays until the search ends; between phases it spins,
// then yields. No task waits for a task that has not started.
struct Executor {
  unsigned concurrency = 1;  // useful number of simultaneous tasks
  void (*run)(void* self, unsigned count, void (*task)(void* context, unsigned index),
              void* context) = nullptr;
  void* self = nullptr;
};

struct Options {
  Algorithm algorithm = Algorithm::automatic;
  Order order = Order::any;
  Backend backend = Backend::automatic;
  NanPolicy nan = NanPolicy::refuse;
  // Boxes in device memory (cuda.hpp) and of MPI ranks are always treated as inactive.
  InvertedPolicy inverted = InvertedPolicy::automatic;
  Isa isa = Isa::automatic;
  // Boxes are compared as lower - margin and upper + margin, rounded outward. World units, >= 0.
  float margin = 0.0f;
  // Maximum number of threads; 0: the executor's concurrency.
  unsigned threads = 0;
  // Consumer form: upper bound on all memory taken, in bytes, including device and pinned memory;
  // 0: no cap.
  std::size_t memory_cap_bytes = 0;
  // Consumer form: allow several threads to call the consumer at once.
  bool concurrent_consumer = false;
  // Measure the time of each stage (two clock reads per stage).
  bool measure_stages = true;
  // Executor to run on; null: the default (oneTBB). Must outlive the call.
  const Executor* executor = nullptr;
  // Memory resource; null: new and delete, with large pages requested for large blocks (see
  // large_pages.hpp; std::pmr::new_delete_resource() does not request them). Must outlive the
  // Finder. Must be thread-safe if a grid of many columns is searched by several threads.
  std::pmr::memory_resource* memory = nullptr;
  // Factor on the cell size that the planner chooses, in [1/64, 64], limited by memory. For tests
  // and planner studies. Does not change the pairs.
  float cell_scale = 1.0f;
  // Cancellation flag, may be set from any thread; null: none. The search then ends soon with
  // Status::stopped and found = 0; the content of the caller's buffer is unspecified. The CPU
  // checks it before each column or tile, and about every 10^8 comparisons within a column (a mesh
  // search every 2,048 candidates); a
  // Finder on a GPU, for boxes in host memory, after each stage and every 10^9 comparisons of brute
  // force. Must outlive the call.
  const std::atomic<bool>* stop = nullptr;
  // An existing folder to capture calls into, for `throng replay`; null: the folder in the
  // environment variable THRONG_CAPTURE, read at the process's first search. Each Finder call
  // writes one new file, a BroadPhase one file from its first call on: boxes, options and results.
  // Writing takes time, and memory outside the memory resource. If a file cannot be written, the
  // result is unaffected and Result::message states the reason. Must outlive the call.
  const char* capture = nullptr;
};

// The plan that was chosen, and the reason.
struct Plan {
  Backend backend = Backend::cpu;
  Algorithm algorithm = Algorithm::automatic;
  Isa isa = Isa::automatic;  // of the CPU; meaningless on a GPU
  unsigned threads = 1;
  unsigned sweep_axis = 0;               // 0, 1, 2: the axis along which each column is swept
  std::uint32_t columns[3] = {1, 1, 1};  // columns, or finest cells, along each axis
  double expected_ns = 0;                // estimated cost in ns
  const char* reason = "";               // one sentence, never null
};

struct StageTimes {
  double plan_ms = 0;   // sampling, planning, splitting by world and by static
  double bin_ms = 0;    // reading, checking and sorting the boxes into columns
  double find_ms = 0;   // finding and writing pairs
  double order_ms = 0;  // sorting pairs, for Order::canonical
  double total_ms = 0;

  StageTimes& operator+=(const StageTimes& other) noexcept {
    plan_ms += other.plan_ms;
    bin_ms += other.bin_ms;
    find_ms += other.find_ms;
    order_ms += other.order_ms;
    total_ms += other.total_ms;
    return *this;
  }
};

// The outcome of a call. It is the only error report, hence [[nodiscard]].
struct [[nodiscard]] Result {
  Status status = Status::ok;
  std::uint64_t found = 0;        // number of pairs, exact even if the buffer was too small
  std::uint64_t written = 0;      // pairs written or passed to the consumer
  std::uint64_t inactive = 0;     // boxes that overlap nothing: lower > upper, or NaN where allowed
  std::uint64_t comparisons = 0;  // candidate pairs compared (each SIMD lane counts)
  // Cells, columns, records and tree nodes visited, in addition to comparisons. A box has one
  // record in each column that it touches. 0 on a GPU and for Backend::emulated.
  std::uint64_t visited = 0;
  std::uint64_t first_invalid = 0;
  std::uint64_t invalid_count = 0;
  std::uint64_t bytes_needed = 0;
  Plan plan;
  StageTimes times;
  // What went wrong, with the number and the fix; empty on success.
  char message[224] = {};

  bool ok() const noexcept { return status == Status::ok; }
};

}  // namespace throng
