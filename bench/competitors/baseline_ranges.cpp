// Baseline grid, ranges: sixteen candidates of a contiguous range at once.
#if defined(__AVX512F__) && defined(__AVX512VL__)
#include <immintrin.h>
#define THRONG_WIDE 1
#endif

#include "baseline_grid.hpp"
#include "competitors.hpp"

namespace throng::bench {
namespace {

class RangeRecords {
 public:
  static constexpr double cells_per_box = 0.5;  // fastest of 0.35 to 2: ranges that fill a vector

  struct Query {
    Box box;
    std::uint32_t id;
  };

  void resize(std::size_t n) {
    loose_.resize(n);
    for (auto& v : v_) v.resize(n + 16);  // a whole vector may be read past the end
    id_.resize(n + 16);
  }
  // Scattered as whole records, then copied to the arrays in order: scattering seven arrays would
  // cost three times as much.
  void prefetch(std::size_t slot) const { __builtin_prefetch(&loose_[slot], 1); }
  void put(std::size_t slot, const Box& b, std::uint32_t id) { loose_[slot] = {b, id, 0}; }
  void arrange(std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (int k = 0; k < 6; ++k) v_[k][i] = corner(loose_[i].box, k);
      id_[i] = loose_[i].id;
    }
  }
  Query query(std::size_t slot) const {
    return {{{v_[0][slot], v_[1][slot], v_[2][slot]}, {v_[3][slot], v_[4][slot], v_[5][slot]}},
            id_[slot]};
  }
  Pair* scan(const Query& q, std::size_t begin, std::size_t end, Pair* out) const {
#if defined(THRONG_WIDE)
    for (std::size_t k = begin; k < end; k += 16) {
      const std::size_t left = end - k;
      __mmask16 m = left >= 16 ? 0xffff : static_cast<__mmask16>((1u << left) - 1);
      for (int a = 0; a < 3; ++a) {
        m = _mm512_mask_cmp_ps_mask(m, _mm512_loadu_ps(&v_[a][k]),
                                    _mm512_set1_ps(corner(q.box, a + 3)), _CMP_LE_OQ);
        m = _mm512_mask_cmp_ps_mask(m, _mm512_loadu_ps(&v_[a + 3][k]),
                                    _mm512_set1_ps(corner(q.box, a)), _CMP_GE_OQ);
      }
      if (m) {
        const __m512i mine = _mm512_set1_epi32(static_cast<int>(q.id));
        const __m512i other = _mm512_maskz_compress_epi32(m, _mm512_loadu_si512(&id_[k]));
        const __m512i low = _mm512_min_epu32(mine, other), high = _mm512_max_epu32(mine, other);
        // Pairs of 64 bits: the first eight, and the others only if there are more.
        const auto pairs = [](__m256i first, __m256i second) {
          return _mm512_or_si512(_mm512_cvtepu32_epi64(first),
                                 _mm512_slli_epi64(_mm512_cvtepu32_epi64(second), 32));
        };
        const int count = __builtin_popcount(m);
        _mm512_storeu_si512(out, pairs(_mm512_castsi512_si256(low), _mm512_castsi512_si256(high)));
        if (count > 8)
          _mm512_storeu_si512(out + 8, pairs(_mm512_extracti64x4_epi64(low, 1),
                                             _mm512_extracti64x4_epi64(high, 1)));
        out += count;
      }
    }
#else
    const float *lx = v_[0].data(), *ly = v_[1].data(), *lz = v_[2].data();
    const float *ux = v_[3].data(), *uy = v_[4].data(), *uz = v_[5].data();
    for (std::size_t k = begin; k < end; k += 16) {
      const std::size_t count = end - k < 16 ? end - k : 16;
      std::uint32_t hit[16];
      for (std::size_t j = 0; j < 16; ++j)  // for the compiler to vectorize
        hit[j] = (lx[k + j] <= q.box.upper.x) & (ux[k + j] >= q.box.lower.x) &
                 (ly[k + j] <= q.box.upper.y) & (uy[k + j] >= q.box.lower.y) &
                 (lz[k + j] <= q.box.upper.z) & (uz[k + j] >= q.box.lower.z);
      for (std::size_t j = 0; j < count; ++j) {
        *out = ordered(q.id, id_[k + j]);
        out += hit[j];
      }
    }
#endif
    return out;
  }

 private:
  struct alignas(32) Record {
    Box box;
    std::uint32_t id, unused;
  };
  std::vector<Record> loose_;
  std::vector<float> v_[6];
  std::vector<std::uint32_t> id_;
};

}  // namespace

MethodInfo baseline_ranges() {
  return {"baseline grid, ranges",
          "counting sort by cell, sixteen candidates of a range at once",
          "",
          Origin::baseline,
          true,
          [](unsigned threads) { return std::make_unique<BaselineGrid<RangeRecords>>(threads); }};
}

}  // namespace throng::bench
