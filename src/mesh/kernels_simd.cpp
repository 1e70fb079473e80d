// The vector tests of candidate pairs, compiled by Highway once per instruction set.
//
// A block of candidates is split by how their triangles share vertices. Each part is tested one
// vector of pairs at a time, by the filters of mesh/plane_filter.hpp. What they cannot decide takes
// the exact test.
#if defined(THRONG_HIGHWAY)

#include "base/highway_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/kernels_simd.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

#include <algorithm>

#include "base/prefetch.hpp"
#include "mesh/pair_kernels.hpp"
#include "mesh/plane_filter.hpp"
#include "mesh/shared_vertices.hpp"

#if HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3_DL || \
    HWY_TARGET == HWY_NEON

HWY_BEFORE_NAMESPACE();
namespace throng::mesh::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::ScalableTag<double>;
using V = hn::Vec<D>;
constexpr std::size_t lanes = hn::MaxLanes(D());

struct V3 {
  V x, y, z;
};

HWY_INLINE V3 minus(const V3& a, const V3& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

// Points of a vector of pairs: coordinate k of point p of pair i at [p][k][i].
struct Points {
  static constexpr int most = 6;
  alignas(64) double at[most][3][lanes];

  template <class Real>
  HWY_INLINE void set(int point, std::size_t lane, const MeshArrays& mesh, std::uint32_t vertex) {
    const Real* const from = mesh.coordinates<Real>(vertex);
    for (int k = 0; k < 3; ++k) at[point][k][lane] = static_cast<double>(from[k]);
  }
  HWY_INLINE V3 get(int point) const {
    const D d;
    return {hn::Load(d, at[point][0]), hn::Load(d, at[point][1]), hn::Load(d, at[point][2])};
  }
};

// The lanes in which a filter has a certain sign, a bit each.
struct Sides {
  unsigned positive, negative;
};

template <class M>
HWY_INLINE unsigned bits_of(M mask) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(D(), mask, bits);
  return bits[0] & ((1u << lanes) - 1);
}

// PlaneFilter, the operations in the same order.
class Plane {
 public:
  HWY_INLINE Plane(const V3& u, const V3& v) {
    const V a = hn::Mul(u.y, v.z), b = hn::Mul(u.z, v.y), c = hn::Mul(u.z, v.x);
    const V d = hn::Mul(u.x, v.z), e = hn::Mul(u.x, v.y), f = hn::Mul(u.y, v.x);
    normal_ = {hn::Sub(a, b), hn::Sub(c, d), hn::Sub(e, f)};
    magnitude_ = {hn::Add(hn::Abs(a), hn::Abs(b)), hn::Add(hn::Abs(c), hn::Abs(d)),
                  hn::Add(hn::Abs(e), hn::Abs(f))};
  }
  HWY_INLINE Sides side(const V3& x) const {
    const D d;
    const V value =
        hn::Add(hn::Add(hn::Mul(normal_.x, x.x), hn::Mul(normal_.y, x.y)), hn::Mul(normal_.z, x.z));
    const V magnitude =
        hn::Add(hn::Add(hn::Mul(magnitude_.x, hn::Abs(x.x)), hn::Mul(magnitude_.y, hn::Abs(x.y))),
                hn::Mul(magnitude_.z, hn::Abs(x.z)));
    const V bound =
        hn::Add(hn::Mul(hn::Set(d, relative_bound), magnitude), hn::Set(d, underflow_bound));
    return {bits_of(hn::Gt(value, bound)), bits_of(hn::Lt(value, hn::Neg(bound)))};
  }

 private:
  V3 normal_, magnitude_;
};

HWY_INLINE int sign(const Sides& sides, std::size_t lane) {
  return static_cast<int>(sides.positive >> lane & 1) -
         static_cast<int>(sides.negative >> lane & 1);
}

// A pair of a part, with the six vertices in the order of SharedVertices.
struct Candidate {
  Pair pair;
  std::uint32_t a[3], b[3];
};

