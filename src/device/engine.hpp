// One search on a device: memory that is kept between calls, output forms, order. Synchronizes with
// the device; the asynchronous part is device/pipeline.hpp.
//
// In addition to what pipeline.hpp lists, a Device provides
//   allocate, release             device memory
//   reaches_host_memory           whether it reads and writes the caller's arrays; if not:
//   boxes_bytes, copy_boxes(boxes, to) size of a device copy of the boxes, and the copy itself
//   read(value), read(from, to, n), in_pieces(from, n, f), host_copy(from, n)
//                                 copies to the host: whole, piece by piece, or into a kept buffer
//   staging_bytes, held(), release_host_copy()
//                                 most and current bytes of staging without host_copy's buffer;
//                                 frees that buffer
//   sort_bytes(n)                 scratch of a sort of n pairs
//   sort(...)                     sorts pairs
//   times()                       of the stages that were marked
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>

#include <throng/finder.hpp>
#include <throng/options.hpp>

#include "base/output.hpp"
#include "device/box_job.hpp"
#include "device/device_buffer.hpp"
#include "device/failure.hpp"
#include "device/pipeline.hpp"
#include "device/search_result.hpp"

namespace throng::device {

template <class Device>
class Engine {
 public:
  template <class... Args>
  explicit Engine(Args&&... args) : device_(std::forward<Args>(args)...) {}

  Device& device() noexcept { return device_; }
  const Device& device() const noexcept { return device_; }
  std::size_t held() const noexcept {
    std::size_t sum = device_.held();
    for (const DeviceBuffer<Device>* block : blocks_) sum += block->bytes();
    return sum;
  }
  bool nan_in_second_set() const noexcept { return nan_in_second_; }

  // The arguments are valid (validated by the API layer), and so is the device's state.
  // `already_held`: bytes that count towards a memory cap. b null: one set. Throws Failure, and
  // whatever the consumer throws.
  void find(const Boxes& a, const Boxes* b, const Options& options, std::size_t already_held,
            base::Output* output, const Consumer* consumer, Result& r) {
    BoxJob<Device> job(a, b, options);
    find(job, options, already_held, output, consumer, r);
  }
  // The same for any job: see device/box_job.hpp.
  template <class Job>
  void find(Job& job, const Options& options, std::size_t already_held, base::Output* output,
            const Consumer* consumer, Result& r) {
    if (job.size() > max_pipeline_boxes) throw Failure{Status::too_many_boxes, job.size()};
    const bool in_order = options.order == Order::canonical;
    r.plan.reason = "";
    if (job.size() == 0) return;
    Call<Job> call{job, job.shape(), false, &r};
    call.brute = Pipeline<Device>::brute_force(call.in, options.algorithm);
    set_plan(call.brute, r);
    // All sizes are known before the first allocation.
    const std::size_t input_bytes = job.bytes();
    const std::size_t bytes = call.w.template carve<Device>(call.in.count, nullptr);
    std::size_t block_pairs_capacity =
        std::min<std::size_t>(usual_block_pairs, std::size_t{8} * call.in.count + 1024);
    if (consumer && options.memory_cap_bytes)
      block_pairs_capacity = pairs_under_cap(options.memory_cap_bytes, already_held, call.in,
                                             in_order, {input_bytes, bytes});
    call.in = job.prepare(device_, boxes_.ensure(input_bytes));
    call.w.template carve<Device>(call.in.count, workspace_.ensure(bytes));
    call.w.report = job.report(call.w.report);
    const Pipeline<Device> pipeline(device_);
    pipeline.build(call.in, call.brute, call.w);
    if (!accept_report(call, options.nan)) return;
    if (consumer)
      consume(call, *consumer, in_order, block_pairs_capacity);
    else if (in_order)
      find_in_order(call, *output);
    else
      find_into(call, *output);
    r.times = device_.times();
  }

 private:
  template <class Job>
  struct Call {
    Job& job;
    Input in;
    bool brute;
    Result* result;
    Workspace w{};
  };
  static constexpr std::size_t usual_block_pairs = std::size_t{1}
                                                   << 22;  // pairs per block, without a cap

  // Reads the report; returns false if the input is refused.
  template <class Job>
  bool accept_report(Call<Job>& call, NanPolicy policy) {
    const Report report = call.job.read(device_, *call.w.report);
    Result& r = *call.result;
    if (!call.brute) {
      const base::SizeClassGrid grid = device_.read(*call.w.grid);
      std::copy(grid.classes[0].cells, grid.classes[0].cells + 3, r.plan.columns);
    }
    set_worlds_reason(call.brute, report, call.in, r);
    return call.job.accept(device_, report, call.in, policy, r, nan_in_second_);
  }

