// The vector tests of candidate pairs, compiled by Highway once per instruction set.
//
// A block of candidates is split by how their triangles share vertices. Each part is tested one
// vector of pairs at a time, by the filters of mesh/plane_filter.hpp: the first one is short and
// decides most, the others take what is left. Floats are tested in floats. What a filter of floats
// cannot decide, one of doubles does, and the exact rule the rest.
#if defined(THRONG_HIGHWAY)

#include "base/highway_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/kernels_simd.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

#include <algorithm>
#include <type_traits>

#include "base/prefetch.hpp"
#include "mesh/pair_kernels.hpp"
#include "mesh/plane_filter.hpp"
#include "mesh/shared_vertices.hpp"

#if HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3_DL || \
    HWY_TARGET == HWY_NEON

HWY_BEFORE_NAMESPACE();
namespace throng::mesh::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class Real>
using Vec = hn::Vec<hn::ScalableTag<Real>>;

template <class V>
struct V3 {
  V x, y, z;
};

template <class V>
HWY_INLINE V3<V> plus(const V3<V>& a, const V3<V>& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
template <class V>
HWY_INLINE V3<V> minus(const V3<V>& a, const V3<V>& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
template <class V>
HWY_INLINE V dot(const V3<V>& a, const V3<V>& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}
template <class V>
HWY_INLINE V largest_magnitude(const V3<V>& a) {
  return hn::Max(hn::Max(hn::Abs(a.x), hn::Abs(a.y)), hn::Abs(a.z));
}
template <class V>
HWY_INLINE V3<V> cross(const V3<V>& a, const V3<V>& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)),
          hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}

// Lanes that are certainly on one side of a plane.
template <class V>
struct Sides {
  hn::Mask<hn::DFromV<V>> positive, negative;
};

// PlaneFilter, the operations in the same order.
template <class Real>
class Plane {
 public:
  using V = Vec<Real>;
  HWY_INLINE Plane(const V3<V>& u, const V3<V>& v)
      : Plane(hn::Mul(u.y, v.z), hn::Mul(u.z, v.y), hn::Mul(u.z, v.x), hn::Mul(u.x, v.z),
              hn::Mul(u.x, v.y), hn::Mul(u.y, v.x)) {}
  HWY_INLINE Sides<V> side(const V3<V>& x) const {
    using B = Bounds<Real>;
    const hn::ScalableTag<Real> d;
    const V value = dot(normal_, x);
    const V magnitude = dot(magnitude_, V3<V>{hn::Abs(x.x), hn::Abs(x.y), hn::Abs(x.z)});
    const V bound =
        hn::Add(hn::Mul(hn::Set(d, side_error * B::unit), magnitude), hn::Set(d, B::triple));
    return {hn::Gt(value, bound), hn::Lt(value, hn::Neg(bound))};
  }

 private:
  // Of the products of the normal's coordinates. Initializes in place: GCC 12 for ARM cannot inline
  // V3's default constructor.
  HWY_INLINE Plane(V a, V b, V c, V d, V e, V f)
      : normal_{hn::Sub(a, b), hn::Sub(c, d), hn::Sub(e, f)},
        magnitude_{hn::Add(hn::Abs(a), hn::Abs(b)), hn::Add(hn::Abs(c), hn::Abs(d)),
                   hn::Add(hn::Abs(e), hn::Abs(f))} {}

  V3<V> normal_, magnitude_;
};

// A pair, and its vertices: a's, then b's, in the order of SharedVertices.
struct Candidate {
  Pair pair;
  std::uint32_t vertices[6];
};

// Three floats; the fourth lane is 0 or one of them.
constexpr auto load_three = [](const float* from) HWY_ATTR {
  const hn::Simd<float, 4, 0> d;
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3_DL
  return hn::MaskedLoad(hn::FirstN(d, 3), d, from);
#else
  const hn::Half<decltype(d)> half;
  return hn::Combine(d, hn::Set(half, from[2]), hn::LoadU(half, from));
#endif
};

