// A double loop that the compiler can vectorize: fast enough for billions of tests. It shares only
// public types with the library, and is itself tested against support/reference.hpp.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "support/reference.hpp"

namespace throng::tests {

class VectorizedReference {
 public:
  // Pairs of `a`, or with two_sets of `a` and `b`.
  void run(const Boxes& a, const Boxes& b, bool two_sets, float margin);

  const std::vector<Pair>& pairs() const { return pairs_; }  // sorted
  std::uint64_t inactive() const { return inactive_; }
  // Returns "" if `got` holds each of the pairs once and nothing else (with in_order: sorted); else
  // a description of the difference.
  std::string compare(const Pair* got, std::size_t count, bool in_order);

 private:
  struct Side {
    std::vector<float> lower[3], upper[3];
    std::vector<std::uint32_t> group, mask;
    std::vector<std::int32_t> owner, world;
    std::vector<std::uint8_t> is_static;
    bool filtered = false;
    std::uint64_t inactive = 0;
    void read(const Boxes& boxes, float margin);
  };
  void row(const Side& columns, std::size_t i, std::size_t begin, std::size_t end);

  Side left_, right_;
  std::vector<std::uint32_t> hit_;
  std::vector<std::uint8_t> seen_;
  std::vector<std::ptrdiff_t> begin_;  // per first index, into pairs_
  std::vector<Pair> pairs_;
  std::uint64_t inactive_ = 0;
  std::size_t rows_ = 0;
};

}  // namespace throng::tests
