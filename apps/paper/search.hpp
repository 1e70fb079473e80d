// The work of one brute-force thread: compute its pair, test it, store the result in one of the
// output forms. Function objects, launched by a loop on the host or by a kernel on a device.
#pragma once

#include <cstdint>
#include <limits>

#include <throng/types.hpp>

#include "apps/paper/matrix.hpp"
#include "base/bounds.hpp"
#include "base/host_device_macros.hpp"
#include "device/atomic.hpp"

namespace throng::paper {

// A box that overlaps nothing: every comparison with a NaN is false.
THRONG_HD constexpr Box nothing() noexcept {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  return {{nan, nan, nan}, {nan, nan, nan}};
}

// The update of the bounding volumes: thread i copies object i's box. An inverted box is an empty
// slot and becomes NaN: otherwise it would overlap boxes that contain it.
struct CopyBox {
  const Box* given;
  Box* boxes;

  THRONG_HD void operator()(std::uint64_t i) const noexcept {
    boxes[i] = base::is_active(given[i]) ? given[i] : nothing();
  }
};

// Whether thread t's pair overlaps.
template <class Mapping>
struct PairTest {
  Mapping mapping;
  const Box* boxes;
  std::uint64_t n;

  THRONG_HD bool operator()(std::uint64_t t, Pair& pair) const noexcept {
    return mapping(t, n, pair) && base::overlaps(boxes[pair.first], boxes[pair.second]);
  }
  THRONG_HD bool operator()(std::uint64_t t) const noexcept {
    Pair pair{};
    return (*this)(t, pair);
  }
};

template <class Mapping>
struct FillList {
  Mapping mapping;
  std::uint64_t n;
  Pair* list;

  THRONG_HD void operator()(std::uint64_t k) const noexcept { mapping(k, n, list[k]); }
};

template <class Tested>
struct WriteByte {
  Tested test;
  std::uint8_t* bytes;

  THRONG_HD void operator()(std::uint64_t t) const noexcept { bytes[t] = test(t) ? 1 : 0; }
};

// The paper's method for one bit per pair: a thread that found an overlap reads its byte, sets its
// bit, and writes the byte back. Eight threads share the byte. Threads of one warp read together
// and then write together, so only one of several writes survives: a race. In two halves, so that a
// host can run a warp in lockstep, too.
template <class Tested>
struct WriteBitRacy {
  Tested test;
  std::uint8_t* bytes;

  THRONG_HD static std::uint8_t bit(std::uint64_t t) noexcept {
    return static_cast<std::uint8_t>(1u << (t % 8));
  }
  THRONG_HD bool read(std::uint64_t t, std::uint8_t& byte) const noexcept {
    if (!test(t)) return false;
    byte = bytes[t / 8];
    return true;
  }
  THRONG_HD void write(std::uint64_t t, std::uint8_t byte) const noexcept {
    bytes[t / 8] = static_cast<std::uint8_t>(byte | bit(t));
  }
  THRONG_HD void operator()(std::uint64_t t) const noexcept {
    std::uint8_t byte = 0;
    if (read(t, byte)) write(t, byte);
  }
};

// The same without the race: one atomic read-modify-write.
template <class Tested>
struct WriteBitAtomic {
  Tested test;
  std::uint32_t* words;

  THRONG_HD void operator()(std::uint64_t t) const noexcept {
    if (test(t)) device::fetch_or(words + t / bits_per_word, 1u << (t % bits_per_word));
  }
};

// Nothing is shared: one thread tests the 32 pairs of a word and writes the word.
template <class Tested>
struct WriteWord {
  Tested test;
  std::uint32_t* words;
  std::uint64_t count;  // of pairs

  THRONG_HD void operator()(std::uint64_t w) const noexcept {
    const std::uint64_t begin = w * bits_per_word;
    const std::uint64_t left = count - begin;
    const std::uint32_t size =
        static_cast<std::uint32_t>(left < bits_per_word ? left : bits_per_word);
    std::uint32_t word = 0;
    for (std::uint32_t bit = 0; bit < size; ++bit) {
      word |= static_cast<std::uint32_t>(test(begin + bit)) << bit;
    }
    words[w] = word;
  }
};

// Pairs through a counter: `found` counts all of them, those within the capacity are written.
struct PairSink {
  Pair* pairs;
  std::uint64_t capacity;
  std::uint64_t* found;

  THRONG_HD void operator()(Pair pair) const noexcept {
    const std::uint64_t at = device::fetch_add(found, 1);
    if (at < capacity) pairs[at] = pair;
  }
};

template <class Tested>
struct WritePair {
  Tested test;
  PairSink sink;

  THRONG_HD void operator()(std::uint64_t t) const noexcept {
    Pair pair{};
    if (test(t, pair)) sink(pair);
  }
};

}  // namespace throng::paper
