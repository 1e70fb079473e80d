// Bytes as a stream of choices, from a fuzzer or a random generator. Any bytes are a valid case;
// after the end zeros follow, so every prefix is valid too.
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/random.hpp"

namespace throng::tests {

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  explicit Bytes(const std::vector<std::uint8_t>& bytes) : Bytes(bytes.data(), bytes.size()) {}
  Bytes(std::vector<std::uint8_t>&&) = delete;  // a view

  bool empty() const { return at_ >= size_; }
  std::uint32_t next() { return at_ < size_ ? data_[at_++] : 0; }
  std::uint32_t word() {
    std::uint32_t w = next();
    w |= next() << 8;
    w |= next() << 16;
    return w | next() << 24;
  }
  // 0 .. n-1, n > 0.
  std::uint32_t below(std::uint32_t n) { return (n <= 256 ? next() : word()) % n; }
  int between(int low, int high) {
    return low + static_cast<int>(below(static_cast<std::uint32_t>(high - low + 1)));
  }
  bool one_in(std::uint32_t n) { return below(n) == n - 1; }  // false at the end, unless n is 1

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

inline std::vector<std::uint8_t> random_bytes(Random& random, std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  for (std::size_t i = 0; i < count; i += 8) {
    std::uint64_t word = random.next();
    for (std::size_t k = i; k < count && k < i + 8; ++k, word >>= 8)
      bytes[k] = static_cast<std::uint8_t>(word);
  }
  return bytes;
}

// The library's result differs from the reference; what() describes how.
struct Difference : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace throng::tests
