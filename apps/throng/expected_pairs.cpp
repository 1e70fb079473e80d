#include "apps/throng/expected_pairs.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include <fmt/format.h>

namespace throng::cli {

ExpectedPairs::ExpectedPairs(const Boxes& a, const Boxes* b, float margin,
                             const std::function<void(std::size_t)>& progress)
    : ExpectedPairs(a.size(), double_loop(a, b, margin, progress)) {}

ExpectedPairs::ExpectedPairs(std::size_t rows, LoopResult reference) : loop_(std::move(reference)) {
  rows_.assign(rows + 1, 0);
  for (const Pair& pair : loop_.pairs) ++rows_[std::size_t{pair.first} + 1];
  for (std::size_t i = 1; i < rows_.size(); ++i) rows_[i] += rows_[i - 1];
  reported_.resize(loop_.pairs.size());
}

std::vector<std::string> ExpectedPairs::differences(const Pair* pairs, std::size_t count,
                                                    bool in_order) {
  std::vector<std::string> list;
  if (in_order && count == reported_.size() &&
      (count == 0 || std::memcmp(pairs, loop_.pairs.data(), count * sizeof(Pair)) == 0)) {
    return list;
  }
  first_.reset();
  std::fill(reported_.begin(), reported_.end(), std::uint8_t{0});
  std::uint64_t extra = 0, twice = 0, missing = 0;
  const auto note = [&](std::uint64_t& how_many, const char* what, const Pair& pair) {
    if (list.empty()) first_ = {what, pair};
    if (how_many++ < 3) list.push_back(fmt::format("{} ({}, {})", what, pair.first, pair.second));
  };
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t at = find(pairs[k]);
    if (at == reported_.size()) {
      note(extra, "extra", pairs[k]);
    } else if (reported_[at]) {
      note(twice, "twice", pairs[k]);
    } else {
      reported_[at] = 1;
    }
  }
  for (std::size_t at = 0; at < reported_.size(); ++at) {
    if (!reported_[at]) note(missing, "missing", loop_.pairs[at]);
  }
  if (missing + extra + twice > 0) {
    list.push_back(
        fmt::format("in all {} missing, {} extra, {} reported twice", missing, extra, twice));
  } else if (in_order) {
    list.push_back("the expected pairs, but not in sorted order");
  }
  return list;
}

// The pair's position in the sorted list; the list's size if it is absent.
std::size_t ExpectedPairs::find(const Pair& pair) const {
  if (pair.first >= rows_.size() - 1) return reported_.size();
  const auto begin = loop_.pairs.begin() + static_cast<std::ptrdiff_t>(rows_[pair.first]);
  const auto end = loop_.pairs.begin() + static_cast<std::ptrdiff_t>(rows_[pair.first + 1]);
  const auto at = std::lower_bound(begin, end, pair);
  return at != end && *at == pair ? static_cast<std::size_t>(at - loop_.pairs.begin())
                                  : reported_.size();
}

}  // namespace throng::cli
