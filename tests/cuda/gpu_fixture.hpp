// Device memory and streams for tests: all CUDA calls are checked, all memory is freed.
#pragma once

#include <cuda_runtime_api.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <map>
#include <memory>
#include <ostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <throng/cuda.hpp>

#include "support/configs.hpp"

namespace throng::tests {

// A failed CUDA call ends the test with CUDA's message.
inline void check_cuda(cudaError_t error) {
  if (error != cudaSuccess) throw std::runtime_error(cudaGetErrorString(error));
}

// The first line of tests that require a GPU.
#define THRONG_NEEDS_GPU() \
  if (const Result gpu = cuda::available(); !gpu.ok()) GTEST_SKIP() << "no GPU: " << gpu.message

class Stream {
 public:
  Stream() { check_cuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
  ~Stream() { (void)cudaStreamDestroy(stream_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  operator cudaStream_t() const { return stream_; }  // NOLINT(google-explicit-constructor)
  void wait() const { check_cuda(cudaStreamSynchronize(stream_)); }

 private:
  cudaStream_t stream_ = nullptr;
};

// `size` values in device memory.
template <class T>
class OnDevice {
 public:
  explicit OnDevice(std::size_t size) : size_(size) {
    // Never zero bytes: an empty view may still require a pointer.
    check_cuda(cudaMalloc(reinterpret_cast<void**>(&data_), (size ? size : 1) * sizeof(T)));
  }
  explicit OnDevice(const std::vector<T>& values) : OnDevice(values.size()) { put(values); }
  ~OnDevice() { (void)cudaFree(data_); }
  OnDevice(OnDevice&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(other.size_) {}
  OnDevice& operator=(OnDevice&&) = delete;

  void put(const std::vector<T>& values) {
    if (values.size() > size_) throw std::logic_error("more values than capacity");
    if (values.empty()) return;
    check_cuda(cudaMemcpy(data_, values.data(), values.size() * sizeof(T), cudaMemcpyHostToDevice));
    // A copy from pageable memory may still run, and a non-blocking stream would not wait for it.
    check_cuda(cudaDeviceSynchronize());
  }
  std::vector<T> get() const {
    check_cuda(cudaDeviceSynchronize());
    std::vector<T> values(size_);
    if (size_ != 0)
      check_cuda(cudaMemcpy(values.data(), data_, size_ * sizeof(T), cudaMemcpyDeviceToHost));
    return values;
  }
  T* data() const { return data_; }
  std::size_t size() const { return size_; }

 private:
  T* data_ = nullptr;
  std::size_t size_;
};

inline Boxes view(const OnDevice<Box>& boxes) { return Boxes(boxes.data(), boxes.size()); }

// A buffer for pairs between guard zones; unwritten entries keep the pattern.
class PairBuffer {
 public:
  static constexpr std::size_t guard = 256;
  static constexpr Pair untouched{0xabababab, 0xabababab};

  explicit PairBuffer(std::size_t capacity) : capacity_(capacity), memory_(capacity + 2 * guard) {
    clear();
  }
  void clear() {
    check_cuda(cudaMemset(memory_.data(), 0xab, memory_.size() * sizeof(Pair)));
    check_cuda(cudaDeviceSynchronize());
  }
  Pair* out() const { return memory_.data() + guard; }
  std::size_t capacity() const { return capacity_; }
  // The first `count` pairs; the guards and all entries after these must be untouched.
  std::vector<Pair> take(std::size_t count) const {
    const std::vector<Pair> all = memory_.get();
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(guard);
    EXPECT_LE(count, capacity_);
    count = std::min(count, capacity_);
    std::size_t touched = 0;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (i < guard || i >= guard + count) touched += all[i] != untouched;
    EXPECT_EQ(touched, 0u) << "pairs written past the " << count << " that were reported";
    return {begin, begin + static_cast<std::ptrdiff_t>(count)};
  }

 private:
  std::size_t capacity_;
  OnDevice<Pair> memory_;
};

// Device memory that counts and has a limit.
class CountingDeviceMemory {
 public:
  ~CountingDeviceMemory() { EXPECT_TRUE(blocks_.empty()) << blocks_.size() << " blocks kept"; }
  cuda::MemoryResource resource() {
    return {[](void* self, std::size_t bytes, cuda::Stream) {
              return static_cast<CountingDeviceMemory*>(self)->allocate(bytes);
            },
            [](void* self, void* p, std::size_t bytes, cuda::Stream) {
              static_cast<CountingDeviceMemory*>(self)->deallocate(p, bytes);
            },
            this};
  }
  // Refuses allocations that would bring held() above `bytes`.
  void limit(std::size_t bytes) { limit_ = bytes; }
  std::size_t held() const { return held_; }
  std::size_t allocations() const { return allocations_; }
  std::size_t refusals() const { return refusals_; }

 private:
  void* allocate(std::size_t bytes) {
    void* p = nullptr;
    if (bytes > limit_ || held_ > limit_ - bytes || cudaMalloc(&p, bytes) != cudaSuccess) {
      ++refusals_;
      return nullptr;
    }
    // The contents of a new block must not matter.
    check_cuda(cudaMemset(p, 0x5a, bytes));
    check_cuda(cudaDeviceSynchronize());
    ++allocations_;
    held_ += bytes;
    blocks_[p] = bytes;
    return p;
  }
  void deallocate(void* p, std::size_t bytes) {
    const auto found = blocks_.find(p);
    EXPECT_TRUE(found != blocks_.end()) << "deallocation of an unknown block";
    if (found == blocks_.end()) return;
    EXPECT_EQ(found->second, bytes) << "deallocation with another size";
    held_ -= found->second;
    blocks_.erase(found);
    (void)cudaFree(p);
  }

  std::map<void*, std::size_t> blocks_;
  std::size_t held_ = 0, allocations_ = 0, refusals_ = 0, limit_ = ~std::size_t{0};
};

// Algorithm, order and stream of a test.
struct Setting {
  Algorithm algorithm;
  Order order;
  bool own_stream;

  Options options() const {
    Options o;
    o.algorithm = algorithm;
    o.order = order;
    return o;
  }
};

inline std::string name_of(const Setting& s) {
  return std::string(s.algorithm == Algorithm::all_pairs ? "all_pairs"
                     : s.algorithm == Algorithm::grid    ? "grid"
                                                         : "auto") +
         (s.order == Order::canonical ? "_canonical" : "_any") +
         (s.own_stream ? "_own_stream" : "_default_stream");
}
inline std::string setting_name(const testing::TestParamInfo<Setting>& info) {
  return name_of(info.param);
}
inline void PrintTo(const Setting& setting, std::ostream* out) { *out << name_of(setting); }

inline std::vector<Setting> all_settings() {
  std::vector<Setting> settings;
  for (const Algorithm a : {Algorithm::all_pairs, Algorithm::grid, Algorithm::automatic})
    for (const Order order : {Order::any, Order::canonical})
      for (const bool own : {false, true}) settings.push_back({a, order, own});
  return settings;
}

class OnGpu : public testing::TestWithParam<Setting> {
 protected:
  void SetUp() override {
    THRONG_NEEDS_GPU();
    if (GetParam().own_stream) own_ = std::make_unique<Stream>();
  }
  Options options() const { return GetParam().options(); }
  bool canonical() const { return GetParam().order == Order::canonical; }
  cudaStream_t stream() const { return own_ ? static_cast<cudaStream_t>(*own_) : nullptr; }

  // Searches with exactly the capacity that the answer needs and compares everything.
  void expect_answer(cuda::Finder& finder, const Boxes& a, const Boxes* b, const Answer& answer) {
    const PairBuffer buffer(answer.pairs.size());
    const Result r = b ? finder.find(a, *b, buffer.out(), buffer.capacity(), stream())
                       : finder.find(a, buffer.out(), buffer.capacity(), stream());
    EXPECT_EQ(r.status, Status::ok) << r.message;
    EXPECT_STREQ(r.message, "");
    EXPECT_EQ(r.plan.backend, Backend::cuda);
    EXPECT_EQ(r.found, answer.pairs.size());
    EXPECT_EQ(r.written, answer.pairs.size());
    EXPECT_EQ(r.inactive, answer.inactive);
    EXPECT_GE(r.comparisons, r.found);
    const std::vector<Pair> got = buffer.take(static_cast<std::size_t>(r.written));
    if (canonical()) {
      EXPECT_TRUE(std::is_sorted(got.begin(), got.end()));
    }
    EXPECT_TRUE(same_pairs(got, answer.pairs));
  }

 private:
  std::unique_ptr<Stream> own_;
};

#define THRONG_INSTANTIATE_GPU(suite)                                                      \
  INSTANTIATE_TEST_SUITE_P(All, suite, testing::ValuesIn(::throng::tests::all_settings()), \
                           ::throng::tests::setting_name)

}  // namespace throng::tests