// One part of a block.
struct Part {
  static constexpr std::size_t capacity = 64;
  Candidate candidates[capacity];
  std::size_t count = 0;
};

// The state of one call.
template <class Real>
class Block {
 public:
  Block(const PairInput& input, Pair* pairs) : input_(input), out_(pairs) {}

  // Takes a pair after the pairs written so far have been read.
  HWY_INLINE void take(Pair pair) {
    const Triangle a = input_.a.triangle(pair.first), b = input_.b.triangle(pair.second);
    const unsigned equal = input_.one_mesh ? equal_indices(a, b) : 0;
    const SharedVertices& shared = shared_vertices_table[equal];
    Part& part = parts_[static_cast<int>(shared.sharing)];
    Candidate& c = part.candidates[part.count++];
    const std::uint32_t ids_a[3] = {a.a, a.b, a.c}, ids_b[3] = {b.a, b.b, b.c};
    c.pair = pair;
    for (int i = 0; i < 3; ++i) {
      c.a[i] = ids_a[shared.a[i]];
      c.b[i] = ids_b[shared.b[i]];
      base::prefetch_l2(input_.a.coordinates<Real>(c.a[i]));
      base::prefetch_l2(input_.b.coordinates<Real>(c.b[i]));
    }
    if (part.count == Part::capacity) flush(shared.sharing);
  }

  void flush_all() {
    for (const Sharing s : {Sharing::none, Sharing::vertex, Sharing::edge, Sharing::other})
      flush(s);
  }

  Pair* out() const { return out_; }
  std::uint64_t exact_tests() const { return exact_tests_; }

 private:
  void flush(Sharing sharing) {
    Part& part = parts_[static_cast<int>(sharing)];
    for (std::size_t i = 0; i < part.count; i += lanes) {
      const Candidate* const first = part.candidates + i;
      const std::size_t count = std::min(lanes, part.count - i);
      switch (sharing) {
        case Sharing::none:
          test_meeting(first, count);
          break;
        case Sharing::vertex:
          test_vertex(first, count);
          break;
        case Sharing::edge:
          test_edge(first, count);
          break;
        case Sharing::other:
          decide(first, count, 0, (1u << count) - 1);
          break;
      }
    }
    part.count = 0;
  }

  // Fills the unused lanes with the last pair.
  template <class Set>
  HWY_INLINE void gather(const Candidate* first, std::size_t count, const Set& set) {
    for (std::size_t lane = 0; lane < lanes; ++lane) set(lane, first[std::min(lane, count - 1)]);
  }
  HWY_INLINE void set_a(int point, std::size_t lane, std::uint32_t vertex) {
    points_.set<Real>(point, lane, input_.a, vertex);
  }
  HWY_INLINE void set_b(int point, std::size_t lane, std::uint32_t vertex) {
    points_.set<Real>(point, lane, input_.b, vertex);
  }

  // See decide_beyond_edge().
  HWY_INLINE void test_edge(const Candidate* first, std::size_t count) {
    gather(first, count, [this](std::size_t lane, const Candidate& c) HWY_ATTR {
      for (int i = 0; i < 3; ++i) set_a(i, lane, c.a[i]);
      set_b(3, lane, c.b[2]);
    });
    const V3 p = points_.get(0);
    const Sides side =
        Plane(minus(points_.get(1), p), minus(points_.get(2), p)).side(minus(points_.get(3), p));
    decide(first, count, 0, ~(side.positive | side.negative));
  }