  // One search into device memory; returns the number of pairs found.
  template <class Job>
  std::uint64_t search(Call<Job>& call, Pair* out, std::uint64_t capacity,
                       const FirstRange& range = {}) {
    const PairSink sink{out, capacity, call.w.report};
    device_.clear(&call.w.report->found, sizeof call.w.report->found);
    device_.clear(&call.w.report->comparisons, sizeof call.w.report->comparisons);
    call.job.begin_search(device_);
    Pipeline<Device>(device_).find(call.in, call.brute, call.w, sink, range, call.job.check());
    call.job.end_search(device_, sink);
    const Report report = call.job.read(device_, *call.w.report);
    call.result->comparisons = report.comparisons;
    return report.found;
  }

  static void grow(base::Output& output, std::uint64_t count) {
    if (!output.grow_to(count)) throw Failure{Status::out_of_memory, count * sizeof(Pair)};
  }

  template <class Job>
  void find_into(Call<Job>& call, base::Output& output) {
    Result& r = *call.result;
    if constexpr (Device::reaches_host_memory) {
      for (;;) {
        r.found = search(call, output.data, output.capacity);
        if (r.found <= output.capacity || !output.grow) break;
        grow(output, r.found);
      }
      r.written = std::min<std::uint64_t>(r.found, output.capacity);
    } else {
      found_on_device(call, output);
      if (r.found > output.capacity && output.grow) grow(output, r.found);
      r.written = std::min<std::uint64_t>(r.found, output.capacity);
      device_.read(unordered_.template as<Pair>(), output.data,
                   static_cast<std::size_t>(r.written));
    }
    if (r.written < r.found) r.status = Status::buffer_too_small;
  }

  // All pairs, in unordered_. If the output cannot grow, only its capacity is guaranteed.
  template <class Job>
  void found_on_device(Call<Job>& call, const base::Output& output) {
    Result& r = *call.result;
    if (unordered_.bytes() == 0) {
      const std::size_t guess =
          std::min<std::size_t>(output.capacity, std::size_t{4} * call.in.count);
      unordered_.ensure((guess + 512) * sizeof(Pair));
    }
    for (;;) {
      const std::uint64_t capacity = unordered_.bytes() / sizeof(Pair);
      r.found = search(call, unordered_.template as<Pair>(), capacity);
      if (r.found <= capacity || (!output.grow && output.capacity <= capacity)) return;
      const std::uint64_t wanted =
          output.grow ? r.found : std::min<std::uint64_t>(r.found, output.capacity);
      unordered_.ensure(static_cast<std::size_t>(wanted + wanted / 64 + 512) * sizeof(Pair));
    }
  }

  template <class Job>
  void sort(Call<Job>& call, Pair* pairs, Pair* out, std::size_t count) {
    const std::size_t bytes = Device::sort_bytes(count);
    void* scratch = bytes ? sorting_.ensure(bytes) : nullptr;
    device_.sort(pairs, scratch, bytes, out, count, count, call.w.report, call.in);
  }

  // Finds into the engine's memory, then sorts into the caller's, which stays untouched if too
  // small.
  template <class Job>
  void find_in_order(Call<Job>& call, base::Output& output) {
    Result& r = *call.result;
    found_on_device(call, output);
    if (r.found > output.capacity) {
      if (!output.grow) {
        r.status = Status::buffer_too_small;
        return;
      }
      grow(output, r.found);
    }
    const auto count = static_cast<std::size_t>(r.found);
    if constexpr (Device::reaches_host_memory) {
      sort(call, unordered_.template as<Pair>(), output.data, count);
    } else {
      auto* sorted = reinterpret_cast<Pair*>(ordered_.ensure((count + 1) * sizeof(Pair)));
      sort(call, unordered_.template as<Pair>(), sorted, count);
      device_.read(sorted, output.data, count);
    }
    device_.mark(Stage::order);
    r.written = r.found;
  }

  // ---- the consumer -----------------------------------------------------------------------------

  // Bytes that a call needs of each of blocks_.
  using Needs = std::array<std::size_t, 6>;
  static Needs needs(const Input& in, bool in_order, const std::array<std::size_t, 2>& fixed,
                     std::size_t block_pairs_capacity) {
    const std::size_t pairs = block_pairs_capacity * sizeof(Pair);
    return {fixed[0],
            fixed[1],
            firsts_bytes(in),
            pairs,
            in_order ? pairs : 0,
            in_order ? Device::sort_bytes(block_pairs_capacity) : 0};
  }

