// The reference implementation: a double loop over all pairs. It shares only public types with the
// library, and computes even the margin differently (by directed rounding).
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <vector>

#include <throng/throng.hpp>

#include "support/sanitized.hpp"

namespace throng::tests {

// One box with its filter values, read from a view.
template <class Real>
struct BasicItem {
  Real lower[3], upper[3];
  std::uint32_t group = 0xffffffffu, mask = 0xffffffffu;
  std::int32_t owner = -1, world = -1;
  bool is_static = false;
  bool active = true;
};
using Item = BasicItem<float>;

template <class Real>
Real subtract_down(Real x, Real m) {
  const volatile Real a = x, b = m;
  std::fesetround(FE_DOWNWARD);
  const volatile Real difference = a - b;
  std::fesetround(FE_TONEAREST);
  return difference;
}
template <class Real>
Real add_up(Real x, Real m) {
  const volatile Real a = x, b = m;
  std::fesetround(FE_UPWARD);
  const volatile Real sum = a + b;
  std::fesetround(FE_TONEAREST);
  return sum;
}

template <class Real>
std::vector<BasicItem<Real>> items_of(const BasicBoxes<Real>& boxes, float margin_given) {
  const Real margin = margin_given;
  std::vector<BasicItem<Real>> items(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    BasicItem<Real>& item = items[i];
    const auto box = boxes[i];
    const Real lower[3] = {box.lower.x, box.lower.y, box.lower.z};
    const Real upper[3] = {box.upper.x, box.upper.y, box.upper.z};
    for (int axis = 0; axis < 3; ++axis) {
      if (!(lower[axis] <= upper[axis])) item.active = false;  // NaN too
      item.lower[axis] = margin > 0 ? subtract_down(lower[axis], margin) : lower[axis];
      item.upper[axis] = margin > 0 ? add_up(upper[axis], margin) : upper[axis];
    }
    const Filters& f = boxes.filters;
    if (f.group) item.group = f.group[i];
    if (f.mask) item.mask = f.mask[i];
    if (f.owner) item.owner = f.owner[i];
    if (f.world) item.world = f.world[i];
    if (f.is_static) item.is_static = f.is_static[i] != 0;
  }
  return items;
}
inline std::vector<Item> read_items(const Boxes& boxes, float margin) {
  return items_of(boxes, margin);
}

template <class Real>
THRONG_NO_SANITIZE bool disjoint(const BasicItem<Real>& a, const BasicItem<Real>& b) {
  for (int axis = 0; axis < 3; ++axis)
    if (a.upper[axis] < b.lower[axis] || b.upper[axis] < a.lower[axis]) return true;
  return false;
}

template <class Real>
THRONG_NO_SANITIZE bool wanted(const BasicItem<Real>& a, const BasicItem<Real>& b) {
  if ((a.group & b.mask) == 0 || (b.group & a.mask) == 0) return false;
  if (a.owner != -1 && a.owner == b.owner) return false;
  if (a.world != -1 && b.world != -1 && a.world != b.world) return false;
  return !(a.is_static && b.is_static);
}

// The first index from j on (of `count` in all) that pairs with a; `count` if none.
template <class Real>
THRONG_NO_SANITIZE std::uint32_t next_overlap(const BasicItem<Real>& a, const BasicItem<Real>* all,
                                              std::uint32_t j, std::size_t count) {
  while (j < count && (!all[j].active || disjoint(a, all[j]) || !wanted(a, all[j]))) ++j;
  return j;
}

struct Answer {
  std::vector<Pair> pairs;  // sorted
  std::uint64_t inactive = 0;
};

template <class Real>
std::uint64_t count_inactive(const std::vector<BasicItem<Real>>& items) {
  return static_cast<std::uint64_t>(
      std::count_if(items.begin(), items.end(), [](const auto& item) { return !item.active; }));
}

template <class Real>
Answer double_loop_pairs(const BasicBoxes<Real>& boxes, float margin) {
  const std::vector<BasicItem<Real>> items = items_of(boxes, margin);
  Answer answer;
  answer.inactive = count_inactive(items);
  const std::size_t n = items.size();
  for (std::uint32_t i = 0; i < n; ++i) {
    if (!items[i].active) continue;
    for (std::uint32_t j = i; (j = next_overlap(items[i], items.data(), j + 1, n)) < n;)
      answer.pairs.push_back({i, j});
  }
  return answer;
}

template <class Real>
Answer double_loop_pairs(const BasicBoxes<Real>& a, const BasicBoxes<Real>& b, float margin) {
  const std::vector<BasicItem<Real>> left = items_of(a, margin), right = items_of(b, margin);
  Answer answer;
  answer.inactive = count_inactive(left) + count_inactive(right);
  const std::size_t n = right.size();
  for (std::uint32_t i = 0; i < left.size(); ++i) {
    if (!left[i].active) continue;
    for (std::uint32_t j = 0; (j = next_overlap(left[i], right.data(), j, n)) < n; ++j)
      answer.pairs.push_back({i, j});
  }
  return answer;
}

inline Answer reference_pairs(const Boxes& boxes, float margin = 0) {
  return double_loop_pairs(boxes, margin);
}
inline Answer reference_pairs(const Boxes& a, const Boxes& b, float margin = 0) {
  return double_loop_pairs(a, b, margin);
}
inline Answer reference_pairs(const DoubleBoxes& boxes, float margin = 0) {
  return double_loop_pairs(boxes, margin);
}
inline Answer reference_pairs(const DoubleBoxes& a, const DoubleBoxes& b, float margin = 0) {
  return double_loop_pairs(a, b, margin);
}

// For sets too large for the double loop: one sort and one sweep along `axis`. No filters. Tested
// against the double loop in tests/support.
inline Answer swept_pairs(const Boxes& boxes, int axis = 0) {
  std::vector<Item> items = read_items(boxes, 0);
  Answer answer;
  answer.inactive = count_inactive(items);
  std::vector<std::uint32_t> order;
  for (std::uint32_t i = 0; i < items.size(); ++i)
    if (items[i].active) order.push_back(i);
  std::sort(order.begin(), order.end(), [&](std::uint32_t i, std::uint32_t j) {
    return items[i].lower[axis] < items[j].lower[axis];
  });
  for (std::size_t s = 0; s < order.size(); ++s) {
    const Item& a = items[order[s]];
    for (std::size_t t = s + 1; t < order.size(); ++t) {
      if (a.upper[axis] < items[order[t]].lower[axis]) break;
      if (!disjoint(a, items[order[t]]))
        answer.pairs.push_back({std::min(order[s], order[t]), std::max(order[s], order[t])});
    }
  }
  std::sort(answer.pairs.begin(), answer.pairs.end());
  return answer;
}

inline void print_pairs(std::ostream& out, const char* what, const std::vector<Pair>& pairs) {
  if (pairs.empty()) return;
  out << "\n  " << pairs.size() << ' ' << what << ':';
  for (std::size_t i = 0; i < pairs.size() && i < 5; ++i)
    out << " (" << pairs[i].first << ", " << pairs[i].second << ')';
}

// Compares exact multisets; `want` is sorted. Reports the first missing, extra and duplicate pairs.
inline testing::AssertionResult same_pairs(std::vector<Pair> got, const std::vector<Pair>& want) {
  if (!std::is_sorted(got.begin(), got.end())) std::sort(got.begin(), got.end());
  if (got == want) return testing::AssertionSuccess();
  std::vector<Pair> missing, extra, duplicates;
  std::size_t g = 0;
  for (const Pair& pair : want) {
    for (; g < got.size() && got[g] < pair; ++g) {
      const bool repeated = g > 0 && got[g - 1] == got[g];
      (repeated ? duplicates : extra).push_back(got[g]);
    }
    if (g < got.size() && got[g] == pair)
      ++g;
    else
      missing.push_back(pair);
  }
  for (; g < got.size(); ++g)
    (g > 0 && got[g - 1] == got[g] ? duplicates : extra).push_back(got[g]);
  std::ostringstream out;
  out << got.size() << " pairs instead of " << want.size();
  print_pairs(out, "missing", missing);
  print_pairs(out, "extra", extra);
  print_pairs(out, "duplicate", duplicates);
  return testing::AssertionFailure() << out.str();
}

inline std::vector<Pair> to_vector(const Pairs& pairs) { return {pairs.begin(), pairs.end()}; }

}  // namespace throng::tests