  // See decide_beyond_vertex().
  HWY_INLINE void test_vertex(const Candidate* first, std::size_t count) {
    gather(first, count, [this](std::size_t lane, const Candidate& c) HWY_ATTR {
      for (int i = 0; i < 3; ++i) set_a(i, lane, c.a[i]);
      for (int i = 1; i < 3; ++i) set_b(2 + i, lane, c.b[i]);
    });
    const V3 p = points_.get(0);
    const V3 u1 = minus(points_.get(1), p), u2 = minus(points_.get(2), p);
    const V3 v1 = minus(points_.get(3), p), v2 = minus(points_.get(4), p);
    const Plane a(u1, u2), b(v1, v2);
    const Sides a1 = b.side(u1), a2 = b.side(u2), b1 = a.side(v1), b2 = a.side(v2);
    const unsigned apart = (a1.positive & a2.positive) | (a1.negative & a2.negative) |
                           (b1.positive & b2.positive) | (b1.negative & b2.negative);
    const unsigned certain = (a1.positive | a1.negative) & (a2.positive | a2.negative) &
                             (b1.positive | b1.negative) & (b2.positive | b2.negative);
    const unsigned differ = (a1.positive & b1.negative) | (a1.negative & b1.positive);
    decide(first, count, certain & differ & ~apart, ~(certain | apart));
  }

  // See decide_meeting().
  HWY_INLINE void test_meeting(const Candidate* first, std::size_t count) {
    gather(first, count, [this](std::size_t lane, const Candidate& c) HWY_ATTR {
      for (int i = 0; i < 3; ++i) set_a(i, lane, c.a[i]);
      for (int i = 0; i < 3; ++i) set_b(3 + i, lane, c.b[i]);
    });
    const V3 a0 = points_.get(0), b0 = points_.get(3);
    const V3 u1 = minus(points_.get(1), a0), u2 = minus(points_.get(2), a0);
    const V3 v1 = minus(points_.get(4), b0), v2 = minus(points_.get(5), b0);
    const Plane plane_a(u1, u2), plane_b(v1, v2);
    Sides of_a[3], of_b[3];
    for (int i = 0; i < 3; ++i) {
      of_a[i] = plane_b.side(minus(points_.get(i), b0));
      of_b[i] = plane_a.side(minus(points_.get(3 + i), a0));
    }
    const auto one_side = [](const Sides(&s)[3]) HWY_ATTR {
      return (s[0].positive & s[1].positive & s[2].positive) |
             (s[0].negative & s[1].negative & s[2].negative);
    };
    const auto certain = [](const Sides& s) HWY_ATTR { return s.positive | s.negative; };
    const unsigned apart = one_side(of_a) | one_side(of_b);
    const unsigned all_certain = certain(of_a[0]) & certain(of_a[1]) & certain(of_a[2]) &
                                 certain(of_b[0]) & certain(of_b[1]) & certain(of_b[2]);
    const unsigned used = (1u << count) - 1;
    for (unsigned rest = all_certain & ~apart & used; rest != 0; rest &= rest - 1) {
      const auto lane = static_cast<std::size_t>(hwy::Num0BitsBelowLS1Bit_Nonzero32(rest));
      const int sides_a[3] = {sign(of_a[0], lane), sign(of_a[1], lane), sign(of_a[2], lane)};
      const int sides_b[3] = {sign(of_b[0], lane), sign(of_b[1], lane), sign(of_b[2], lane)};
      const CrossingOrder order = crossing_order(sides_a, sides_b);
      Candidate& c = crossing_[crossing_count_++];
      c.pair = first[lane].pair;
      for (int i = 0; i < 3; ++i) {
        c.a[i] = first[lane].a[order.a[i]];
        c.b[i] = first[lane].b[order.b[i]];
      }
    }
    decide(first, count, 0, ~(all_certain | apart));
    if (crossing_count_ >= lanes) {
      crossing_count_ -= lanes;
      test_crossing(crossing_ + crossing_count_, lanes);
    }
  }

 public:
  // The pairs left over by test_meeting().
  void flush_crossing() {
    if (crossing_count_ != 0) test_crossing(crossing_, crossing_count_);
    crossing_count_ = 0;
  }

 private:
  HWY_INLINE void test_crossing(const Candidate* first, std::size_t count) {
    gather(first, count, [this](std::size_t lane, const Candidate& c) HWY_ATTR {
      for (int i = 0; i < 3; ++i) set_a(i, lane, c.a[i]);
      for (int i = 0; i < 3; ++i) set_b(3 + i, lane, c.b[i]);
    });
    const V3 a0 = points_.get(0);
    const V3 u1 = minus(points_.get(1), a0), u2 = minus(points_.get(2), a0);
    const V3 w0 = minus(points_.get(3), a0), w1 = minus(points_.get(4), a0);
    const V3 w2 = minus(points_.get(5), a0);
    const Sides one = Plane(u1, w0).side(w1), two = Plane(u2, w2).side(w0);
    const unsigned yes = one.negative & two.negative, no = one.positive | two.positive;
    decide(first, count, yes, ~(yes | no));
  }

