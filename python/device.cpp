#include "python/device.hpp"

#include <cuda_runtime_api.h>

#include <algorithm>
#include <string>
#include <vector>

#include <throng/cuda.hpp>
#include <throng/finder.hpp>

#include "python/errors.hpp"
#include "python/lock.hpp"

namespace throng::python {
namespace {

// Initial pair capacity per box, as on the host; here it takes memory.
constexpr std::size_t pairs_per_box = 4, min_pairs = 4096;

void require(cudaError_t error, const char* what) {
  if (error == cudaSuccess) return;
  (void)cudaGetLastError();
  throw std::runtime_error(std::string(what) + ": the GPU failed: " + cudaGetErrorString(error));
}

// Makes a device current for its lifetime, then restores the caller's.
class Current {
 public:
  explicit Current(int device) {
    require(cudaGetDevice(&before_), "boxes");
    require(cudaSetDevice(device), "boxes");
  }
  ~Current() { (void)cudaSetDevice(before_); }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;

 private:
  int before_ = 0;
};

// Pairs on the current device. cudaFree waits for all work there, so an array may be released while
// a kernel of the caller still reads it.
struct DevicePairs {
  Pair* data = nullptr;
  std::size_t capacity = 0;
  int device = 0;

  DevicePairs(std::size_t count, int on) : capacity(count), device(on) {
    if (cudaMalloc(reinterpret_cast<void**>(&data), count * sizeof(Pair)) == cudaSuccess) return;
    (void)cudaGetLastError();
    memory_error("no memory on cuda:" + std::to_string(on) + " for " + std::to_string(count) +
                 " pairs of 8 bytes; free some, or split the boxes");
  }
  ~DevicePairs() {
    int before = 0;
    (void)cudaGetDevice(&before);
    (void)cudaSetDevice(device);
    (void)cudaFree(data);
    (void)cudaSetDevice(before);
  }
  DevicePairs(const DevicePairs&) = delete;
  DevicePairs& operator=(const DevicePairs&) = delete;
};

nb::object host_array(const DevicePairs& pairs, std::size_t count, cuda::Stream stream) {
  auto values = std::make_unique<std::uint32_t[]>(2 * count + 1);
  {
    const Unlocked unlocked;
    require(cudaMemcpyAsync(values.get(), pairs.data, count * sizeof(Pair), cudaMemcpyDeviceToHost,
                            stream),
            "result");
    require(cudaStreamSynchronize(stream), "result");
  }
  return numpy_array(std::move(values), {count, 2});
}

// A copy of device boxes in host memory.
class HostBoxes {
 public:
  explicit HostBoxes(const Boxes& there) : boxes_(there.size()) {
    auto* const out = reinterpret_cast<char*>(boxes_.data());
    for (int k = 0; k < 6; ++k) {
      if (!there.corner_data(k) || boxes_.empty()) continue;
      require(cudaMemcpy2D(out + static_cast<std::size_t>(k) * sizeof(float), sizeof(Box),
                           there.corner_data(k), there.stride_bytes(), sizeof(float), boxes_.size(),
                           cudaMemcpyDeviceToHost),
              "boxes");
    }
    const auto* const c = reinterpret_cast<const float*>(boxes_.data());
    const bool flat = there.is_flat();
    view_ = Boxes::arrays(c, c + 1, flat ? nullptr : c + 2, c + 3, c + 4, flat ? nullptr : c + 5,
                          boxes_.size(), sizeof(Box));
  }
  const Boxes& view() const noexcept { return view_; }

 private:
  std::vector<Box> boxes_;
  Boxes view_;
};

}  // namespace

struct DeviceFinder::State {
  cuda::Finder finder;
  Options options;
  std::size_t last_found = 0;
};

bool gpu_is_built() noexcept { return true; }

DeviceFinder::DeviceFinder(const Options& options, int device) : device_(device) {
  require_ok(cuda::available());
  state_ = std::unique_ptr<State>(new State{cuda::Finder(options), options});
}

DeviceFinder::~DeviceFinder() {
  int before = 0;
  (void)cudaGetDevice(&before);
  (void)cudaSetDevice(device_);
  state_.reset();
  (void)cudaSetDevice(before);
}

std::size_t DeviceFinder::memory_bytes() const noexcept { return state_->finder.memory_bytes(); }

nb::object DeviceFinder::find(const BoxArray& a, const BoxArray* b, std::uintptr_t stream,
                              bool to_host, Result& result) {
  const Current current(device_);
  auto* const on = reinterpret_cast<cuda::Stream>(stream);
  std::size_t capacity = state_->last_found + state_->last_found / 8 + 64;
  if (state_->last_found == 0)
    capacity = pairs_per_box * (a.size() + (b ? b->size() : 0)) + min_pairs;
  std::unique_ptr<DevicePairs> pairs;
  for (;;) {
    pairs.reset();
    pairs = std::make_unique<DevicePairs>(capacity, device_);
    {
      const Unlocked unlocked;
      cuda::Finder& finder = state_->finder;
      result = b ? finder.find(a.view(), b->view(), pairs->data, capacity, on)
                 : finder.find(a.view(), pairs->data, capacity, on);
    }
    if (result.status != Status::buffer_too_small) break;
    capacity = static_cast<std::size_t>(result.found);
  }
  require_ok(result);
  const auto found = state_->last_found = static_cast<std::size_t>(result.found);
  if (to_host) return host_array(*pairs, found, on);
  auto* const data = reinterpret_cast<std::uint32_t*>(pairs->data);
  const nb::capsule owner(pairs.release(),
                          [](void* p) noexcept { delete static_cast<DevicePairs*>(p); });
  const std::size_t shape[2] = {found, 2};
  return nb::cast(nb::ndarray<std::uint32_t>(data, 2, shape, owner, nullptr,
                                             nb::dtype<std::uint32_t>(), nb::device::cuda::value,
                                             device_));
}

Result DeviceFinder::check(const BoxArray& a, const BoxArray* b) const {
  const Current current(device_);
  Options options = state_->options;
  options.backend = Backend::cpu;
  options.inverted = InvertedPolicy::refuse;
  throng::Finder finder(options);
  const auto none = [](const Pair*, std::size_t) { return false; };
  const HostBoxes first(a.view());
  // This form checks all boxes before it passes on the first pair.
  Result result = b ? finder.consume(first.view(), HostBoxes(b->view()).view(), none)
                    : finder.consume(first.view(), none);
  if (result.status == Status::stopped) result.status = Status::ok;
  return result;
}

}  // namespace throng::python
