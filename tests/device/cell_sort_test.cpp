// Sorting boxes by cell gives the same cells and the same report as counting them one by one.
#include "device/cell_sort.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstring>

#include "base/threads.hpp"
#include "device/engine.hpp"
#include "device/host_device.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::device {
namespace {

using tests::Answer;
using tests::BoxList;

// Inputs of more boxes than `above` are sorted.
template <std::uint32_t above>
class Device : public HostDevice {
 public:
  Device() : HostDevice(std::pmr::new_delete_resource(), HostDevice::Run{base::run_tasks}) {
    begin(base::default_executor(), 3);
  }
  static constexpr std::uint32_t sorted_above = above;
  template <class... Args>
  SortedCells sort_cells(const Args&... args) const noexcept {
    ++sorts;
    return HostDevice::sort_cells(args...);
  }
  mutable int sorts = 0;
};
using Always = Device<0>;
using Never = Device<~0u>;

struct ReportNumbers {
  ReportNumbers(const Report& r, bool nan)
      : numbers{r.active,
                r.found,
                r.inactive,
                r.nan_count,
                r.bad_worlds,
                nan ? r.first_nan() : 0u,
                r.bad_worlds ? r.first_bad_world() : 0u} {}
  std::array<std::uint64_t, 7> numbers;
  friend bool operator==(const ReportNumbers&, const ReportNumbers&) = default;
};

// The result of a build.
template <class D>
struct Built {
  explicit Built(const Input& input) : in(input) {
    memory.resize(w.carve<D>(in.count, nullptr) + 256, 0x5a);
    auto base = reinterpret_cast<std::uintptr_t>(memory.data());
    w.carve<D>(in.count, reinterpret_cast<char*>((base + 255) / 256 * 256));
    pipeline.build(in, false, w);
  }
  std::vector<std::uint32_t> starts() const {
    return {w.table, w.table + Workspace::scanned(w.table_cells)};
  }
  std::vector<bool> occupied() const {
    std::vector<bool> flags;
    for (std::size_t k = 0; k < Workspace::occupied_count; ++k) flags.push_back(w.occupied[k] != 0);
    return flags;
  }
  // The ids cell by cell, sorted within each cell. Checks that each stands with its box.
  std::vector<std::uint32_t> ids() const {
    std::vector<std::uint32_t> all;
    for (std::uint64_t k = 0; k < w.report->active; ++k) {
      const Record& r = w.records[k];
      Box box{};
      bool nan;
      EXPECT_TRUE(r.id < in.count && read_box(in, r.id, box, nan));
      const Box stored = r.box();
      EXPECT_EQ(std::memcmp(&box, &stored, sizeof box), 0);
      all.push_back(r.id);
    }
    const std::size_t cells = Workspace::scanned(w.table_cells) - 1;
    for (std::size_t c = 0; c < cells; ++c)
      std::sort(all.begin() + w.table[c], all.begin() + w.table[c + 1]);
    return all;
  }
  Input in;
  D device;
  Pipeline<D> pipeline{device};
  std::vector<char> memory;
  Workspace w;
};

std::vector<Pair> pairs_of(const Boxes& a, const Boxes* b, const Options& options, Result& r) {
  Engine<Always> engine;
  std::vector<Pair> out;
  base::Output output{out.data(), 0,
                      [](void* context, std::size_t count) {
                        auto& v = *static_cast<std::vector<Pair>*>(context);
                        v.resize(count);
                        return v.data();
                      },
                      &out};
  engine.find(a, b, options, 0, &output, nullptr, r);
  EXPECT_EQ(r.found, out.size());
  // Capacity for one pair too few.
  if (r.found > 0 && options.order == Order::any) {
    std::vector<Pair> small(out.size() - 1);
    base::Output fixed{small.data(), small.size(), nullptr, nullptr};
    Result result;
    engine.find(a, b, options, 0, &fixed, nullptr, result);
    EXPECT_EQ(result.status, Status::buffer_too_small);
    EXPECT_EQ(result.found, r.found);
    EXPECT_EQ(result.written, small.size());
  }
  return out;
}

void expect_same(const Boxes& a, const Boxes* b, const Options& options = {}) {
  const Input in = make_input(a, b, options);
  const Built<Always> sorted(in);
  const Built<Never> plain(in);
  const bool nan = plain.w.report->nan_count != 0;
  EXPECT_EQ(ReportNumbers(*sorted.w.report, nan), ReportNumbers(*plain.w.report, nan));
  EXPECT_EQ(sorted.device.sorts, 1);
  EXPECT_EQ(plain.device.sorts, 0);
  EXPECT_TRUE(sorted.starts() == plain.starts());
  EXPECT_TRUE(sorted.occupied() == plain.occupied());
  EXPECT_TRUE(sorted.ids() == plain.ids());
}

void expect_exact(const Boxes& a, const Boxes* b, const Options& options = {}) {
  expect_same(a, b, options);
  const Answer answer =
      b ? tests::reference_pairs(a, *b, options.margin) : tests::reference_pairs(a, options.margin);
  for (const Order order : {Order::any, Order::canonical}) {
    Options o = options;
    o.algorithm = Algorithm::grid;
    o.nan = NanPolicy::inactive;
    o.order = order;
    Result r;
    const std::vector<Pair> got = pairs_of(a, b, o, r);
    EXPECT_TRUE(r.ok());
    EXPECT_EQ(r.inactive, answer.inactive);
    EXPECT_TRUE(order == Order::any || got == answer.pairs);
    EXPECT_TRUE(tests::same_pairs(got, answer.pairs));
  }
}

TEST(CellSort, HardScenes) {
  for (const tests::HardScene& scene : tests::hard_scenes(700)) {
    SCOPED_TRACE(scene.name);
    for (const float margin : {0.0f, 0.3f}) {
      Options options;
      options.margin = margin;
      expect_exact(scene.boxes, nullptr, options);
    }
  }
}

// Some buckets empty; no bucket empty.
TEST(CellSort, AnyNumber) {
  for (const int n : {1, 2, 31, 511, 512, 513, 1023, 1024, 1025, 2047, 2048, 2049, 4100}) {
    SCOPED_TRACE(n);
    expect_exact(tests::uniform_boxes(n, 1), nullptr);
    expect_exact(tests::snapped_boxes(n, 4 + n / 64, 1, 2), nullptr);
  }
  expect_same(tests::uniform_boxes(60000, 3), nullptr);
}

// All boxes in one cell; no active box.
TEST(CellSort, AllAlike) {
  expect_exact(tests::identical_boxes(1500, 1), nullptr);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const BoxList nothing(1200, Box{{nan, 0, 0}, {1, 1, 1}});
  expect_exact(nothing, nullptr);
}

TEST(CellSort, InactiveBoxesAreReportedOnce) {
  BoxList boxes = tests::uniform_boxes(3000, 5);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 100; i < boxes.size(); i += 7) std::swap(boxes[i].lower, boxes[i].upper);
  for (std::size_t i = 411; i < boxes.size(); i += 50) boxes[i].upper.y = nan;
  std::vector<std::int32_t> worlds;
  for (std::size_t i = 0; i < boxes.size(); ++i) worlds.push_back(static_cast<int>(i % 9) - 1);
  expect_exact(boxes, nullptr);
  Boxes view = boxes;
  view.filters.world = {worlds.data(), worlds.size()};
  expect_exact(view, nullptr);
  for (const std::size_t i : {700u, 411u, 2999u}) worlds[i] = -5;
  expect_same(view, nullptr);
  const Built<Always> built(make_input(view, nullptr, {}));
  EXPECT_EQ(built.w.report->bad_worlds, 3u);
  EXPECT_EQ(built.w.report->first_bad_world(), 411u);
  EXPECT_EQ(built.w.report->first_nan(), 411u);
}

