// The sweep of a strip against itself, a vector of queries at a time: what the two orders of its
// pairs share (kernels_sweep_diagonal-inl.hpp, kernels_sweep_broadcast-inl.hpp). Included once per
// instruction set.
#if defined(THRONG_KERNELS_SWEEP_BLOCK_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef THRONG_KERNELS_SWEEP_BLOCK_INL
#undef THRONG_KERNELS_SWEEP_BLOCK_INL
#else
#define THRONG_KERNELS_SWEEP_BLOCK_INL
#endif

#include <hwy/highway.h>

#include "grid/emit/kernels_write_pairs-inl.hpp"
#include "grid/sweep/kernels_box_test-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace throng::grid::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Queries are processed in blocks, so that a block's lists stay in the L1 cache.
constexpr std::uint32_t query_block = 256;

// The rest of a query's window: the query's index in its block, and the next target.
struct Window {
  std::uint32_t query, at;
};
struct Windows {
  Window at[query_block + 8];  // the last vector of queries may go beyond the block
  std::uint32_t count = 0;
  HWY_INLINE void add(std::size_t query, std::size_t target, bool is_open = true) {
    at[count] = {static_cast<std::uint32_t>(query), static_cast<std::uint32_t>(target)};
    count += is_open;
  }
};

// An Order has:
//   D                       the tag of a vector of coordinates
//   targets_per_vector      by how many targets the next vector of pairs is ahead
//   queries(strip, i)       the boxes that queries i, i + 1, ... take in a vector, and
//   targets(strip, t)       those that targets t, t + 1, ... take
//   first_of_pair(least, i, t)   `least`, below 0 where a query does not precede its target
//   ids(...)                see write_pairs()
template <Orientation orientation, class Order>
class BlockSweep {
 public:
  BlockSweep(const Strip& strip, PairOutput& out) : strip_(strip), out_(out) {}

  // Writes the pairs of all hits and of all ties.
  void write() {
    write<PairState::confirmed>(hits_);
    if (HWY_UNLIKELY(ties_.count != 0)) write<PairState::tie>(ties_);
  }
  std::uint64_t comparisons() const { return vectors_ * lanes; }

 protected:
  using D = typename Order::D;
  static constexpr std::size_t lanes = hn::MaxLanes(D());
  static constexpr std::size_t targets_per_step = 4 * Order::targets_per_vector;

  // Tests the queries from `i` on against targets_per_step targets from `t` on. `on_diagonal`: some
  // of these are among the queries. Hits are counted in `hits_end`, a local variable of a loop: the
  // compiler must assume that the stores may change the member.
  template <bool ordered, bool on_diagonal>
  HWY_INLINE void test(const Strip& s, const Queries<D>& queries, std::size_t i, std::size_t t,
                       std::size_t& hits_end) {
    const auto four = overlaps_of_four(
        D(),
        [&](std::size_t k) HWY_ATTR { return least<ordered, on_diagonal>(s, queries, i, t, k); },
        queries.mask, [&](std::size_t k) HWY_ATTR { return target_mask_of(targets(s, t, k)); });
    for (std::size_t w = 0; w < FourVectors<D>::words; ++w)
      hits_.add(i, target_of_word(t, w), four.overlaps[w], hits_end);
    if (HWY_UNLIKELY(four.ties)) collect_ties(four.l0, four.l1, four.l2, four.l3, i, t);
    if (HWY_UNLIKELY(hits_end > Hits::capacity - FourVectors<D>::words)) {
      hits_.count = hits_end;
      write<PairState::confirmed>(hits_);
      hits_end = 0;
    }
  }

  const Strip& strip_;
  PairOutput& out_;
  std::uint64_t vectors_ = 0;
  Hits hits_, ties_;

 private:
  static HWY_INLINE auto targets(const Strip& s, std::size_t t, std::size_t k) {
    return Order::targets(s, t + k * Order::targets_per_vector);
  }
  // The first target of the word's pairs.
  static constexpr std::size_t target_of_word(std::size_t t, std::size_t word) {
    return t + word * (64 / lanes) * Order::targets_per_vector;
  }
  template <bool ordered, bool on_diagonal>
  static HWY_INLINE hn::Vec<D> least(const Strip& s, const Queries<D>& queries, std::size_t i,
                                     std::size_t t, std::size_t k) {
    const auto l = least_difference<ordered>(queries, targets(s, t, k));
    if constexpr (on_diagonal)
      return Order::first_of_pair(l, i, t + k * Order::targets_per_vector);
    else
      return l;
  }

  // Collects ties for the floats to decide. The differences come in registers: an array of them
  // would be stored at every step, with or without ties.
  HWY_NOINLINE void collect_ties(hn::Vec<D> l0, hn::Vec<D> l1, hn::Vec<D> l2, hn::Vec<D> l3,
                                 std::size_t i, std::size_t t) {
    const auto query_mask = Order::queries(strip_, i).load(words(strip_.query_mask.data()));
    const auto ties_of = [&](hn::Vec<D> least, std::size_t k) HWY_ATTR {
      std::uint32_t ties;
      overlaps_of_vector(D(), least, query_mask, target_mask_of(targets(strip_, t, k)), ties);
      return std::uint64_t{ties} << k * lanes % 64;
    };
    const std::uint64_t low = ties_of(l0, 0) | ties_of(l1, 1),
                        high = ties_of(l2, 2) | ties_of(l3, 3);
    if constexpr (FourVectors<D>::words == 2) {
      ties_.add(i, t, low);
      ties_.add(i, target_of_word(t, 1), high);
    } else {
      ties_.add(i, t, low | high);
    }
    if (ties_.count > Hits::capacity - FourVectors<D>::words) write<PairState::tie>(ties_);
  }

  template <PairState state>
  HWY_NOINLINE void write(Hits& hits) {
    const std::uint32_t* const ids = strip_.id.data();
    write_pairs<orientation, state>(
        hits, out_, [ids](auto&&... place) HWY_ATTR { return Order::ids(ids, place...); });
  }
};

}  // namespace throng::grid::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
