// A Device on the CPU: every launch is a loop, divided among an executor's threads. It runs the
// same function objects as a GPU, so that the pipeline is tested, with the sanitizers too, without
// a GPU.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <optional>
#include <type_traits>
#include <utility>

#include <throng/memory_resource.hpp>
#include <throng/mesh.hpp>
#include <throng/options.hpp>

#include "device/failure.hpp"
#include "device/host_pair_sorter.hpp"
#include "device/pair_keys.hpp"
#include "device/pipeline.hpp"

namespace throng::device {

class HostDevice {
 public:
  // Starts tasks: base::run_tasks, which also sets the floating-point state.
  using Run = void (*)(const Executor&, unsigned count, void (*task)(void*, unsigned),
                       void* context);

  HostDevice(std::pmr::memory_resource* memory, Run run) noexcept : memory_(memory), run_(run) {}

  // Once *stop is true, launches end soon and throw Failure: stopped.
  void begin(const Executor& executor, unsigned tasks,
             const std::atomic<bool>* stop = nullptr) noexcept {
    executor_ = executor;
    tasks_ = tasks;
    stop_ = stop;
    times_ = {};
    last_ = Clock::now();
  }

  // Failure: out_of_memory.
  void* allocate(std::size_t bytes) {
    void* p = nullptr;
    try {
      p = memory_->allocate(bytes, 256);
    } catch (...) {
    }
    if (!p) throw Failure{Status::out_of_memory, bytes};
    return p;
  }
  void release(void* p, std::size_t bytes) noexcept { memory_->deallocate(p, bytes, 256); }

  // Whether pairs can be written to the caller's memory.
  static constexpr bool reaches_host_memory = true;
  static std::size_t boxes_bytes(const Boxes&) noexcept { return 0; }
  static Boxes copy_boxes(const Boxes& boxes, char*&) noexcept { return boxes; }
  static std::size_t mesh_bytes(const TriangleMesh&) noexcept { return 0; }
  static TriangleMesh copy_mesh(const TriangleMesh& mesh, char*&) noexcept { return mesh; }
  static constexpr std::size_t staging_bytes = 0;
  static std::size_t held() noexcept { return 0; }
  static void release_host_copy() noexcept {}
  template <class T, class F>
  static bool in_pieces(const T* values, std::size_t count, const F& take) {
    return count == 0 || take(values, count);
  }
  template <class T>
  static const T* host_copy(const T* values, std::size_t) noexcept {
    return values;
  }
  static std::size_t scan_bytes(std::size_t) noexcept { return 0; }
  void use_scratch(void*, std::size_t) const noexcept {}