TEST(CellSort, TwoSetsFiltersAndWorlds) {
  const BoxList of_a = tests::snapped_boxes(1300, 12, 1, 1), of_b = tests::uniform_boxes(900, 2);
  tests::Random random(3);
  std::vector<std::int32_t> worlds, owners;
  std::vector<std::uint8_t> still;
  std::vector<std::uint32_t> masks;
  Boxes a = of_a, b = of_b;
  for (const int count : {1, 3, 100, 2000000000}) {
    SCOPED_TRACE(count);
    worlds.clear(), owners.clear(), still.clear(), masks.clear();
    for (std::size_t i = 0; i < a.size(); ++i) {
      worlds.push_back(random.between(-1, count - 1));
      owners.push_back(random.between(-1, 5));
      still.push_back(random.below(3) == 0);
      masks.push_back(random.below(7));
    }
    a.filters = b.filters = {};
    a.filters.world = {worlds.data(), worlds.size()};
    expect_exact(a, nullptr);
    b.filters.world = {worlds.data(), b.size()};
    expect_exact(a, &b);
    a.filters.is_static = {still.data(), still.size()};
    a.filters.owner = {owners.data(), owners.size()};
    a.filters.mask = {masks.data(), masks.size()};
    expect_exact(a, nullptr);
    expect_exact(a, &b);
    expect_exact(b, &a);
  }
}

