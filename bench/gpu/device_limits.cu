// The speed of the device's basic operations, on which estimates of the pipeline depend.
#include <algorithm>
#include <cstdint>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <memory>

#include "bench/gpu/session.hpp"
#include "bench/gpu/timing.hpp"

namespace throng::bench::gpu {
namespace {

constexpr unsigned threads = 256, blocks = 132 * 8;

__global__ void nothing() {}

__global__ void copy(const float4* from, float4* to, std::size_t count) {
  const std::size_t step = std::size_t{gridDim.x} * blockDim.x;
  for (std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count; i += step)
    to[i] = from[i];
}

// A pseudo-random index below `bound`: mostly a different one for each i.
__device__ std::uint32_t scattered(std::uint32_t i, std::uint32_t bound) {
  i ^= i >> 16;
  i *= 0x7feb352du;
  i ^= i >> 15;
  i *= 0x846ca68bu;
  i ^= i >> 16;
  return __umulhi(i, bound);
}

__global__ void fill_keys(std::uint32_t* values, std::size_t count) {
  const std::size_t step = std::size_t{gridDim.x} * blockDim.x;
  for (std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x; i < count; i += step)
    values[i] = scattered(static_cast<std::uint32_t>(i) + 1, ~0u);
}

// As the pipeline counts boxes: the old value is stored, 4 bytes per box.
__global__ void add_at_random(std::uint32_t* table, std::uint32_t cells, std::uint32_t* ranks,
                              std::uint32_t count) {
  const std::uint32_t step = gridDim.x * blockDim.x;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < count; i += step)
    ranks[i] = atomicAdd(table + scattered(i, cells), 1u);
}

struct alignas(32) Sector {
  float4 half[2];
};
__global__ void gather(const Sector* from, std::uint32_t places, float4* sums,
                       std::uint32_t count) {
  const std::uint32_t step = gridDim.x * blockDim.x, own = blockIdx.x * blockDim.x + threadIdx.x;
  float4 sum = {0, 0, 0, 0};
  for (std::uint32_t i = own; i < count; i += step) {
    const Sector s = from[scattered(i, places)];
    sum.x += s.half[0].x + s.half[1].x;
    sum.y += s.half[0].y + s.half[1].y;
    sum.z += s.half[0].z + s.half[1].z;
    sum.w += s.half[0].w + s.half[1].w;
  }
  sums[own] = sum;
}
__global__ void scatter(Sector* to, std::uint32_t places, std::uint32_t count) {
  const std::uint32_t step = gridDim.x * blockDim.x;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < count; i += step) {
    const float x = static_cast<float>(i);
    to[scattered(i, places)] = {{{x, x, x, x}, {x, x, x, x}}};
  }
}

// As the planner runs: one block, a barrier after each phase.
__global__ void ten_barriers(float* out) {
  __shared__ float values[512];
  values[threadIdx.x] = static_cast<float>(threadIdx.x);
  for (int phase = 0; phase < 10; ++phase) {
    __syncthreads();
    const float next = values[(threadIdx.x + 1) % 512];
    __syncthreads();
    values[threadIdx.x] = next;
  }
  out[threadIdx.x] = values[threadIdx.x];
}

class Device {
 public:
  Device(Session& s, double budget_ms) : s_(s), budget_ms_(budget_ms) {}

  template <class F>
  Timing time(const F& put) {
    return time_runs(stream_.get(), budget_ms_, [&](std::size_t) {
      put(stream_.get());
      need(cudaGetLastError());
    });
  }
  void add(const std::string& what, std::uint64_t objects, const Timing& t, double rate,
           const char* unit, const std::string& note = "") {
    Measurement row;
    row.experiment = "device";
    row.what = what;
    row.objects = objects;
    row.time = t;
    row.rate = rate;
    row.rate_metric = unit;
    row.note = note;
    s_.measurements.push_back(std::move(row));
  }
  cudaStream_t stream() const { return stream_.get(); }

 private:
  Session& s_;
  double budget_ms_;
  const OwnStream stream_;
};

// In units of 1e9 per second.
double giga(double amount, const Timing& t) { return amount / (t.median_ms * 1e6); }

void measure_launches(Device& m) {
  const auto launch = [](cudaStream_t s) { nothing<<<1, 32, 0, s>>>(); };
  Timing t = m.time(launch);
  m.add("empty kernel", 0, t, 1e3 * t.back_to_back_ms, "us_each",
        "the median is from event to event");
  const Graph graph(m.stream(), [&] {
    for (int k = 0; k < 6; ++k) launch(m.stream());
  });
  t = m.time([&](cudaStream_t s) { graph.launch(s); });
  m.add("graph of 6 empty kernels", 0, t, 1e3 * t.back_to_back_ms / 6, "us_per_node");
  const DeviceArray<float> out(512);
  t = m.time([&](cudaStream_t s) { ten_barriers<<<1, 512, 0, s>>>(out.data()); });
  m.add("one block, 10 phases", 0, t, 1e3 * t.back_to_back_ms, "us_each",
        "512 threads, two barriers per phase");
}

