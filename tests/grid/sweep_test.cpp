// The sweep alone, on strips made by hand: every kernel reports exactly the pairs that a double
// loop over the same quantized boxes and masks finds, and puts ties apart.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>
#include <vector>

#include "base/quantize.hpp"
#include "grid/recursion_scratch.hpp"
#include "grid/sweep/kernel_table.hpp"
#include "support/configs.hpp"
#include "support/random.hpp"

namespace throng::grid {
namespace {

// Keeps what a kernel writes.
class Collected final : public PairOutput {
 public:
  Collected() {
    flush();
    flush_ties();
  }
  void flush() override { take(confirmed_, pairs, cursor, limit); }
  void flush_ties() override { take(tied_, ties, tie_cursor, tie_limit); }

  std::vector<Pair> pairs, ties;

 private:
  static constexpr std::size_t room = 32;
  using Space = Pair[room + slack];
  static void take(Space& space, std::vector<Pair>& to, Pair*& at, Pair*& end) {
    if (at) to.insert(to.end(), space, at);
    at = space;
    end = space + room;
  }
  Space confirmed_, tied_;
};

// A strip with one bucket per coordinate, and its storage.
struct TestStrip {
  explicit TestStrip(std::vector<Record> boxes, bool with_filters)
      : storage(memory), records(std::move(boxes)) {
    std::sort(records.begin(), records.end(),
              [](const Record& a, const Record& b) { return a.lower[0] < b.lower[0]; });
    strip.count = static_cast<std::uint32_t>(records.size());
    strip.bucket_count = base::steps_per_column;
    std::vector<std::uint32_t> ends(base::steps_per_column, 0);
    for (const Record& r : records) ++ends[r.lower[0]];
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    bucket_ends = ends;
    strip.bucket_end = bucket_ends.data();
    strip.record = {storage.order, strip.count};
    for (std::uint32_t i = 0; i < strip.count; ++i) strip.record[i] = &records[i];
    std::fill_n(strip.record.data() + strip.count, Strip::record_padding, &records[0]);
    storage.assign_storage(strip, with_filters);
  }

  base::Memory memory{std::pmr::new_delete_resource(), 0};
  StripStorage storage;
  std::vector<Record> records;
  std::vector<std::uint32_t> bucket_ends;
  Strip strip;
};

std::vector<Record> random_records(std::uint32_t count, std::uint32_t first_id, std::uint32_t range,
                                   std::uint32_t extent, tests::Random& random) {
  std::vector<Record> records(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const auto at = static_cast<std::uint32_t>(random.unit() * static_cast<float>(range));
      const auto size = static_cast<std::uint32_t>(random.unit() * static_cast<float>(extent));
      // Now and then a box starts in an earlier column.
      records[i].lower[k] = static_cast<std::uint16_t>(random.one_in(8) ? 0 : at + 1);
      records[i].upper[k] =
          static_cast<std::uint16_t>(std::min<std::uint32_t>(at + 1 + size, base::max_quantized));
    }
    records[i].id = first_id + i;
  }
  return records;
}

using Sorted = std::multiset<std::pair<std::uint32_t, std::uint32_t>>;
Sorted sorted(const std::vector<Pair>& pairs) {
  Sorted all;
  for (const Pair& p : pairs) all.insert({p.first, p.second});
  return all;
}

struct Answer {
  Sorted pairs, ties;
};
Answer double_loop(const Strip& a, const Strip& b, bool self) {
  Answer answer;
  for (std::uint32_t i = 0; i < a.count; ++i) {
    for (std::uint32_t j = self ? i + 1 : 0; j < b.count; ++j) {
      const QuantizedBox x = a.box(i), y = b.box(j);
      bool overlap = true, tie = false;
      for (int k = 0; k < 3; ++k) {
        overlap = overlap && x.lower[k] <= y.upper[k] && y.lower[k] <= x.upper[k];
        tie = tie || x.lower[k] == y.upper[k] || y.lower[k] == x.upper[k];
      }
      if (!overlap || a.query_mask[i].rejects(b.target_mask[j])) continue;
      (tie ? answer.ties : answer.pairs)
          .insert({std::min(a.id[i], b.id[j]), std::max(a.id[i], b.id[j])});
    }
  }
  return answer;
}

// Masks of two filter classes that may not pair with each other.
void add_filters(Strip& strip) {
  for (std::uint32_t i = 0; i < strip.count; ++i) {
    const RejectMask mask = strip.target_mask[i], bit = RejectMask::of_filter(strip.id[i] % 2);
    strip.query_mask[i] = mask | RejectMask::of_filter(1 - strip.id[i] % 2);
    strip.target_mask[i] = mask | bit;
  }
}

void expect_same(const Collected& got, const Answer& want) {
  EXPECT_EQ(sorted(got.pairs), want.pairs);
  EXPECT_EQ(sorted(got.ties), want.ties);
}

TEST(Sweep, OfOneStripFindsWhatADoubleLoopFinds) {
  for (const Isa isa : tests::supported_isas()) {
    const Kernels& kernels = *find_kernels(isa);
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      SCOPED_TRACE(std::string(to_string(isa)) + ", seed " + std::to_string(seed));
      tests::Random random(seed);
      const bool filtered = seed % 3 == 0;
      const std::uint32_t count = seed < 8 ? static_cast<std::uint32_t>(seed) + 1 : 300;
      // Few different coordinates: many ties. Long boxes: windows longer than a block.
      const std::uint32_t range = seed % 4 == 1 ? 6 : 20000, extent = seed % 2 ? 200 : 20000;
      TestStrip boxes(random_records(count, 5, range, extent, random), filtered);
      kernels.transpose(boxes.strip);
      if (filtered) add_filters(boxes.strip);
      Collected got;
      kernels.sweep({&boxes.strip, &boxes.strip, nullptr, Orientation::unordered}, got);
      got.flush();
      got.flush_ties();
      expect_same(got, double_loop(boxes.strip, boxes.strip, true));
    }
  }
}

