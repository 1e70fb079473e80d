#include "support/vectorized_reference.hpp"

#include <algorithm>
#include <limits>

#include "support/sanitized.hpp"

namespace throng::tests {

// One copy of the loop per instruction set, chosen at program start. Not under sanitizers, which
// are not initialized when that choice runs.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__gnu_linux__) && \
    !THRONG_SANITIZED
#define THRONG_TARGET_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define THRONG_TARGET_CLONES
#endif

// An inactive box is all NaN, so no comparison with it holds, not even against infinite bounds.
void VectorizedReference::Side::read(const Boxes& boxes, float margin) {
  const std::vector<Item> items = read_items(boxes, margin);
  const std::size_t n = items.size();
  for (int k = 0; k < 3; ++k) lower[k].resize(n), upper[k].resize(n);
  group.resize(n), mask.resize(n), owner.resize(n), world.resize(n), is_static.resize(n);
  inactive = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Item& item = items[i];
    inactive += item.active ? 0 : 1;
    for (int k = 0; k < 3; ++k) {
      lower[k][i] = item.active ? item.lower[k] : std::numeric_limits<float>::quiet_NaN();
      upper[k][i] = item.active ? item.upper[k] : std::numeric_limits<float>::quiet_NaN();
    }
    group[i] = item.group, mask[i] = item.mask;
    owner[i] = item.owner, world[i] = item.world;
    is_static[i] = item.is_static ? 1 : 0;
  }
  const Filters& f = boxes.filters;
  filtered = f.group || f.mask || f.owner || f.world || f.is_static;
}

namespace {

struct Corners {
  const float *lx, *ly, *lz, *ux, *uy, *uz;
};

// Marks the boxes of [begin, end) that overlap box `a`.
THRONG_TARGET_CLONES
std::uint32_t meets_any(const Corners& c, const float (&a)[6], std::size_t begin, std::size_t end,
                        std::uint32_t* hit) {
  const float alx = a[0], aly = a[1], alz = a[2], aux = a[3], auy = a[4], auz = a[5];
  const float *lx = c.lx, *ly = c.ly, *lz = c.lz, *ux = c.ux, *uy = c.uy, *uz = c.uz;
  const auto u = [](bool b) { return static_cast<std::uint32_t>(b); };
  std::uint32_t any = 0;
  for (std::size_t j = begin; j < end; ++j) {
    const std::uint32_t h = u(alx <= ux[j]) & u(lx[j] <= aux) & u(aly <= uy[j]) & u(ly[j] <= auy) &
                            u(alz <= uz[j]) & u(lz[j] <= auz);
    hit[j] = h;
    any |= h;
  }
  return any;
}

}  // namespace

void VectorizedReference::row(const Side& c, std::size_t i, std::size_t begin, std::size_t end) {
  const Corners corners{c.lower[0].data(), c.lower[1].data(), c.lower[2].data(),
                        c.upper[0].data(), c.upper[1].data(), c.upper[2].data()};
  const float own[6] = {left_.lower[0][i], left_.lower[1][i], left_.lower[2][i],
                        left_.upper[0][i], left_.upper[1][i], left_.upper[2][i]};
  const std::uint32_t* hit = hit_.data();
  if (!meets_any(corners, own, begin, end, hit_.data())) return;
  const bool filtered = left_.filtered || c.filtered;
  for (std::size_t j = begin; j < end; ++j) {
    if (!hit[j]) continue;
    if (filtered) {
      if ((left_.group[i] & c.mask[j]) == 0 || (c.group[j] & left_.mask[i]) == 0) continue;
      if (left_.owner[i] != -1 && left_.owner[i] == c.owner[j]) continue;
      if (left_.world[i] != -1 && c.world[j] != -1 && left_.world[i] != c.world[j]) continue;
      if (left_.is_static[i] && c.is_static[j]) continue;
    }
    pairs_.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
  }
}

void VectorizedReference::run(const Boxes& a, const Boxes& b, bool two_sets, float margin) {
  left_.read(a, margin);
  if (two_sets) right_.read(b, margin);
  const Side& columns = two_sets ? right_ : left_;
  const std::size_t width = two_sets ? b.size() : a.size();
  rows_ = a.size();
  inactive_ = left_.inactive + (two_sets ? right_.inactive : 0);
  hit_.assign(width, 0);
  pairs_.clear();
  for (std::size_t i = 0; i < rows_; ++i) row(columns, i, two_sets ? 0 : i + 1, width);
  begin_.assign(rows_ + 1, 0);
  for (const Pair& p : pairs_) ++begin_[p.first + 1];
  for (std::size_t i = 0; i < rows_; ++i) begin_[i + 1] += begin_[i];
}

std::string VectorizedReference::compare(const Pair* got, std::size_t count, bool in_order) {
  if (in_order)
    return std::equal(got, got + count, pairs_.begin(), pairs_.end())
               ? ""
               : "in sorted order: " +
                     std::string(same_pairs({got, got + count}, pairs_).message());
  bool same = count == pairs_.size();
  // The right number of pairs, each valid, none twice: so none is missing.
  if (same) seen_.assign(count, 0);
  for (std::size_t k = 0; same && k < count; ++k) {
    same = got[k].first < rows_;
    if (!same) break;
    const auto end = pairs_.begin() + begin_[got[k].first + 1];
    const auto at = std::lower_bound(pairs_.begin() + begin_[got[k].first], end, got[k]);
    same = at != end && *at == got[k] && !seen_[static_cast<std::size_t>(at - pairs_.begin())]++;
  }
  return same ? "" : same_pairs({got, got + count}, pairs_).message();
}

}  // namespace throng::tests