// Candidates that wait for the same test.
struct Part {
  static constexpr std::size_t capacity = 64;
  alignas(64) Candidate candidates[capacity + 1];  // vectors of 16 bytes are stored
  std::size_t count = 0;
};

// A block of candidates, which are numbered vertices and coordinates of type Real.
template <class Real, bool one_mesh>
class Block {
 public:
  Block(const PairInput& input, Pair* pairs) : input_(input), out_(pairs) {}

  HWY_INLINE void prefetch(Pair pair) const {
    base::prefetch_l2(&input_.a.triangle(pair.first));
    base::prefetch_l2(&input_.b.triangle(pair.second));
  }
  // Takes a pair after the pairs written so far have been read.
  template <bool prefetch_vertices>
  HWY_INLINE void take(Pair pair, std::uint64_t& counts) {
    const auto* const a = reinterpret_cast<const std::uint32_t*>(
        input_.a.triangles + pair.first * input_.a.triangle_stride_bytes);
    const auto* const b = reinterpret_cast<const std::uint32_t*>(
        input_.b.triangles + pair.second * input_.b.triangle_stride_bytes);
    for (int i = 0; prefetch_vertices && i < 3; ++i) {
      base::prefetch_l1(input_.a.coordinates<Real>(a[i]));
      base::prefetch_l1(input_.b.coordinates<Real>(b[i]));
    }
    const std::size_t queue = place(pair, a, b, counts);
    if ((counts >> (16 * queue) & 0xffff) == Part::capacity) [[unlikely]] {
      test(queue, Part::capacity);
      counts &= ~(std::uint64_t{0xffff} << (16 * queue));
    }
  }

  // Tests all that wait, in an order in which no test adds to an earlier queue.
  void finish(std::uint64_t counts) {
    for (std::size_t queue = 0; queue < 4; ++queue) test(queue, counts >> (16 * queue) & 0xffff);
    for (std::size_t queue = 4; queue < queues; ++queue) flush(queue);
  }

  Pair* out() const { return out_; }
  std::uint64_t exact_tests() const { return exact_tests_; }

 private:
  using D = hn::ScalableTag<Real>;
  using V = Vec<Real>;
  using B = Bounds<Real>;
  static constexpr std::size_t lanes = hn::MaxLanes(D());
  static_assert(Part::capacity % lanes == 0);

  // The first four are in the order of Sharing.
  enum Queue : std::size_t { near, at_vertex, at_edge, other, meeting, beyond_vertex, crossing };
  static constexpr std::size_t queues = 7;

  HWY_INLINE Candidate& next_place(std::size_t queue, std::uint64_t& counts) {
    const std::size_t i = counts >> (16 * queue) & 0xffff;
    counts += std::uint64_t{1} << (16 * queue);
    return parts_[queue].candidates[i];
  }

  // Adds a pair to the queue of its first test, which is returned. `a`, `b`: the vertices of its
  // triangles.
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3_DL
  HWY_INLINE std::size_t place(Pair pair, const std::uint32_t* a, const std::uint32_t* b,
                               std::uint64_t& counts) {
    const hn::Simd<std::uint32_t, 4, 0> d;
    const auto three = hn::FirstN(d, 3);
    const auto of_a = hn::MaskedLoad(three, d, a), of_b = hn::MaskedLoad(three, d, b);
    unsigned equal = 0;  // see equal_indices()
    if constexpr (one_mesh) {
      const auto row = [&](const std::uint32_t* i) HWY_ATTR {
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, hn::Eq(of_b, hn::Set(d, *i)), bits);
        return bits[0] & 7u;
      };
      equal = row(a) | row(a + 1) << 3 | row(a + 2) << 6;
    }
    const VertexOrder& order = vertex_orders[equal];
    const std::size_t queue = order.a[12];
    Candidate& c = next_place(queue, counts);
    const hn::Simd<std::uint8_t, 16, 0> bytes;
    const auto ordered = [&](auto ids, const std::uint8_t* by) HWY_ATTR {
      return hn::TableLookupBytes(hn::BitCast(bytes, ids), hn::Load(bytes, by));
    };
    c.pair = pair;
    // Each writes four bytes too many, which are written again.
    auto* const to = reinterpret_cast<std::uint8_t*>(c.vertices);
    hn::StoreU(ordered(of_a, order.a), bytes, to);
    hn::StoreU(ordered(of_b, order.b), bytes, to + 12);
    return queue;
  }
