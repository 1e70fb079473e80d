// What a caller may ask for, and what every call answers.
#pragma once

#include <throng/cpp17.hpp>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory_resource>

#include <throng/export.h>
#include <throng/types.hpp>

namespace throng {

enum class Order : std::uint8_t {
  any,        // fastest; differs from run to run with several threads
  canonical,  // sorted by first, then second: the same bytes everywhere
};

enum class Algorithm : std::uint8_t {
  automatic,  // the planner chooses from what it measures of the boxes
  all_pairs,  // tiled brute force
  grid,       // columns of cells, each swept along the third axis; on a GPU cells by size classes
};

enum class Backend : std::uint8_t {
  // The CPU; or a GPU, from a Finder's second call with 200,000 boxes or more on, where there is
  // one and the CPU has four threads or fewer for this: where it pays, as measured on an H200.
  // Never where executor, memory or isa are set. If the GPU cannot, the CPU answers, and
  // plan.reason says so.
  automatic,
  cpu,
  cuda,      // a GPU; boxes in host memory are copied to it
  emulated,  // what a GPU would run, run by this processor: slow, for tests and for finding faults
};

enum class Isa : std::uint8_t {
  automatic,  // the widest this processor has, or what the environment variable THRONG_ISA names
  scalar,
  sse4,
  avx2,
  avx512,  // as Ice Lake and Zen 4 have it, and later ones
  neon,
};

enum class NanPolicy : std::uint8_t {
  refuse,    // a box with a NaN is an error
  inactive,  // a box with a NaN overlaps nothing
};

// A box with lower > upper on some axis, and no NaN. Many of them are nearly always a mistaken
// layout: boxes given as center and size, corners swapped, another order of the six numbers.
enum class InvertedPolicy : std::uint8_t {
  automatic,  // find_pairs refuses it; Finder and BroadPhase take it as inactive
  refuse,     // an error: Status::inverted_box, and the message names the likely cause
  inactive,   // an empty slot: it overlaps nothing, and is counted in Result::inactive
};

enum class Status : std::uint8_t {
  ok,
  buffer_too_small,      // `found` is exact; raise the capacity to it
  stopped,               // the consumer returned false, or Options::stop was set
  nan_box,               // see first_invalid, invalid_count
  bad_boxes,             // a coordinate array is missing, or the stride is no multiple of 4
  bad_filter,            // wrong length or stride, or a world below -1; see first_invalid
  bad_option,            // e.g. a negative margin
  too_many_boxes,        // more than max_box_count in one set
  out_of_memory,         // see bytes_needed
  memory_cap_too_small,  // see bytes_needed
  unsupported_isa,       // this processor or build lacks the one asked for
  no_device,             // no GPU, no driver, or a build without the GPU backend
  device_error,          // what CUDA says stands in the message
  not_reserved,          // see cuda::Finder::reserve
  bad_bodies,            // an array is missing, or has a wrong length or stride
  bad_shape,             // of a body; see first_invalid, invalid_count
  bad_id,                // not alive, or twice in one list; see first_invalid, invalid_count
  busy,                  // another thread is in a call on the same object
  ranks_disagree,        // MPI ranks gave different options, or one id twice
  rank_failed,           // an MPI rank did not come in time, or MPI failed; the message says which
  inverted_box,          // lower > upper, where that is refused; see first_invalid, invalid_count
};

THRONG_API const char* to_string(Algorithm) noexcept;
THRONG_API const char* to_string(Backend) noexcept;
THRONG_API const char* to_string(Isa) noexcept;
THRONG_API const char* to_string(Status) noexcept;

// Where work runs. `run` calls task(context, i) once for every i in 0..count-1, in any order and on
// any threads, and returns when all have returned. A call with count 1 may run on the caller.
// `run` throws nothing: what would leave a search ends the program.
// A search on the CPU calls it once: a task stays until the search is over, and between
// phases it spins, then yields. None waits for a task that has not begun.
struct Executor {
  unsigned concurrency = 1;  // how many tasks make sense at once
  void (*run)(void* self, unsigned count, void (*task)(void* context, unsigned index),
              void* context) = nullptr;
  void* self = nullptr;
};

struct Options {
  Algorithm algorithm = Algorithm::automatic;
  Order order = Order::any;
  Backend backend = Backend::automatic;
  NanPolicy nan = NanPolicy::refuse;
  // Boxes in device memory (cuda.hpp) and of MPI ranks are inactive, whatever is set.
  InvertedPolicy inverted = InvertedPolicy::automatic;
  Isa isa = Isa::automatic;
  // Boxes are compared as lower - margin and upper + margin, rounded outward. World units, >= 0.
  float margin = 0.0f;
  // At most so many threads; 0: as many as the executor offers.
  unsigned threads = 0;
  // The consumer form: all memory that the library may take, in bytes, a device's and pinned memory
  // included; 0: no cap.
  std::size_t memory_cap_bytes = 0;
  // The consumer form: let several threads call the consumer at once.
  bool concurrent_consumer = false;
  // Measure the time of each stage (two clock readings a stage).
  bool measure_stages = true;
  // Where to run; null: the default (oneTBB). It must outlive the call.
  const Executor* executor = nullptr;
  // Where memory comes from; null: new and delete, whose large blocks ask for large pages (see
  // large_pages.hpp; std::pmr::new_delete_resource() does not). It must outlive the Finder.
  // Used from several threads only if it is a grid of many columns: give a synchronised one then.
  std::pmr::memory_resource* memory = nullptr;
  // Cells so many times as long as the planner would make them, within 1/64 and 64 and as far as
  // memory allows: for studies of the planner and for tests. The pairs are the same for any value.
  float cell_scale = 1.0f;
  // Set it to true from any thread, and a search ends soon, with Status::stopped and nothing found;
  // what stands in a buffer of the caller's is then of no use. It is looked at before each column
  // or tile, and in a column of very many boxes after each 10^8 comparisons or so; on a GPU by a
  // Finder of host memory, after each stage and each 10^9 comparisons of brute force. Null: nobody
  // stops it. It must outlive the call.
  const std::atomic<bool>* stop = nullptr;
  // A folder that is there already. Each call of a Finder writes a new file into it, a BroadPhase
  // one file from its first call on: boxes, options, and what was answered, for `throng replay`.
  // Null: that of the environment variable THRONG_CAPTURE, if any, as the process's first search
  // finds it. A file takes memory beside the resource, and the time to write it. Where one cannot
  // be written the answer is the same, and Result::message says why. It must outlive the call.
  const char* capture = nullptr;
};

// What the planner chose, and why.
struct Plan {
  Backend backend = Backend::cpu;
  Algorithm algorithm = Algorithm::automatic;
  Isa isa = Isa::automatic;  // of the CPU; on a GPU it says nothing
  unsigned threads = 1;
  unsigned sweep_axis = 0;               // 0, 1, 2: the axis along which each column is swept
  std::uint32_t columns[3] = {1, 1, 1};  // columns, or finest cells, along each axis
  double expected_ns = 0;                // what the planner thinks it will cost
  const char* reason = "";               // one sentence, never null
};

struct StageTimes {
  double plan_ms = 0;   // sampling, planning, splitting by world and by static
  double bin_ms = 0;    // reading, checking and sorting the boxes into columns
  double find_ms = 0;   // finding and writing pairs
  double order_ms = 0;  // sorting pairs, where asked for
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

// A call that failed says so here and nowhere else, so it is not to be dropped.
struct [[nodiscard]] Result {
  Status status = Status::ok;
  std::uint64_t found = 0;        // pairs there are, exact even where there was no room
  std::uint64_t written = 0;      // pairs written or handed to the consumer
  std::uint64_t inactive = 0;     // boxes that overlap nothing: lower > upper, or NaN where allowed
  std::uint64_t comparisons = 0;  // candidate pairs compared (each SIMD lane counts)
  // Cells, columns, records and tree nodes that were looked into, beside comparisons; a box has a
  // record in each column that it touches. 0 of a search on a GPU, and on one that is emulated.
  std::uint64_t visited = 0;
  std::uint64_t first_invalid = 0;
  std::uint64_t invalid_count = 0;
  std::uint64_t bytes_needed = 0;
  Plan plan;
  StageTimes times;
  // What went wrong, with the number and the remedy; empty where nothing did.
  char message[224] = {};

  bool ok() const noexcept { return status == Status::ok; }
};

}  // namespace throng
