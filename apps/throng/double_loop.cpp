#include "apps/throng/double_loop.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>

namespace throng::cli {
namespace {

// One copy of the inner loop per instruction set, chosen when the program starts. Not under
// sanitizers, which are not initialized when the choice runs.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define THRONG_CLI_SANITIZED 1
#endif
#endif
#if defined(__has_attribute) && defined(__x86_64__) && defined(__gnu_linux__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) &&           \
    !defined(THRONG_CLI_SANITIZED)
#if __has_attribute(target_clones)
#define THRONG_CLI_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#endif
#endif
#ifndef THRONG_CLI_CLONES
#define THRONG_CLI_CLONES
#endif

constexpr std::size_t block = 64;         // boxes tested at once
constexpr std::size_t tile = 16 * block;  // boxes that stay in the L1 cache for many rows
constexpr std::size_t rows_per_block = 32;

// One set's boxes as columns, grown by the margin. An inactive box is all NaN: every comparison
// with it is false, even against infinite bounds. Padded with such boxes to whole blocks.
struct Columns {
  std::size_t count = 0;
  std::uint64_t inactive = 0;
  std::vector<float> lower[3], upper[3];
  std::vector<std::int32_t> world;
};

// x moved by `m`, rounded away from the box. The sum of two floats can need more than a double's 53
// bits; the rounding error gives the direction where the sum looks exact as a float.
float beyond(float x, float m, float direction) {
  const double a = x, b = direction * static_cast<double>(m), sum = a + b;
  if (!std::isfinite(sum)) return x;
  const double part = sum - a, lost = (a - (sum - part)) + (b - part);
  const float near = static_cast<float>(sum);
  const double error = direction * (sum - static_cast<double>(near)), rest = direction * lost;
  const bool needs_step = error > 0 || (error == 0 && rest > 0);
  return needs_step ? std::nextafter(near, direction * std::numeric_limits<float>::infinity())
                    : near;
}

Columns columns_of(const Boxes& boxes, float margin) {
  Columns c;
  c.count = boxes.size();
  const std::size_t padded = (c.count + block - 1) / block * block;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int axis = 0; axis < 3; ++axis) {
    c.lower[axis].assign(padded, nan);
    c.upper[axis].assign(padded, nan);
  }
  c.world.assign(padded, 0);
  for (std::size_t i = 0; i < c.count; ++i) {
    bool active = true;
    for (int axis = 0; axis < 3; ++axis) {
      active = active && boxes.corner(i, axis) <= boxes.corner(i, axis + 3);
    }
    if (boxes.filters.world) c.world[i] = boxes.filters.world[i];
    if (!active) {
      ++c.inactive;
      continue;
    }
    for (int axis = 0; axis < 3; ++axis) {
      c.lower[axis][i] = beyond(boxes.corner(i, axis), margin, -1.0f);
      c.upper[axis][i] = beyond(boxes.corner(i, axis + 3), margin, 1.0f);
    }
  }
  return c;
}

struct Row {
  float lower[3], upper[3];
  std::int32_t world;
};

// Whether the row's box overlaps any box of a block. Mostly not, so nearly all time is spent here.
THRONG_CLI_CLONES
bool any_in_block(const Columns& c, std::size_t start, const Row& r) {
  const float *lx = c.lower[0].data() + start, *ux = c.upper[0].data() + start;
  const float *ly = c.lower[1].data() + start, *uy = c.upper[1].data() + start;
  const float *lz = c.lower[2].data() + start, *uz = c.upper[2].data() + start;
  const float rlx = r.lower[0], rly = r.lower[1], rlz = r.lower[2];
  const float rux = r.upper[0], ruy = r.upper[1], ruz = r.upper[2];
  unsigned any = 0;
  for (std::size_t k = 0; k < block; ++k) {
    any |= static_cast<unsigned>(lx[k] <= rux) & static_cast<unsigned>(rlx <= ux[k]) &
           static_cast<unsigned>(ly[k] <= ruy) & static_cast<unsigned>(rly <= uy[k]) &
           static_cast<unsigned>(lz[k] <= ruz) & static_cast<unsigned>(rlz <= uz[k]);
  }
  return any != 0;
}

// The same, with the world filter: worlds may separate most boxes at one place.
THRONG_CLI_CLONES
bool any_in_block_of_world(const Columns& c, std::size_t start, const Row& r) {
  const float *lx = c.lower[0].data() + start, *ux = c.upper[0].data() + start;
  const float *ly = c.lower[1].data() + start, *uy = c.upper[1].data() + start;
  const std::int32_t* world = c.world.data() + start;
  const float rlx = r.lower[0], rly = r.lower[1], rux = r.upper[0], ruy = r.upper[1];
  const std::int32_t own = r.world;
  unsigned any = 0;
  for (std::size_t k = 0; k < block; ++k) {
    any |= static_cast<unsigned>(lx[k] <= rux) & static_cast<unsigned>(rlx <= ux[k]) &
           static_cast<unsigned>(ly[k] <= ruy) & static_cast<unsigned>(rly <= uy[k]) &
           (static_cast<unsigned>(world[k] == own) | static_cast<unsigned>(world[k] == -1) |
            static_cast<unsigned>(own == -1));
  }
  return any != 0;
}

bool meets(const Columns& c, std::size_t j, const Row& r) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!(c.lower[axis][j] <= r.upper[axis] && r.lower[axis] <= c.upper[axis][j])) return false;
  }
  return true;
}