#else
  HWY_INLINE std::size_t place(Pair pair, const std::uint32_t* a, const std::uint32_t* b,
                               std::uint64_t& counts) {
    const unsigned equal = one_mesh ? equal_indices({a[0], a[1], a[2]}, {b[0], b[1], b[2]}) : 0;
    const SharedVertices& shared = shared_vertices_table[equal];
    const auto queue = static_cast<std::size_t>(shared.sharing);
    Candidate& c = next_place(queue, counts);
    c.pair = pair;
    for (int i = 0; i < 3; ++i) {
      c.vertices[i] = a[shared.a[i]];
      c.vertices[3 + i] = b[shared.b[i]];
    }
    return queue;
  }
#endif

  // A bit per lane.
  template <class M>
  HWY_INLINE static unsigned bits_of(M mask) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(D(), mask, bits);
    return (bits[0] | static_cast<unsigned>(bits[1]) << 8) & used(lanes);
  }
  HWY_INLINE static unsigned used(std::size_t count) { return (1u << count) - 1; }
  HWY_INLINE static std::size_t lowest(unsigned bits) {
    return hwy::Num0BitsBelowLS1Bit_Nonzero32(bits);
  }

  // The coordinates of vertex `i` of candidates c[0 .. lanes-1]. Vectors are transposed in
  // registers: a load of what was stored in parts waits for the stores.
  HWY_INLINE V3<V> load(const Candidate* c, int i) const {
    const MeshArrays& mesh = i < 3 ? input_.a : input_.b;
    const auto at = [&](std::size_t lane)
                        HWY_ATTR { return mesh.coordinates<Real>(c[lane].vertices[i]); };
    if constexpr (std::is_same_v<Real, float>) {
      const V r0 = blocks<lanes>(at, 0, load_three), r1 = blocks<lanes>(at, 1, load_three);
      const V r2 = blocks<lanes>(at, 2, load_three), r3 = blocks<lanes>(at, 3, load_three);
      const hn::Repartition<double, D> wide;
      const auto xy01 = hn::BitCast(wide, hn::InterleaveLower(D(), r0, r1));
      const auto xy23 = hn::BitCast(wide, hn::InterleaveLower(D(), r2, r3));
      const auto z01 = hn::BitCast(wide, hn::InterleaveUpper(D(), r0, r1));
      const auto z23 = hn::BitCast(wide, hn::InterleaveUpper(D(), r2, r3));
      return {hn::BitCast(D(), hn::InterleaveLower(wide, xy01, xy23)),
              hn::BitCast(D(), hn::InterleaveUpper(wide, xy01, xy23)),
              hn::BitCast(D(), hn::InterleaveLower(wide, z01, z23))};
    } else {
      const V xy0 = blocks<lanes>(at, 0, first_two), xy1 = blocks<lanes>(at, 1, first_two);
      const V yz0 = blocks<lanes>(at, 0, last_two), yz1 = blocks<lanes>(at, 1, last_two);
      return {hn::InterleaveLower(D(), xy0, xy1), hn::InterleaveUpper(D(), xy0, xy1),
              hn::InterleaveUpper(D(), yz0, yz1)};
    }
  }

  using BlockTag = hn::Simd<Real, 16 / sizeof(Real), 0>;
  // Lane `lane` in the lowest block, the one four further (of floats) in the next, and so on.
  template <std::size_t count, class At, class Load>
  HWY_INLINE static auto blocks(const At& at, std::size_t lane, const Load& load_block) {
    if constexpr (count == hn::MaxLanes(BlockTag())) {
      return load_block(at(lane));
    } else {
      return hn::Combine(hn::Simd<Real, count, 0>(),
                         blocks<count / 2>(at, lane + count / 2, load_block),
                         blocks<count / 2>(at, lane, load_block));
    }
  }
  static constexpr auto first_two = [](const Real* from)
                                        HWY_ATTR { return hn::LoadU(BlockTag(), from); };
  static constexpr auto last_two = [](const Real* from)
                                       HWY_ATTR { return hn::LoadU(BlockTag(), from + 1); };

  HWY_INLINE void flush(std::size_t queue) {
    const std::size_t count = parts_[queue].count;
    parts_[queue].count = 0;
    test(queue, count);
  }

  HWY_NOINLINE void test(std::size_t queue, std::size_t count) {
    Candidate* const candidates = parts_[queue].candidates;
    if (count == 0) return;
    // Unused lanes repeat the last pair.
    for (std::size_t i = count; i % lanes != 0; ++i) candidates[i] = candidates[count - 1];
    for (std::size_t i = 0; i < count; i += lanes) {
      const unsigned bits = used(std::min(lanes, count - i));
      switch (queue) {
        case near:
          test_near(candidates + i, bits);
          break;
        case at_vertex:
          test_at_vertex(candidates + i, bits);
          break;
        case at_edge:
          test_at_edge(candidates + i, bits);
          break;
        case meeting:
          test_meeting(candidates + i, bits);
          break;
        case beyond_vertex:
          test_beyond_vertex(candidates + i, bits);
          break;
        case crossing:
          test_crossing(candidates + i, bits);
          break;
        default:
          decide_singly(candidates + i, bits);
      }
    }
  }

  // Moves candidates to another queue.
  HWY_INLINE void pass_on(const Candidate* c, unsigned bits, Queue queue) {
    Part& to = parts_[queue];
    for (; bits != 0; bits &= bits - 1) {
      to.candidates[to.count++] = c[lowest(bits)];
      if (to.count == Part::capacity) flush(queue);
    }
  }

  // See apart_at_edge() and decide_beyond_edge().
  HWY_INLINE void test_at_edge(const Candidate* c, unsigned bits) {
    const D d;
    const V3<V> p = load(c, 0);
    const V3<V> e = minus(load(c, 1), p), u = minus(load(c, 2), p);
    const V3<V> v = minus(load(c, 5), p);
    const V most = hn::Max(largest_magnitude(u), largest_magnitude(v));
    const V bound =
        hn::Add(hn::Mul(hn::Set(d, cross_error * B::unit), hn::Mul(largest_magnitude(e), most)),
                hn::Set(d, B::product));
    const V3<V> n = cross(e, u), m = cross(v, e);
    // How far both are from 0 on the same side.
    const auto same = [](V x, V y)
                          HWY_ATTR { return hn::Max(hn::Min(x, y), hn::Neg(hn::Max(x, y))); };
    const V farthest = hn::Max(hn::Max(same(n.x, m.x), same(n.y, m.y)), same(n.z, m.z));
    bits &= ~bits_of(hn::Gt(farthest, bound));
    if (bits == 0) return;
    const Sides<V> side = Plane<Real>(e, u).side(v);
    decide_singly(c, bits & ~bits_of(hn::Or(side.positive, side.negative)));
  }

  // See apart_at_vertex().
  HWY_INLINE void test_at_vertex(const Candidate* c, unsigned bits) {
    const D d;
    const V3<V> p = load(c, 0);
    const V3<V> u1 = minus(load(c, 1), p), u2 = minus(load(c, 2), p);
    const V3<V> v1 = minus(load(c, 4), p), v2 = minus(load(c, 5), p);
    const V3<V> w = minus(plus(u1, u2), plus(v1, v2));
    const V most = hn::Max(hn::Max(largest_magnitude(u1), largest_magnitude(u2)),
                           hn::Max(largest_magnitude(v1), largest_magnitude(v2)));
    const V bound =
        hn::Add(hn::Mul(hn::Set(d, dot_error * B::unit), hn::Mul(largest_magnitude(w), most)),
                hn::Set(d, B::product));
    const V least =
        hn::Min(hn::Min(dot(w, u1), dot(w, u2)), hn::Neg(hn::Max(dot(w, v1), dot(w, v2))));
    pass_on(c, bits & ~bits_of(hn::Gt(least, bound)), beyond_vertex);
  }

  // See decide_beyond_vertex().
  HWY_INLINE void test_beyond_vertex(const Candidate* c, unsigned bits) {
    const V3<V> p = load(c, 0);
    const V3<V> u1 = minus(load(c, 1), p), u2 = minus(load(c, 2), p);
    const V3<V> v1 = minus(load(c, 4), p), v2 = minus(load(c, 5), p);
    const Plane<Real> a(u1, u2), b(v1, v2);
    const Sides<V> a1 = b.side(u1), a2 = b.side(u2), b1 = a.side(v1), b2 = a.side(v2);
    const auto apart =
        hn::Or(hn::Or(hn::And(a1.positive, a2.positive), hn::And(a1.negative, a2.negative)),
               hn::Or(hn::And(b1.positive, b2.positive), hn::And(b1.negative, b2.negative)));
    bits &= ~bits_of(apart);
    const auto differ =
        hn::Or(hn::And(a1.positive, b1.negative), hn::And(a1.negative, b1.positive));
    const unsigned certain = bits & bits_of(hn::And(hn::And(certain_of(a1), certain_of(a2)),
                                                    hn::And(certain_of(b1), certain_of(b2))));
    write(c, certain & bits_of(differ));
    decide_singly(c, bits & ~certain);
  }

  HWY_INLINE static auto certain_of(const Sides<V>& side) {
    return hn::Or(side.positive, side.negative);
  }

  // See apart_across().
  HWY_INLINE void test_near(const Candidate* c, unsigned bits) {
    const D d;
    const V3<V> p = load(c, 0);
    const V3<V> u1 = minus(load(c, 1), p), u2 = minus(load(c, 2), p);
    const V3<V> v0 = minus(load(c, 3), p), v1 = minus(load(c, 4), p);
    const V3<V> v2 = minus(load(c, 5), p);
    const V3<V> w = minus(plus(u1, u2), plus(plus(v0, v1), v2));
    const V most = hn::Max(
        hn::Max(largest_magnitude(u1), largest_magnitude(u2)),
        hn::Max(hn::Max(largest_magnitude(v0), largest_magnitude(v1)), largest_magnitude(v2)));
    const V bound =
        hn::Add(hn::Mul(hn::Set(d, two_dots_error * B::unit), hn::Mul(largest_magnitude(w), most)),
                hn::Set(d, B::product));
    const V least_a = hn::Min(hn::Min(dot(w, u1), dot(w, u2)), hn::Zero(d));
    const V most_b = hn::Max(hn::Max(dot(w, v0), dot(w, v1)), dot(w, v2));
    pass_on(c, bits & ~bits_of(hn::Gt(hn::Sub(least_a, most_b), bound)), meeting);
  }

  // See decide_meeting().
  HWY_INLINE void test_meeting(const Candidate* c, unsigned bits) {
    const V3<V> a0 = load(c, 0), a1 = load(c, 1), a2 = load(c, 2);
    const V3<V> b0 = load(c, 3), b1 = load(c, 4), b2 = load(c, 5);
    const Plane<Real> plane_a(minus(a1, a0), minus(a2, a0)), plane_b(minus(b1, b0), minus(b2, b0));
    const Sides<V> of_a[3] = {plane_b.side(minus(a0, b0)), plane_b.side(minus(a1, b0)),
                              plane_b.side(minus(a2, b0))};
    const Sides<V> of_b[3] = {plane_a.side(minus(b0, a0)), plane_a.side(minus(b1, a0)),
                              plane_a.side(minus(b2, a0))};
    const auto one_side = [](const Sides<V>(&s)[3]) HWY_ATTR {
      return hn::Or(hn::And(hn::And(s[0].positive, s[1].positive), s[2].positive),
                    hn::And(hn::And(s[0].negative, s[1].negative), s[2].negative));
    };
    const auto certain = [](const Sides<V>(&s)[3]) HWY_ATTR {
      return hn::And(hn::And(certain_of(s[0]), certain_of(s[1])), certain_of(s[2]));
    };
    bits &= ~bits_of(hn::Or(one_side(of_a), one_side(of_b)));
    if (bits == 0) return;
    const unsigned all_certain = bits & bits_of(hn::And(certain(of_a), certain(of_b)));
    decide_singly(c, bits & ~all_certain);
    if (all_certain == 0) return;
    unsigned positive_a[3], positive_b[3];
    for (int i = 0; i < 3; ++i) {
      positive_a[i] = bits_of(of_a[i].positive);
      positive_b[i] = bits_of(of_b[i].positive);
    }
    const auto signs = [](const unsigned(&positive)[3], std::size_t lane, int(&to)[3]) HWY_ATTR {
      for (int i = 0; i < 3; ++i) to[i] = 2 * static_cast<int>(positive[i] >> lane & 1) - 1;
    };
    Part& to = parts_[crossing];
    for (unsigned rest = all_certain; rest != 0; rest &= rest - 1) {
      const std::size_t lane = lowest(rest);
      int sides_a[3], sides_b[3];
      signs(positive_a, lane, sides_a);
      signs(positive_b, lane, sides_b);
      const CrossingOrder order = crossing_order(sides_a, sides_b);
      Candidate& ordered = to.candidates[to.count++];
      ordered.pair = c[lane].pair;
      for (int i = 0; i < 3; ++i) {
        ordered.vertices[i] = c[lane].vertices[order.a[i]];
        ordered.vertices[3 + i] = c[lane].vertices[3 + order.b[i]];
      }
      if (to.count == Part::capacity) flush(crossing);
    }
  }

  HWY_INLINE void test_crossing(const Candidate* c, unsigned bits) {
    const V3<V> a0 = load(c, 0);
    const V3<V> u1 = minus(load(c, 1), a0), u2 = minus(load(c, 2), a0);
    const V3<V> w0 = minus(load(c, 3), a0), w1 = minus(load(c, 4), a0);
    const V3<V> w2 = minus(load(c, 5), a0);
    const Sides<V> one = Plane<Real>(u1, w0).side(w1), two = Plane<Real>(u2, w2).side(w0);
    const unsigned yes = bits & bits_of(hn::And(one.negative, two.negative));
    const unsigned no = bits_of(hn::Or(one.positive, two.positive));
    write(c, yes);
    decide_singly(c, bits & ~(yes | no));
  }

  HWY_INLINE void write(const Candidate* c, unsigned bits) {
    for (; bits != 0; bits &= bits - 1) *out_++ = c[lowest(bits)].pair;
  }

  // By the filter of doubles, then by the exact rule.
  HWY_INLINE void decide_singly(const Candidate* c, unsigned bits) {
    for (; bits != 0; bits &= bits - 1) {
      const Pair pair = c[lowest(bits)].pair;
      *out_ = pair;
      out_ += decide_pair(input_, pair, exact_tests_);
    }
  }

  const PairInput& input_;
  Pair* out_;
  std::uint64_t exact_tests_ = 0;
  Part parts_[queues];
};