TEST(Sweep, OfTwoStripsFindsWhatADoubleLoopFinds) {
  for (const Isa isa : tests::supported_isas()) {
    const Kernels& kernels = *find_kernels(isa);
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      SCOPED_TRACE(std::string(to_string(isa)) + ", seed " + std::to_string(seed));
      tests::Random random(seed);
      const std::uint32_t range = seed % 4 == 1 ? 6 : 20000;
      TestStrip queries(random_records(270, 0, range, 3000, random), false);
      TestStrip targets(random_records(150, 1000, range, 3000, random), false);
      kernels.transpose(queries.strip);
      kernels.transpose(targets.strip);
      // Every query from the first target on: no bucket is skipped.
      const std::vector<std::uint32_t> start(queries.strip.count, 0);
      Collected got;
      kernels.sweep({&queries.strip, &targets.strip, start.data(), Orientation::query_first}, got);
      got.flush();
      got.flush_ties();
      expect_same(got, double_loop(queries.strip, targets.strip, false));
    }
  }
}

// The rule by which each pair is reported once, and the layout of masks.
TEST(RejectMask, OwnerRuleSetsOneBitPerAxis) {
  Record r{{{7, 7, 7}, {9, 9, 9}}, 1};
  EXPECT_TRUE(OwnerRule::mask(r).is_empty());
  RejectMask of_axis[3];
  for (int k = 0; k < 3; ++k) {
    Record earlier = r;
    earlier.lower[k] = 0;
    of_axis[k] = OwnerRule::mask(earlier);
    EXPECT_TRUE(of_axis[k].rejects(of_axis[k]));
    for (int j = 0; j < k; ++j) EXPECT_FALSE(of_axis[k].rejects(of_axis[j]));
  }
  const RejectMask all = of_axis[0] | of_axis[1] | of_axis[2];
  RejectMask outer = all;
  for (unsigned level = 1; level < RejectMask::max_levels; ++level) {
    outer = outer.nested(false);
    EXPECT_FALSE(outer.is_empty());
    EXPECT_FALSE(outer.rejects(all)) << level;
  }
  EXPECT_FALSE(RejectMask::of_set(false).rejects(RejectMask::of_set(true) | all));
  for (unsigned bit = 0; bit < RejectMask::filter_bits; ++bit) {
    const RejectMask filter = RejectMask::of_filter(bit);
    EXPECT_FALSE(filter.rejects(all | RejectMask::of_set(false) | RejectMask::of_set(true)));
    EXPECT_TRUE(filter.nested(true).is_empty());
    EXPECT_TRUE(filter.axes_only(true).is_empty());
  }
}

}  // namespace
}  // namespace throng::grid