void measure_copies(Device& m, Session& s) {
  const std::size_t bytes = std::size_t{4} << 30;
  const DeviceArray<float4> from(bytes / sizeof(float4)), to(bytes / sizeof(float4));
  need(cudaMemsetAsync(from.data(), 0x3c, bytes, m.stream()));
  const auto twice = 2.0 * static_cast<double>(bytes);
  Timing t = m.time([&](cudaStream_t st) {
    need(cudaMemcpyAsync(to.data(), from.data(), bytes, cudaMemcpyDeviceToDevice, st));
  });
  s.copy_gbs = giga(twice, t);
  m.add("copy by cudaMemcpyAsync", bytes, t, giga(twice, t), "gb_per_s", "bytes read and written");
  t = m.time([&](cudaStream_t st) {
    copy<<<blocks, threads, 0, st>>>(from.data(), to.data(), from.size());
  });
  m.add("copy by a kernel", bytes, t, giga(twice, t), "gb_per_s", "16 bytes per thread and step");
  t = m.time([&](cudaStream_t st) { need(cudaMemsetAsync(to.data(), 0, bytes, st)); });
  m.add("memset", bytes, t, giga(static_cast<double>(bytes), t), "gb_per_s", "bytes written");
}

void measure_sorts(Device& m, std::size_t n) {
  const DeviceArray<std::uint32_t> source(2 * n), a(2 * n), b(2 * n), c(n), d(n);
  fill_keys<<<blocks, threads, 0, m.stream()>>>(source.data(), source.size());
  need(cudaGetLastError());
  std::size_t pair_bytes = 0, key_bytes = 0;
  const auto* keys = source.data();
  const auto* long_keys = reinterpret_cast<const std::uint64_t*>(source.data());
  auto* long_out = reinterpret_cast<std::uint64_t*>(b.data());
  need(cub::DeviceRadixSort::SortPairs(nullptr, pair_bytes, keys, a.data(), c.data(), d.data(), n));
  need(cub::DeviceRadixSort::SortKeys(nullptr, key_bytes, long_keys, long_out, n));
  const DeviceArray<char> scratch(std::max(pair_bytes, key_bytes));
  const auto count = static_cast<double>(n);
  Timing t = m.time([&](cudaStream_t s) {
    std::size_t bytes = scratch.size();
    need(cub::DeviceRadixSort::SortPairs(scratch.data(), bytes, keys, a.data(), c.data(), d.data(),
                                         n, 0, 32, s));
  });
  m.add("radix sort, 32-bit keys and values", n, t, giga(count, t), "giga_keys_per_s");
  t = m.time([&](cudaStream_t s) {
    std::size_t bytes = scratch.size();
    need(cub::DeviceRadixSort::SortKeys(scratch.data(), bytes, long_keys, long_out, n, 0, 64, s));
  });
  m.add("radix sort, 64-bit keys", n, t, giga(count, t), "giga_keys_per_s");
}

void measure_scan(Device& m, std::size_t n) {
  const DeviceArray<std::uint32_t> values(n);
  need(cudaMemsetAsync(values.data(), 0, values.bytes(), m.stream()));
  std::size_t bytes = 0;
  need(cub::DeviceScan::ExclusiveSum(nullptr, bytes, values.data(), values.data(), n));
  const DeviceArray<char> scratch(bytes);
  const Timing t = m.time([&](cudaStream_t s) {
    need(cub::DeviceScan::ExclusiveSum(scratch.data(), bytes, values.data(), values.data(), n, s));
  });
  m.add("exclusive scan, 32-bit", n, t, giga(8.0 * static_cast<double>(n), t), "gb_per_s",
        "bytes read and written");
}

void measure_atomics(Device& m, std::uint32_t cells, std::uint32_t count) {
  const DeviceArray<std::uint32_t> table(cells), ranks(count);
  need(cudaMemsetAsync(table.data(), 0, table.bytes(), m.stream()));
  const Timing t = m.time([&](cudaStream_t s) {
    add_at_random<<<blocks, threads, 0, s>>>(table.data(), cells, ranks.data(), count);
  });
  m.add("atomic adds at random, " + std::to_string(table.bytes() / 1000000) + " MB", count, t,
        giga(count, t), "giga_per_s", "the old value is written, 4 bytes each");
}

void measure_sectors(Device& m) {
  const std::uint32_t places = 100000000;
  const DeviceArray<Sector> sectors(places);
  const DeviceArray<float4> sums(std::size_t{blocks} * threads);
  const double bytes = 32.0 * places;
  Timing t = m.time(
      [&](cudaStream_t s) { scatter<<<blocks, threads, 0, s>>>(sectors.data(), places, places); });
  m.add("scatter of 32 bytes at random, 3.2 GB", places, t, giga(bytes, t), "gb_per_s",
        "bytes written");
  t = m.time([&](cudaStream_t s) {
    gather<<<blocks, threads, 0, s>>>(sectors.data(), places, sums.data(), places);
  });
  m.add("gather of 32 bytes at random, 3.2 GB", places, t, giga(bytes, t), "gb_per_s",
        "bytes read");
}

}  // namespace

double copy_bandwidth_gbs() {
  Session s;
  Device m(s, 200);
  measure_copies(m, s);
  return s.copy_gbs;
}

void measure_device_limits(Session& s, std::size_t most) {
  Device m(s, s.budget_ms / 4);
  measure_launches(m);
  measure_copies(m, s);
  for (const std::size_t n : {1000000, 10000000, 100000000})
    if (n <= most) measure_sorts(m, n);
  for (const std::size_t n : {2250000, 225000000})
    if (n <= 9 * most / 4) measure_scan(m, n);
  measure_atomics(m, 2250000, 1000000);
  measure_atomics(m, 225000000, 100000000);
  measure_sectors(m);
}

}  // namespace throng::bench::gpu