// Whether the triangles of pairs are far from one another in memory, by a sample. The caches then
// need prefetches, which cost up to a tenth where triangles that are near in space are near in
// memory.
bool are_scattered(const Pair* pairs, std::size_t count) {
  constexpr std::size_t samples = 16;
  constexpr std::uint32_t near = 8192;
  std::size_t far = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    const Pair pair = pairs[i * count / samples];
    far += pair.first - pair.second + near > 2 * near;
  }
  return far > samples / 2;
}

template <class Real, bool one_mesh>
std::size_t keep(const PairInput& input, Pair* pairs, std::size_t count,
                 std::uint64_t& exact_tests) {
  Block<Real, one_mesh> block(input, pairs);
  std::uint64_t counts = 0;
  if (are_scattered(pairs, count)) {
    constexpr std::size_t ahead = 16;
    for (std::size_t i = 0; i < count; ++i) {
      block.prefetch(pairs[std::min(i + ahead, count - 1)]);
      block.template take<true>(pairs[i], counts);
    }
  } else {
    for (std::size_t i = 0; i < count; ++i) block.template take<false>(pairs[i], counts);
  }
  block.finish(counts);
  exact_tests += block.exact_tests();
  return static_cast<std::size_t>(block.out() - pairs);
}

std::size_t keep_any(const PairInput& input, Pair* pairs, std::size_t count,
                     std::uint64_t& exact_tests) {
  if (input.exact_only || (input.is_float && input.large_floats))
    return scalar_pair_kernels.keep(input, pairs, count, exact_tests);
  if (input.is_float) {
    return input.one_mesh ? keep<float, true>(input, pairs, count, exact_tests)
                          : keep<float, false>(input, pairs, count, exact_tests);
  }
  return input.one_mesh ? keep<double, true>(input, pairs, count, exact_tests)
                        : keep<double, false>(input, pairs, count, exact_tests);
}

