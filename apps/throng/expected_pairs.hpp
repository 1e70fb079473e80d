// The expected pairs of an input, and the differences of a list of pairs from them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <throng/boxes.hpp>

#include "apps/throng/double_loop.hpp"

namespace throng::cli {

class ExpectedPairs {
 public:
  // By the double loop; see there.
  ExpectedPairs(const Boxes& a, const Boxes* b, float margin,
                const std::function<void(std::size_t)>& progress);

  // Pairs trusted without a double loop, sorted.
  ExpectedPairs(std::size_t rows, LoopResult reference);

  const std::vector<Pair>& pairs() const noexcept { return loop_.pairs; }
  std::uint64_t inactive() const noexcept { return loop_.inactive; }

  // Empty where `pairs` holds each expected pair once and nothing else (and is sorted, if
  // requested); else the first differences and their number.
  std::vector<std::string> differences(const Pair* pairs, std::size_t count, bool in_order);
  // The first wrong pair of the last wrong list, and its kind.
  struct Difference {
    const char* what;  // missing, extra, twice
    Pair pair;
  };
  const std::optional<Difference>& first() const noexcept { return first_; }

 private:
  std::size_t find(const Pair& pair) const;

  LoopResult loop_;
  std::optional<Difference> first_;
  std::vector<std::uint64_t> rows_;     // where each first index begins
  std::vector<std::uint8_t> reported_;  // by position in the sorted list
};

}  // namespace throng::cli
