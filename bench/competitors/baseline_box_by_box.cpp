// Baseline grid, box by box: one comparison of eight floats per candidate box.
#if defined(__AVX__)
#include <immintrin.h>
#endif

#include "baseline_grid.hpp"
#include "competitors.hpp"

namespace throng::bench {
namespace {

// A record is lower x, y, z, id, -upper x, y, z, unused. The test "lower <= upper' and
// -upper <= -lower'" is then one comparison with the other record, halves swapped and negated.
class BoxRecords {
 public:
  static constexpr double cells_per_box = 1.4;  // fastest of 0.35 to 2: fewer candidates

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

  void resize(std::size_t n) { records_.resize(n + 4); }  // scan() may read past the end
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
    _mm256_store_ps(q.limit.lower, minus);  // overwrites the id: restored below
    q.limit.unused = r.id;
#endif
    return q;
  }
  Pair* scan(const Query& q, std::size_t begin, std::size_t end, Pair* out) const {
    const Record *r = records_.data() + begin, *stop = records_.data() + end;
#if defined(__AVX__)
    const __m256 limit = _mm256_load_ps(q.limit.lower);
    // Four per iteration; the count masks those past the end. Most ranges end after one
    // iteration, which a branch predictor learns. One box per iteration is not predictable.
    for (; r < stop; r += 4) {
      for (int k = 0; k < 4; ++k) {
        const __m256 le = _mm256_cmp_ps(_mm256_load_ps(r[k].lower), limit, _CMP_LE_OQ);
        *out = ordered(q.limit.unused, r[k].id);  // always written, kept on a hit: no branch
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

MethodInfo baseline_box_by_box() {
  return {"baseline grid, box by box",
          "counting sort by cell, one 8-wide test per candidate box",
          "",
          Origin::baseline,
          true,
          [](unsigned threads) { return std::make_unique<BaselineGrid<BoxRecords>>(threads); }};
}

}  // namespace throng::bench