bool write_boxes(const MeshArrays& mesh, std::size_t vertices, std::size_t begin, std::size_t end,
                 Box* out, Box& bounds) {
  const hn::Simd<float, 4, 0> d;
  const auto infinity = hn::Inf(d);
  auto least = infinity, most = hn::Neg(infinity), invalid = hn::Zero(d);
  float numbers[4];
  for (std::size_t i = begin; i < end; ++i) {
    const Triangle& t = mesh.triangle(static_cast<std::uint32_t>(i));
    if (std::max({t.a, t.b, t.c}) >= vertices) [[unlikely]]
      return false;
    const auto a = load_three(mesh.coordinates<float>(t.a));
    const auto b = load_three(mesh.coordinates<float>(t.b));
    const auto c = load_three(mesh.coordinates<float>(t.c));
    const auto lower = hn::Min(hn::Min(a, b), c), upper = hn::Max(hn::Max(a, b), c);
    least = hn::Min(least, lower);
    most = hn::Max(most, upper);
    // Zero times infinity or NaN is NaN.
    invalid = hn::Add(invalid, hn::Mul(hn::Add(hn::Add(a, b), c), hn::Zero(d)));
    // A vector has one number too many: that of `lower` is written again, that of `upper` may be
    // of a box of another task.
    auto* const to = reinterpret_cast<float*>(out + i);
    hn::StoreU(lower, d, to);
    if (i + 1 < end) [[likely]] {
      hn::StoreU(upper, d, to + 3);
    } else {
      hn::StoreU(upper, d, numbers);
      std::copy_n(numbers, 3, to + 3);
    }
  }
  hn::StoreU(invalid, d, numbers);
  if (!(numbers[0] + numbers[1] + numbers[2] == 0)) return false;
  hn::StoreU(least, d, numbers);
  bounds.lower = {numbers[0], numbers[1], numbers[2]};
  hn::StoreU(most, d, numbers);
  bounds.upper = {numbers[0], numbers[1], numbers[2]};
  return true;
}

const PairKernels& pair_kernels() {
  constexpr Isa isa = HWY_TARGET == HWY_SSE4      ? Isa::sse4
                      : HWY_TARGET == HWY_AVX2    ? Isa::avx2
                      : HWY_TARGET == HWY_AVX3_DL ? Isa::avx512
                                                  : Isa::neon;
  static const PairKernels table = {isa, keep_any, write_boxes};
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