  // Writes the pairs of `yes`, and those of `unsure` that pass the exact test.
  HWY_INLINE void decide(const Candidate* first, std::size_t count, unsigned yes, unsigned unsure) {
    const unsigned used = (1u << count) - 1;
    for (unsigned rest = yes & used; rest != 0; rest &= rest - 1)
      *out_++ = first[hwy::Num0BitsBelowLS1Bit_Nonzero32(rest)].pair;
    for (unsigned rest = unsure & used; rest != 0; rest &= rest - 1) {
      const Pair pair = first[hwy::Num0BitsBelowLS1Bit_Nonzero32(rest)].pair;
      ++exact_tests_;
      *out_ = pair;
      out_ += exact_test(input_, pair);
    }
  }

  const PairInput& input_;
  Pair* out_;
  std::uint64_t exact_tests_ = 0;
  std::size_t crossing_count_ = 0;
  Points points_;
  Part parts_[4];
  Candidate crossing_[2 * lanes];
};

template <class Real>
std::size_t keep(const PairInput& input, Pair* pairs, std::size_t count,
                 std::uint64_t& exact_tests) {
  Block<Real> block(input, pairs);
  constexpr std::size_t ahead = 16;
  for (std::size_t i = 0; i < count; ++i) {
    const Pair next = pairs[std::min(i + ahead, count - 1)];
    base::prefetch_l2(&input.a.triangle(next.first));
    base::prefetch_l2(&input.b.triangle(next.second));
    block.take(pairs[i]);
  }
  block.flush_all();
  block.flush_crossing();
  exact_tests += block.exact_tests();
  return static_cast<std::size_t>(block.out() - pairs);
}

std::size_t keep_any(const PairInput& input, Pair* pairs, std::size_t count,
                     std::uint64_t& exact_tests) {
  if (input.exact_only) return scalar_pair_kernels.keep(input, pairs, count, exact_tests);
  return input.is_float ? keep<float>(input, pairs, count, exact_tests)
                        : keep<double>(input, pairs, count, exact_tests);
}

const PairKernels& pair_kernels() {
  constexpr Isa isa = HWY_TARGET == HWY_SSE4      ? Isa::sse4
                      : HWY_TARGET == HWY_AVX2    ? Isa::avx2
                      : HWY_TARGET == HWY_AVX3_DL ? Isa::avx512
                                                  : Isa::neon;
  static const PairKernels table = {isa, keep_any};
  return table;
}

}  // namespace throng::mesh::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

#if HWY_ONCE
namespace throng::mesh {

// The processor has the instruction set: grid::find_kernels() has checked it.
const PairKernels* simd_pair_kernels(Isa isa) noexcept {
#if HWY_ARCH_X86
#if HWY_TARGETS & HWY_AVX3_DL
  if (isa == Isa::avx512) return &N_AVX3_DL::pair_kernels();
#endif
#if HWY_TARGETS & HWY_AVX2
  if (isa == Isa::avx2) return &N_AVX2::pair_kernels();
#endif
#if HWY_TARGETS & HWY_SSE4
  if (isa == Isa::sse4) return &N_SSE4::pair_kernels();
#endif
#elif HWY_TARGETS & HWY_NEON
  if (isa == Isa::neon) return &N_NEON::pair_kernels();
#endif
  (void)isa;
  return nullptr;
}

}  // namespace throng::mesh
#endif

#else

#include "mesh/pair_kernels.hpp"
namespace throng::mesh {
const PairKernels* simd_pair_kernels(Isa) noexcept { return nullptr; }
}  // namespace throng::mesh

#endif
