// Sorts keys that are sorted except for short runs. Included once per instruction set.
#if defined(THRONG_KERNELS_SORT_RUNS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_SORT_RUNS_INL
#undef THRONG_KERNELS_SORT_RUNS_INL
#else
#define THRONG_KERNELS_SORT_RUNS_INL
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "grid/sweep/kernel_table.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Odd-even transposition sort: each step compares every key with a neighbour, alternately the next
// and the previous. A run is sorted after as many steps as it has keys.
HWY_INLINE void transpose_neighbours(std::uint32_t* keys, std::size_t count, std::uint32_t steps) {
  constexpr hn::CappedTag<std::uint32_t, KeyRuns::padding> d{};
  for (std::uint32_t step = 0; step < steps; ++step) {
    for (std::size_t i = step % 2; i < count; i += hn::MaxLanes(d)) {
      const auto key = hn::LoadU(d, keys + i);
      const auto neighbour = hn::Shuffle2301(key);
      hn::StoreU(hn::OddEven(hn::Max(key, neighbour), hn::Min(key, neighbour)), d, keys + i);
    }
  }
}

// Needs vectors of four pairs or more.
template <std::uint32_t pairs_per_vector>
void sort_runs(const KeyRuns& runs, Pair* to) {
  const std::size_t count = runs.count;
  // The padding is the maximum, so comparing with it is a no-op.
  std::fill_n(runs.keys.data() + count, KeyRuns::padding, ~std::uint32_t{0});
  if (runs.longest > 1) transpose_neighbours(runs.keys.data(), count, runs.longest);
  constexpr hn::CappedTag<std::uint64_t, pairs_per_vector> d{};
  constexpr hn::Rebind<std::uint32_t, decltype(d)> d_key{};
  const auto second_bits = static_cast<int>(runs.second_bits);
  const auto second_mask = hn::Set(d, (std::uint64_t{1} << runs.second_bits) - 1);
  const auto first_above = hn::Set(d, std::uint64_t{runs.first_above});
  for (std::size_t i = 0; i < count; i += pairs_per_vector) {
    const auto key = hn::PromoteTo(d, hn::LoadU(d_key, runs.keys.data() + i));
    const auto pair = hn::Or(hn::Or(hn::ShiftRightSame(key, second_bits), first_above),
                             hn::ShiftLeft<32>(hn::And(key, second_mask)));
    auto* const at = reinterpret_cast<std::uint64_t*>(to + i);
    if (count - i >= pairs_per_vector)
      hn::StoreU(pair, d, at);
    else
      hn::BlendedStore(pair, hn::FirstN(d, count - i), d, at);
  }
}

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
