#include "support/plain_loop.hpp"

#include <algorithm>
#include <limits>

namespace throng::tests {

// An inactive box is all NaN: no comparison with it holds, not even against infinite bounds.
void PlainLoop::Side::read(const Boxes& boxes, float margin) {
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

void PlainLoop::row(const Side& c, std::size_t i, std::size_t begin, std::size_t end) {
  const float alx = left_.lower[0][i], aly = left_.lower[1][i], alz = left_.lower[2][i];
  const float aux = left_.upper[0][i], auy = left_.upper[1][i], auz = left_.upper[2][i];
  const float *lx = c.lower[0].data(), *ly = c.lower[1].data(), *lz = c.lower[2].data();
  const float *ux = c.upper[0].data(), *uy = c.upper[1].data(), *uz = c.upper[2].data();
  std::uint8_t* hit = hit_.data();
  const auto u = [](bool b) { return static_cast<unsigned>(b); };
  unsigned any = 0;
  for (std::size_t j = begin; j < end; ++j) {
    const unsigned h = u(alx <= ux[j]) & u(lx[j] <= aux) & u(aly <= uy[j]) & u(ly[j] <= auy) &
                       u(alz <= uz[j]) & u(lz[j] <= auz);
    hit[j] = static_cast<std::uint8_t>(h);
    any |= h;
  }
  if (!any) return;
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

void PlainLoop::run(const Boxes& a, const Boxes& b, bool two_sets, float margin) {
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

std::string PlainLoop::compare(const Pair* got, std::size_t count, bool in_order) {
  if (in_order)
    return std::equal(got, got + count, pairs_.begin(), pairs_.end())
               ? ""
               : "in canonical order: " +
                     std::string(same_pairs({got, got + count}, pairs_).message());
  bool same = count == pairs_.size();
  // As many as there should be, each one of them, none twice: then none is missing.
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
