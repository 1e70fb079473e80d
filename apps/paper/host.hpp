// The host as a device: kernel launches run as plain loops, split among the given number of
// std::threads. The same interface as the CUDA side's (cuda.cu).
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

#include <throng/types.hpp>

#include "apps/paper/matrix.hpp"

namespace throng::paper {

inline constexpr std::uint32_t warp_size = 32;

class HostDevice {
 public:
  explicit HostDevice(unsigned threads = 1) : threads_(threads == 0 ? 1 : threads) {}

  // Uninitialized memory.
  template <class T>
  class Array {
   public:
    T* data() const noexcept { return data_.get(); }
    std::uint64_t size() const noexcept { return size_; }
    // Growing loses the contents; it never shrinks.
    void reserve(std::uint64_t size) {
      if (size <= size_) return;
      size_ = 0;
      data_.reset();
      data_.reset(new T[size]);
      size_ = size;
    }

   private:
    std::unique_ptr<T[]> data_;
    std::uint64_t size_ = 0;
  };

  template <class T>
  void zero(Array<T>& array, std::uint64_t count) {
    if (count > 0) std::memset(array.data(), 0, count * sizeof(T));
  }

  // f(t) for t = 0 .. count - 1, each once, in any order. Blocks are multiples of a warp, so that
  // no two host threads share a byte or word of the output.
  template <class F>
  void each(std::uint64_t count, const F& f) {
    in_blocks(count, 1u << 14, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t t = begin; t < end; ++t) f(t);
    });
  }

  // A warp votes: bit t % 32 of word t / 32 is test(t).
  template <class F>
  void ballots(std::uint64_t count, const F& test, std::uint32_t* words) {
    in_blocks(count, 1u << 14, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t warp = begin; warp < end; warp += warp_size) {
        std::uint32_t votes = 0;
        for (std::uint32_t lane = 0; lane < warp_size && warp + lane < end; ++lane) {
          votes |= static_cast<std::uint32_t>(test(warp + lane)) << lane;
        }
        words[warp / bits_per_word] = votes;
      }
    });
  }

  // The lanes of a warp in lockstep: all of them read, then those with a result write, one after
  // the other. A schedule that the racy form allows; deterministic.
  template <class F>
  void in_lockstep(std::uint64_t count, const F& f) {
    in_blocks(count, 1u << 14, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t warp = begin; warp < end; warp += warp_size) {
        std::uint8_t seen[warp_size];
        bool writes[warp_size];
        const std::uint64_t lanes = std::min<std::uint64_t>(warp_size, end - warp);
        for (std::uint64_t lane = 0; lane < lanes; ++lane) {
          writes[lane] = f.read(warp + lane, seen[lane]);
        }
        for (std::uint64_t lane = 0; lane < lanes; ++lane) {
          if (writes[lane]) f.write(warp + lane, seen[lane]);
        }
      }
    });
  }

  // f(team, lane, lanes) for each team of threads; on the host a team is one thread.
  template <class F>
  void teams(std::uint64_t count, const F& f) {
    in_blocks(count, 64, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t team = begin; team < end; ++team) f(team, 0, 1);
    });
  }

  // sums[i] = values[0] + .. + values[i - 1], for i = 0 .. count - 1.
  void scan(const std::uint32_t* values, std::uint64_t* sums, std::uint64_t count) {
    std::uint64_t sum = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      sums[i] = sum;
      sum += values[i];
    }
  }

  // Nothing is transferred: the caller's memory is used directly.
  void hold(const Box*, std::uint64_t) {}
  const Box* upload(const Box* boxes, std::uint64_t) { return boxes; }
  std::uint64_t read(const std::uint64_t* value) { return *value; }
  template <class T>
  const T* fetch(const Array<T>& array, std::uint64_t) {
    return array.data();
  }

  // Stage times of one step: restart, mark the end of each stage, read when done.
  void restart() {
    marks_.clear();
    mark();
  }
  void mark() { marks_.push_back(std::chrono::steady_clock::now()); }
  void finish() {}
  // Between marks `stage` and `stage + 1`.
  double ms(std::size_t stage) const {
    return std::chrono::duration<double, std::milli>(marks_[stage + 1] - marks_[stage]).count();
  }

 private:
  template <class Block>
  void in_blocks(std::uint64_t count, std::uint64_t size, const Block& block) {
    std::atomic<std::uint64_t> next{0};
    const auto work = [&] {
      for (;;) {
        const std::uint64_t begin = next.fetch_add(size, std::memory_order_relaxed);
        if (begin >= count) return;
        block(begin, std::min(begin + size, count));
      }
    };
    const std::uint64_t useful = (count + size - 1) / size;
    std::vector<std::thread> helpers;
    for (unsigned i = 1; i < threads_ && i < useful; ++i) helpers.emplace_back(work);
    work();
    for (std::thread& helper : helpers) helper.join();
  }

  unsigned threads_;
  std::vector<std::chrono::steady_clock::time_point> marks_;
};

}  // namespace throng::paper
