// The scalar test of candidate pairs: a filter of doubles, then the exact rule.
#include <algorithm>

#include "base/prefetch.hpp"
#include "mesh/pair_kernels.hpp"
#include "mesh/plane_filter.hpp"
#include "mesh/shared_vertices.hpp"

namespace throng::mesh {
namespace {

template <class Real>
bool exact(const PairInput& input, Pair pair) noexcept {
  const Triangle a = input.a.triangle(pair.first), b = input.b.triangle(pair.second);
  const TrianglePoints pa = input.a.points<Real>(a), pb = input.b.points<Real>(b);
  return input.one_mesh ? triangles_pair(a, b, pa, pb) : triangles_meet(pa, pb);
}

template <class Real>
Decision decide(const PairInput& input, Pair pair) noexcept {
  const Triangle a = input.a.triangle(pair.first), b = input.b.triangle(pair.second);
  const TrianglePoints pa = input.a.points<Real>(a), pb = input.b.points<Real>(b);
  const SharedVertices& shared = shared_vertices_table[input.one_mesh ? equal_indices(a, b) : 0];
  const auto in_a = [&](int i) -> const DoubleVec3& { return pa.p[shared.a[i]]; };
  const auto in_b = [&](int i) -> const DoubleVec3& { return pb.p[shared.b[i]]; };
  switch (shared.sharing) {
    case Sharing::none:
      return decide_meeting(pa.p, pb.p);
    case Sharing::vertex:
      return decide_beyond_vertex(in_a(0), in_a(1), in_a(2), in_b(1), in_b(2));
    case Sharing::edge:
      return decide_beyond_edge(in_a(0), in_a(1), in_a(2), in_b(2));
    case Sharing::other:
      break;
  }
  return Decision::unsure;
}

template <class Real>
bool decide_fully(const PairInput& input, Pair pair, std::uint64_t& exact_tests) noexcept {
  if (!input.exact_only) {
    const Decision decision = decide<Real>(input, pair);
    if (decision != Decision::unsure) [[likely]]
      return decision == Decision::yes;
  }
  ++exact_tests;
  return exact<Real>(input, pair);
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

const PairKernels scalar_pair_kernels = {Isa::scalar, keep_any};

}  // namespace throng::mesh
