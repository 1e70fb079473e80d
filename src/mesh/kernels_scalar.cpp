// The scalar test of candidate pairs: a filter of doubles, then the exact rule.
#include <cstddef>
#include <cstdint>

#include "mesh/decide_pair.hpp"
#include "mesh/pair_kernels.hpp"

namespace throng::mesh {
namespace {

// Adds to `exact_tests` if the filter cannot decide.
template <class Real>
bool decide_fully(const PairInput& input, Pair pair, std::uint64_t& exact_tests) noexcept {
  if (!input.exact_only) {
    const Decision decision = filter_pair(input, pair, VertexAs<Real>());
    if (decision != Decision::unsure) [[likely]]
      return decision == Decision::yes;
  }
  ++exact_tests;
  return exact_pair(input, pair, VertexAs<Real>());
}

template <class Real>
std::size_t keep(const PairInput& input, Pair* pairs, std::size_t count,
                 std::uint64_t& exact_tests) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Pair pair = pairs[i];
    pairs[kept] = pair;
    kept += decide_fully<Real>(input, pair, exact_tests);
  }
  return kept;
}

std::size_t keep_any(const PairInput& input, Pair* pairs, std::size_t count,
                     std::uint64_t& exact_tests) {
  return input.is_float ? keep<float>(input, pairs, count, exact_tests)
                        : keep<double>(input, pairs, count, exact_tests);
}

}  // namespace

bool decide_pair(const PairInput& input, Pair pair, std::uint64_t& exact_tests) noexcept {
  return input.is_float ? decide_fully<float>(input, pair, exact_tests)
                        : decide_fully<double>(input, pair, exact_tests);
}

const PairKernels scalar_pair_kernels = {Isa::scalar, keep_any, nullptr};

}  // namespace throng::mesh
