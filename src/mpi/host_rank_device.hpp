// The RankDevice for host memory: Backend::emulated of DeviceFinder.
#pragma once

#include <algorithm>
#include <cstring>
#include <memory_resource>
#include <new>

#include <throng/finder.hpp>
#include <throng/mpi_cuda.hpp>

#include "device/host_device.hpp"
#include "device/input.hpp"
#include "mpi/distributed_search.hpp"

namespace throng::mpi {

class HostRankDevice : public device::HostDevice {
 public:
  explicit HostRankDevice(const Settings& settings)
      : HostDevice(
            settings.search.memory ? settings.search.memory : std::pmr::new_delete_resource(),
            run_sequentially),
        finder_(local_options(settings)) {
    HostDevice::begin(Executor{}, 1);
  }

  void begin(cuda::Stream) const noexcept {}
  struct Current {
    explicit Current(const HostRankDevice&) noexcept {}
  };
  static void require(const device::Set&, std::size_t, const std::uint64_t*) noexcept {}
  static bool mpi_accepts_pointers() noexcept { return true; }

  static void download(void* to, const void* from, std::size_t bytes) noexcept {
    if (bytes) std::memcpy(to, from, bytes);
  }
  static void upload(void* to, const void* from, std::size_t bytes) noexcept {
    download(to, from, bytes);
  }
  static void wait() noexcept {}
  // The memory of staged copies.
  struct Staging {
    static void* allocate(std::size_t bytes) { return ::operator new(bytes); }
    static void release(void* p, std::size_t) noexcept { ::operator delete(p); }
  };

  Result find(const Boxes& a, const Boxes* b, Pairs& pairs) noexcept {
    const Result r = b ? finder_.find(a, *b) : finder_.find(a);
    pairs = finder_.pairs();
    return r;
  }
  static std::size_t sort64_bytes(std::size_t) noexcept { return 0; }
  static void sort64(Pair64* pairs, std::size_t count, void*, std::size_t) {
    std::sort(pairs, pairs + count);
  }

 private:
  // Runs tasks sequentially on this thread, in the call's floating-point state.
  static void run_sequentially(const Executor&, unsigned count, void (*task)(void*, unsigned),
                               void* context) {
    for (unsigned i = 0; i < count; ++i) task(context, i);
  }

  throng::Finder finder_;
};

}  // namespace throng::mpi