  // Most pairs that one first index can have: a block must hold them.
  static std::size_t max_pairs_of_one(const Input& in) noexcept {
    return in.two_sets ? in.count - in.first_count : in.count;
  }
  static std::size_t firsts_bytes(const Input& in) noexcept {
    return std::size_t{in.first_count} * sizeof(std::uint32_t);
  }
  // Pairs per block under a cap. Failure: memory_cap_too_small, with the bytes needed. `fixed`:
  // bytes of the job and of the workspace.
  std::size_t pairs_under_cap(std::size_t cap, std::size_t already_held, const Input& in,
                              bool in_order, const std::array<std::size_t, 2>& fixed) {
    // The host may need a copy of the counts.
    const std::size_t other_bytes =
        already_held + Device::staging_bytes + (Device::reaches_host_memory ? 0 : firsts_bytes(in));
    const auto total = [&](std::size_t capacity) {
      const Needs each = needs(in, in_order, fixed, capacity);
      return std::accumulate(each.begin(), each.end(), other_bytes);
    };
    const std::size_t least = max_pairs_of_one(in) + 1;
    if (total(least) > cap) throw Failure{Status::memory_cap_too_small, total(least)};
    std::size_t capacity = least, above = std::max(least, usual_block_pairs) + 1;
    while (above - capacity > 1) {
      const std::size_t middle = capacity + (above - capacity) / 2;
      (total(middle) <= cap ? capacity : above) = middle;
    }
    // Memory of earlier calls is released if it would exceed the cap.
    const Needs each = needs(in, in_order, fixed, capacity);
    std::size_t most = already_held + std::max(device_.held(), other_bytes - already_held);
    for (std::size_t k = 0; k < each.size(); ++k) most += std::max(each[k], blocks_[k]->bytes());
    if (most > cap) {
      device_.release_host_copy();
      for (std::size_t k = 0; k < each.size(); ++k) blocks_[k]->trim(each[k]);
    }
    return capacity;
  }

  // Delivers in blocks: ranges of first indices whose pairs fit. Each range is searched and, if
  // requested, sorted separately, so the concatenation is sorted as well.
  template <class Job>
  void consume(Call<Job>& call, const Consumer& consumer, bool in_order, std::size_t capacity) {
    Result& r = *call.result;
    capacity = std::max(capacity, max_pairs_of_one(call.in) + 1);
    auto* pairs = reinterpret_cast<Pair*>(unordered_.ensure(capacity * sizeof(Pair)));
    if (in_order) sorting_.ensure(Device::sort_bytes(capacity));
    auto* sorted =
        in_order ? reinterpret_cast<Pair*>(ordered_.ensure(capacity * sizeof(Pair))) : nullptr;
    const auto deliver = [&](std::uint64_t count) {
      const auto block = static_cast<std::size_t>(count);
      if (in_order) sort(call, pairs, sorted, block);
      return device_.in_pieces(in_order ? sorted : pairs, block,
                               [&](const Pair* piece, std::size_t size) {
                                 r.written += size;
                                 return consumer(piece, size);
                               });
    };
    r.found = search(call, pairs, capacity);
    if (r.found <= capacity) {
      if (!deliver(r.found)) r.status = Status::stopped;
      return;
    }
    const std::uint64_t found = r.found, comparisons = r.comparisons;
    call.job.keep_counts();
    const std::uint32_t* counts = count_firsts(call);
    for (std::uint32_t begin = 0, end = 0; begin < call.in.first_count; begin = end) {
      std::uint64_t sum = 0;
      while (end < call.in.first_count && sum + counts[end] <= capacity) sum += counts[end++];
      if (sum && !deliver(search(call, pairs, capacity, {begin, end - begin}))) {
        r.status = Status::stopped;
        break;
      }
    }
    r.found = found;
    r.comparisons = comparisons;
  }

  // Returns host memory: the number of pairs per first index, before a check.
  template <class Job>
  const std::uint32_t* count_firsts(Call<Job>& call) {
    const std::size_t bytes = firsts_bytes(call.in);
    auto* counts = reinterpret_cast<std::uint32_t*>(counts_.ensure(bytes));
    device_.clear(counts, bytes);
    Pipeline<Device>(device_).with_search(
        call.in, call.brute, call.w, {}, [&](std::uint64_t bound, const auto& search) {
          device_.launch(bound, CountFirsts<std::decay_t<decltype(search)>>{search, counts});
        });
    return device_.host_copy(counts, call.in.first_count);
  }

  Device device_;
  DeviceBuffer<Device> boxes_{device_}, workspace_{device_}, counts_{device_}, unordered_{device_},
      ordered_{device_}, sorting_{device_};
  const std::array<DeviceBuffer<Device>*, 6> blocks_{&boxes_,     &workspace_, &counts_,
                                                     &unordered_, &ordered_,   &sorting_};
  bool nan_in_second_ = false;
};

}  // namespace throng::device