// Rows scattered over the table.
TEST(CellSort, HashedGrids) {
  BoxList boxes;
  std::vector<std::int32_t> worlds;
  tests::Random random(4);
  for (int cluster = 0; cluster < 50; ++cluster) {
    const Vec3 at = random.point(-5000, 5000);
    for (int k = 0; k < 70; ++k) {
      const Vec3 in = random.point(0, 6);
      boxes.push_back(tests::cube(at.x + in.x, at.y + in.y, at.z + in.z, 1));
      worlds.push_back(k % 4 - 1);
    }
  }
  expect_exact(boxes, nullptr);
  EXPECT_TRUE(Built<Always>(make_input(boxes, nullptr, {})).w.grid->hashed);
  Boxes view = boxes;
  view.filters.world = {worlds.data(), worlds.size()};
  expect_exact(view, nullptr);
  EXPECT_TRUE(Built<Always>(make_input(view, nullptr, {})).w.grid->hashed);
}

// The fewest passes of eight bits; buckets that fit a block's memory; every cell in a bucket; boxes
// that take no part after all cells.
TEST(CellSort, BucketsSuitTheTable) {
  for (const std::uint64_t cells :
       {2ull, 3ull, 1024ull, 1025ull, 2048ull, 9217ull, 1ull << 18, (1ull << 22) - 16385,
        (1ull << 22) - 16384, (1ull << 22) - 16383, 1ull << 22, (1ull << 22) + 1, 22509217ull,
        225009217ull, 1ull << 30, (1ull << 30) + 2, 4050009217ull}) {
    SCOPED_TRACE(cells);
    const Buckets b = Buckets::of(cells);
    EXPECT_EQ(b.last, cells - 1);
    EXPECT_GE(b.bits, 10);
    EXPECT_LE(b.bits, Buckets::max_bits);
    EXPECT_EQ(b.bucket_of(0), 0u);
    EXPECT_EQ(b.bucket_of(b.last), b.count() - 1);
    EXPECT_EQ((std::uint64_t{b.bucket_of(b.last)} << b.bits) + b.within(b.last), b.last);
    EXPECT_EQ(b.bucket_of(b.inactive_cell()), b.count());
    ASSERT_GT(b.sort_end_bit(), b.bits);
    ASSERT_LE(b.sort_end_bit(), 32);
    EXPECT_EQ(std::uint64_t{b.inactive_cell()} >> b.sort_end_bit(), 0u);
    const int passes = (b.sort_end_bit() - b.bits + 7) / 8;
    const int bits_before = Buckets::max_bits + 8 * (passes - 1);
    EXPECT_TRUE(passes == 1 || cells - 1 + Buckets::max_cells >= std::uint64_t{1} << bits_before)
        << passes << " passes";
  }
}

}  // namespace
}  // namespace throng::device