  template <class F>
  void launch(std::uint64_t count, const F& f) const {
    parallel_for(count, 2048, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = begin; i < end; ++i) f(i);
    });
  }
  void plan(const PlanGrid& f, void* cleared, std::size_t bytes) const {
    std::memset(cleared, 0, bytes);
    PlanGrid::Shared shared{};
    f(shared, [](const auto& phase) {
      for (std::uint32_t t = 0; t < PlanGrid::threads; ++t) phase(t);
    });
  }
  void clear(void* p, std::size_t bytes) const noexcept { std::memset(p, 0, bytes); }
  void copy(void* to, const void* from, std::size_t bytes) const noexcept {
    std::memcpy(to, from, bytes);
  }
  void scan(std::uint32_t* values, std::size_t count) const noexcept {
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t value = values[i];
      values[i] = sum;
      sum += value;
    }
  }
  static std::size_t scan_cells_bytes(std::size_t) noexcept { return 0; }
  void scan_cells(const std::uint32_t* wanted, std::uint32_t* table, std::size_t cells,
                  std::uint64_t*) const noexcept {
    if (!wanted || *wanted != 0) scan(table, cells);
  }

  // Small, so that the tests take both paths.
  static constexpr std::uint32_t sorted_above = 500;
  static std::size_t sort_cells_bytes(std::size_t) noexcept { return 0; }
  // One pass per eight bits, as on a device.
  SortedCells sort_cells(std::uint32_t* keys, std::uint32_t* values, std::size_t capacity,
                         std::size_t count, int begin, int end) const noexcept {
    for (std::uint32_t* to = keys + capacity; begin < end; begin += 8) {
      const std::uint32_t mask = (1u << std::min(8, end - begin)) - 1;
      std::uint32_t starts[257] = {};
      for (std::size_t i = 0; i < count; ++i) ++starts[(keys[i] >> begin & mask) + 1];
      for (int k = 0; k < 256; ++k) starts[k + 1] += starts[k];
      std::uint32_t* const values_to = to > keys ? values + capacity : values - capacity;
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t at = starts[keys[i] >> begin & mask]++;
        to[at] = keys[i];
        values_to[at] = values[i];
      }
      std::swap(keys, to);
      values = values_to;
    }
    return {keys, values};
  }
  void place(std::uint32_t count, const PlaceBuckets& f) const {
    if (!f.in.wants_grid()) return;
    parallel_for(f.buckets.count(), 1, [&](std::uint64_t first, std::uint64_t) {
      const auto bucket = static_cast<std::uint32_t>(first);
      const auto first_of = [&](std::uint32_t b) {
        std::uint32_t begin = 0, end = count;
        while (begin < end) {
          const std::uint32_t middle = begin + (end - begin) / 2;
          if (f.before(middle, b))
            begin = middle + 1;
          else
            end = middle;
        }
        return begin;
      };
      const std::uint32_t begin = first_of(bucket), end = first_of(bucket + 1);
      std::uint32_t next[Buckets::max_cells];
      std::fill_n(next, f.buckets.cells(), 0u);
      for (std::uint32_t i = begin; i < end; ++i) f.count(i, next);
      std::uint32_t at = begin;
      for (std::uint32_t k = 0; k < f.buckets.cells(); ++k) {
        const std::uint32_t boxes = std::exchange(next[k], at);
        f.set_start((bucket << f.buckets.bits) + k, at);
        at += boxes;
      }
      for (std::uint32_t i = begin; i < end; ++i) {
        std::uint32_t to;
        const Record record = f.take(i, next, to);
        f.records[to] = record;
      }
    });
  }

  template <class Search, class Check = AcceptAll>
  void search(std::uint64_t bound, const Search& search, const PairSink& sink,
              const Check& check = {}) const {
    parallel_for(bound, 512, [&](std::uint64_t begin, std::uint64_t end) {
      constexpr std::size_t buffer_size = 512;
      Pair pairs[buffer_size];
      std::size_t held = 0;
      std::uint64_t comparisons = 0;
      const auto flush = [&] {
        if constexpr (!std::is_same_v<Check, AcceptAll>) {
          check.add_candidates(held);
          held = static_cast<std::size_t>(
              std::remove_if(pairs, pairs + held,
                             [&](const Pair& p) { return !check(p.first, p.second); }) -
              pairs);
        }
        const std::uint64_t at = fetch_add(&sink.report->found, std::uint64_t{held});
        const std::uint64_t fits = at < sink.capacity ? sink.capacity - at : 0;
        std::copy_n(pairs, std::min<std::uint64_t>(fits, held), fits ? sink.out + at : sink.out);
        held = 0;
      };
      end = std::min(end, search.count());
      const auto emit = [&](const Pair& pair) {
        pairs[held] = pair;
        if (++held == buffer_size) flush();
      };
      if constexpr (requires { Search::max_targets; }) {
        for (std::uint64_t i = begin; i < end; i += 32) {
          const std::uint64_t last = std::min(i + 32, end);
          comparisons += search.grid->hashed || !Search::is_plain
                             ? search_grid_rows<true>(search, i, last, emit)
                             : search_grid_rows<false>(search, i, last, emit);
        }
      } else {
        for (std::uint64_t i = begin; i < end; ++i) {
          auto walk = search.begin(i);
          for (Pair pair; !walk.over();)
            if (walk.step(pair)) emit(pair);
          comparisons += walk.comparisons();
        }
      }
      if (held) flush();
      fetch_add(&sink.report->comparisons, comparisons);
    });
  }
  template <class Test, class Tiles>
  void gather(std::uint64_t bound, const Test& test, const Tiles& to) const {
    const std::uint64_t count = test.count();
    parallel_for(Tiles::of(bound), 2, [&](std::uint64_t tile, std::uint64_t end) {
      for (; tile < end; ++tile) {
        Pair begun[Tiles::size], ended[Tiles::size];
        std::uint32_t begins = 0, ends = 0, compared = 0;
        const std::uint64_t first = tile * Tiles::size;
        for (std::uint64_t i = first; i < std::min(count, first + Tiles::size); ++i) {
          Pair pair;
          const auto change = test(i, pair, compared);
          if (change == decltype(change)::begins) begun[begins++] = pair;
          if (change == decltype(change)::ends) ended[ends++] = pair;
        }
        const std::uint64_t base = fetch_add(&to.event_counts->count, std::uint64_t{begins} + ends);
        fetch_add(&to.event_counts->begun, std::uint64_t{begins});
        fetch_add(&to.event_counts->comparisons, std::uint64_t{compared});
        for (std::uint32_t k = 0; k < begins + ends && base + k < to.capacity; ++k)
          to.out[base + k] = k < begins ? begun[k] : ended[k - begins];
        to.note(tile, base, begins, ends);
      }
    });
  }
  static std::size_t sort_bytes(std::size_t count) noexcept {
    using Order = PairSorter<HostSortSizes>;
    if (count <= Order::max_pairs) return Order::bytes(count);
    return std::max(count * sizeof(std::uint64_t), Order::bytes(Order::max_pairs));
  }
  void sort(Pair* pairs, void* scratch, std::size_t, Pair* out, std::uint64_t capacity,
            std::uint64_t count, const Report* report, const Input& in) const {
    if (count == 0) return;
    const PairKeys shape = PairKeys::of(in);
    if (count <= PairSorter<HostSortSizes>::max_pairs) {
      PairSorter<HostSortSizes> order{pairs, out, report, std::min(capacity, count), shape};
      order.carve(count, scratch);
      return sort_pairs(order, [&](std::uint64_t n, const auto& body) {
        parallel_for(n, 1,
                     [&](std::uint64_t k, std::uint64_t) { body(static_cast<std::uint32_t>(k)); });
      });
    }
    auto* keys = static_cast<std::uint64_t*>(scratch);
    launch(count, EncodePairs{pairs, keys, report, capacity, shape});
    // Ignores the bits above, as a radix sort does.
    const std::uint64_t mask = ~std::uint64_t{0} >> (64 - shape.bits());
    std::sort(keys, keys + count,
              [mask](std::uint64_t a, std::uint64_t b) { return (a & mask) < (b & mask); });
    launch(count, DecodePairs{keys, out, report, capacity, shape});
  }

  template <class T>
  T read(const T& value) const noexcept {
    return value;
  }
  template <class T>
  T take(T& value, std::size_t bytes = sizeof(T)) const noexcept {
    const T copy = value;
    std::memset(static_cast<void*>(&value), 0, bytes);
    return copy;
  }
  template <class F, class T>
  T launch_and_read(std::uint64_t count, const F& f, T& value, std::uint32_t*) const {
    launch(count, f);
    return take(value);
  }

  template <class F>
  void fork(const F& f) const {
    f();
  }
  static void join() noexcept {}

  void mark(Stage stage) noexcept {
    const Clock::time_point now = Clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    (stage == Stage::plan   ? times_.plan_ms
     : stage == Stage::bin  ? times_.bin_ms
     : stage == Stage::find ? times_.find_ms
                            : times_.order_ms) += ms;
  }
  StageTimes times() const noexcept {
    StageTimes times = times_;
    times.total_ms = times.plan_ms + times.bin_ms + times.find_ms + times.order_ms;
    return times;
  }

 private:
  using Clock = std::chrono::steady_clock;

  // The warp search of cuda/search.cuh, with the lanes executed one after the other in each step.
  // Returns the number of comparisons.
  template <bool mixed, class Search, class F>
  static std::uint64_t search_grid_rows(const Search& search, std::uint64_t begin,
                                        std::uint64_t end, const F& emit) {
    constexpr unsigned slots = 3;  // few, so that they are often full
    struct Lane {
      typename Search::template GridQuery<mixed> query;
      std::uint32_t rows = 0;
      unsigned held = 0;
      typename Search::Range ranges[slots] = {};
    };
    std::optional<Lane> lanes[32];
    const auto count = static_cast<std::size_t>(end - begin);
    for (std::size_t k = 0; k < count; ++k)
      lanes[k].emplace(Lane{{search, *search.grid, begin + k}});
    std::uint64_t comparisons = 0;
    const auto test_ranges = [&] {
      for (std::size_t k = 0; k < count; ++k) {
        Lane& lane = *lanes[k];
        for (unsigned slot = 0; slot < lane.held; ++slot) {
          const auto [first, last, row] = lane.ranges[slot];
          comparisons += last - first;
          for (std::uint32_t i = first; i < last; ++i) {
            const Record c = load(search.records + i);
            if (lane.query.accepts(c, row)) emit(search.pair(lane.query.box().id, c));
          }
        }
        lane.held = 0;
      }
    };
    const std::uint32_t targets = Search::target(base::group_count(search.grid->present), 0);
    for (std::uint32_t target = 0; target < targets; ++target) {
      if (!search.occupied[target]) continue;
      for (std::size_t k = 0; k < count; ++k)
        lanes[k]->rows = lanes[k]->query.select_target(target);
      for (bool more = true; more;) {
        bool full = more = false;
        for (std::size_t k = 0; k < count; ++k) {
          Lane& lane = *lanes[k];
          if (lane.rows == 0) continue;
          const auto range = lane.query.row();
          more |= --lane.rows > 0;
          if (range.begin == range.end) continue;
          lane.ranges[lane.held++] = range;
          full |= lane.held == slots;
        }
        if (full) test_ranges();
      }
      if (mixed) test_ranges();
    }
    test_ranges();
    return comparisons;
  }

  // Calls body(begin, end) for pieces of 0 .. count-1.
  template <class F>
  void parallel_for(std::uint64_t count, std::uint64_t piece, const F& body) const {
    std::atomic<std::uint64_t> next{0};
    struct Job {
      std::uint64_t count, piece;
      const F& body;
      std::atomic<std::uint64_t>& next;
      const HostDevice& device;
    } job{count, piece, body, next, *this};
    const std::uint64_t pieces = (count + piece - 1) / piece;
    const auto tasks = static_cast<unsigned>(std::min<std::uint64_t>(tasks_, pieces));
    run_(
        executor_, tasks,
        [](void* context, unsigned) {
          Job& j = *static_cast<Job*>(context);
          for (;;) {
            const std::uint64_t begin = j.next.fetch_add(j.piece, std::memory_order_relaxed);
            if (begin >= j.count || j.device.stopped()) return;
            j.body(begin, std::min(begin + j.piece, j.count));
          }
        },
        &job);
    // Some pieces were skipped, so later steps must not read the results.
    if (stopped()) throw Failure{Status::stopped};
  }
  bool stopped() const noexcept { return stop_ && stop_->load(std::memory_order_relaxed); }

  std::pmr::memory_resource* memory_;
  Run run_;
  Executor executor_;
  unsigned tasks_ = 1;
  const std::atomic<bool>* stop_ = nullptr;
  Clock::time_point last_;
  StageTimes times_;
};

}  // namespace throng::device
