// Yardstick (a): the plain grid, box by box: one comparison of eight floats a candidate box.
#if defined(__AVX__)
#include <immintrin.h>
#endif

#include "plain_grid.hpp"
#include "rivals.hpp"

namespace throng::bench {
namespace {

// A record is lower x, y, z, id, -upper x, y, z, unused: "lower <= upper' and -upper <= -lower'" is
// one comparison with the negated halves of the other, swapped.
class BoxRecords {
 public:
  static constexpr double cells_per_box = 1.4;  // of 0.35 to 2: fewer candidates pay

  struct alignas(32) Record {
    float lower[3];
    std::uint32_t id;
    float minus_upper[3];
    std::uint32_t unused;
  };
  struct Query {
    Box box;
    Record limit;
  };

  void resize(std::size_t n) { records_.resize(n + 4); }  // a turn may read past the end
  void prefetch(std::size_t slot) const { __builtin_prefetch(&records_[slot], 1); }
  void put(std::size_t slot, const Box& b, std::uint32_t id) {
    records_[slot] = {
        {b.lower.x, b.lower.y, b.lower.z}, id, {-b.upper.x, -b.upper.y, -b.upper.z}, 0};
  }
  void arrange(std::size_t, std::size_t) {}
  Query query(std::size_t slot) const {
    const Record& r = records_[slot];
    const float* l = r.lower;
    const float* u = r.minus_upper;
    Query q{{{l[0], l[1], l[2]}, {-u[0], -u[1], -u[2]}},
            {{-u[0], -u[1], -u[2]}, r.id, {-l[0], -l[1], -l[2]}, 0}};
#if defined(__AVX__)
    const __m256 v = _mm256_load_ps(l);
    const __m256 minus = _mm256_xor_ps(_mm256_permute2f128_ps(v, v, 1), _mm256_set1_ps(-0.0f));
    _mm256_store_ps(q.limit.lower, minus);  // overwrites the id, which is told apart below
    q.limit.unused = r.id;
#endif
    return q;
  }
  Pair* scan(const Query& q, std::size_t begin, std::size_t end, Pair* out) const {
    const Record *r = records_.data() + begin, *stop = records_.data() + end;
#if defined(__AVX__)
    const __m256 limit = _mm256_load_ps(q.limit.lower);
    // Four a turn, those past the end told apart by the count: most stretches end after one turn,
    // which a branch predictor learns; one a turn it cannot.
    for (; r < stop; r += 4) {
      for (int k = 0; k < 4; ++k) {
        const __m256 le = _mm256_cmp_ps(_mm256_load_ps(r[k].lower), limit, _CMP_LE_OQ);
        *out = ordered(q.limit.unused, r[k].id);  // always written, kept if it is a hit: no branch
        out += ((_mm256_movemask_ps(le) & 0x77) == 0x77) & (r + k < stop);
      }
    }
#else
    for (; r < stop; ++r) {
      bool hit = true;
      for (int k = 0; k < 3; ++k)
        hit =
            hit & (r->lower[k] <= q.limit.lower[k]) & (r->minus_upper[k] <= q.limit.minus_upper[k]);
      *out = ordered(q.limit.id, r->id);
      out += hit;
    }
#endif
    return out;
  }

 private:
  std::vector<Record> records_;
};

}  // namespace

Entry plain_boxes() {
  return {"plain grid, box by box",
          "counting sort by cell, one 8-wide test a candidate box",
          "",
          Kind::plain,
          true,
          [](unsigned threads) { return std::make_unique<PlainGrid<BoxRecords>>(threads); }};
}

}  // namespace throng::bench