// Whether all given filters, of one set or both, allow the pair.
bool allowed(const Filters& a, std::size_t i, const Filters& b, std::size_t j) {
  const std::uint32_t all = 0xffffffffu;
  const auto bits = [&](const Strided<std::uint32_t>& s, std::size_t k) { return s ? s[k] : all; };
  if ((a.group || a.mask || b.group || b.mask) &&
      ((bits(a.group, i) & bits(b.mask, j)) == 0 || (bits(b.group, j) & bits(a.mask, i)) == 0)) {
    return false;
  }
  if (a.owner && b.owner && a.owner[i] == b.owner[j] && a.owner[i] != -1) return false;
  if (a.world && b.world && a.world[i] != b.world[j] && a.world[i] != -1 && b.world[j] != -1) {
    return false;
  }
  return !(a.is_static && b.is_static && a.is_static[i] != 0 && b.is_static[j] != 0);
}

class Loop {
 public:
  Loop(const Boxes& a, const Boxes* b, float margin)
      : a_(a), b_(b ? *b : a), two_sets_(b != nullptr), rows_(columns_of(a, margin)) {
    if (two_sets_) columns_ = columns_of(*b, margin);
    by_world_ = a_.filters.world && b_.filters.world;
    found_.resize((a.size() + rows_per_block - 1) / rows_per_block);
  }

  LoopResult run(const std::function<void(std::size_t)>& progress) {
    const unsigned helpers = std::max(1u, std::thread::hardware_concurrency()) - 1;
    std::vector<std::thread> threads;
    for (unsigned t = 0; t < helpers; ++t) threads.emplace_back([this] { work(nullptr); });
    work(&progress);
    for (std::thread& thread : threads) thread.join();
    if (failure_) std::rethrow_exception(failure_);
    LoopResult result;
    result.inactive = rows_.inactive + columns_.inactive;
    std::size_t total = 0;
    for (const auto& part : found_) total += part.size();
    result.pairs.reserve(total);
    for (auto& part : found_) {
      result.pairs.insert(result.pairs.end(), part.begin(), part.end());
      std::vector<Pair>().swap(part);
    }
    return result;
  }

 private:
  void work(const std::function<void(std::size_t)>* progress) {
    try {
      for (std::size_t part = next_++; part < found_.size(); part = next_++) {
        rows(part);
        if (progress) (*progress)(std::min((part + 1) * rows_per_block, rows_.count));
      }
    } catch (...) {
      next_ = found_.size();
      const std::lock_guard<std::mutex> lock(mutex_);
      failure_ = std::current_exception();
    }
  }

  void rows(std::size_t part) {
    const Columns& c = two_sets_ ? columns_ : rows_;
    const std::size_t first = part * rows_per_block;
    const std::size_t last = std::min(first + rows_per_block, rows_.count);
    const std::size_t begin = two_sets_ ? 0 : first / block * block;
    std::vector<Pair>& out = found_[part];
    for (std::size_t t = begin; t < c.lower[0].size(); t += tile) {
      const std::size_t end = std::min(t + tile, c.lower[0].size());
      for (std::size_t i = first; i < last; ++i) {
        const Row row{{rows_.lower[0][i], rows_.lower[1][i], rows_.lower[2][i]},
                      {rows_.upper[0][i], rows_.upper[1][i], rows_.upper[2][i]},
                      rows_.world[i]};
        for (std::size_t s = t; s < end; s += block) {
          if (by_world_ ? any_in_block_of_world(c, s, row) : any_in_block(c, s, row)) {
            collect_overlaps(c, s, i, row, out);
          }
        }
      }
    }
    std::sort(out.begin(), out.end());
  }

  void collect_overlaps(const Columns& c, std::size_t start, std::size_t i, const Row& row,
                        std::vector<Pair>& out) const {
    for (std::size_t j = start; j < std::min(start + block, c.count); ++j) {
      if ((two_sets_ || j > i) && meets(c, j, row) && allowed(a_.filters, i, b_.filters, j)) {
        out.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)});
      }
    }
  }

  const Boxes a_, b_;
  const bool two_sets_;
  bool by_world_ = false;
  Columns rows_, columns_;
  std::vector<std::vector<Pair>> found_;  // by part, so that the concatenation is sorted
  std::atomic<std::size_t> next_{0};
  std::mutex mutex_;
  std::exception_ptr failure_;
};

}  // namespace

LoopResult double_loop(const Boxes& a, const Boxes* b, float margin,
                       const std::function<void(std::size_t)>& progress) {
  return Loop(a, b, margin).run(progress);
}

}  // namespace throng::cli
