// The C API: the same pairs as the C++ API in every layout, and its errors.
#include <throng/throng.h>

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <throng/version.hpp>

#include "support/aligned_memory.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::tests {
namespace {

using Found = std::vector<Pair>;

class CApi : public testing::Test {
 protected:
  void SetUp() override { throng_options_init(&options_); }
  void TearDown() override { throng_finder_destroy(finder_); }

  throng_finder* finder() {
    options_.order = THRONG_ORDER_CANONICAL;
    if (!finder_) finder_ = throng_finder_create(&options_);
    return finder_;
  }
  Found pairs() {
    size_t count = 0;
    const throng_pair* p = throng_finder_pairs(finder_, &count);
    Found found;
    for (size_t i = 0; i < count; ++i) found.push_back({p[i].first, p[i].second});
    return found;
  }
  std::string message() { return throng_finder_result(finder_)->message; }

  std::vector<Box> boxes_ = snapped_boxes(400, 12, 0.25f, 3);
  throng_boxes view_ =
      throng_boxes_packed(reinterpret_cast<const throng_box*>(boxes_.data()), boxes_.size());
  throng_options options_;
  throng_finder* finder_ = nullptr;
};

TEST_F(CApi, EveryLayoutGivesTheReferencesPairs) {
  const Found want = reference_pairs(boxes_).pairs;
  ASSERT_FALSE(want.empty());
  ASSERT_EQ(throng_find(finder(), &view_, nullptr), THRONG_OK) << message();
  EXPECT_EQ(pairs(), want);
  EXPECT_EQ(throng_finder_result(finder_)->found, want.size());
  EXPECT_STRNE(throng_finder_result(finder_)->plan, "");

  std::vector<float> lower, upper;
  for (const Box& b : boxes_) {
    lower.insert(lower.end(), {b.lower.x, b.lower.y, b.lower.z});
    upper.insert(upper.end(), {b.upper.x, b.upper.y, b.upper.z});
  }
  const throng_boxes split = throng_boxes_split(lower.data(), upper.data(), boxes_.size());
  ASSERT_EQ(throng_find(finder(), &split, nullptr), THRONG_OK) << message();
  EXPECT_EQ(pairs(), want);

  // A stride larger than a box, and without z.
  struct Wide {
    Box box;
    float other[3];
  };
  std::vector<Wide> wide;
  std::vector<Box> flat = boxes_;
  for (const Box& b : boxes_) wide.push_back({b, {9, 9, 9}});
  throng_boxes strided = view_;
  for (int k = 0; k < 6; ++k) strided.corner[k] = &wide[0].box.lower.x + k;
  strided.stride_bytes = sizeof(Wide);
  ASSERT_EQ(throng_find(finder(), &strided, nullptr), THRONG_OK) << message();
  EXPECT_EQ(pairs(), want);
  const auto* const first = reinterpret_cast<const throng_box*>(&wide[0].box);
  strided = throng_boxes_strided(first, wide.size(), sizeof(Wide));
  ASSERT_EQ(throng_find(finder(), &strided, nullptr), THRONG_OK) << message();
  EXPECT_EQ(pairs(), want);
  EXPECT_EQ(throng_boxes_strided(first, 1, 0).stride_bytes, sizeof(throng_box));
  EXPECT_EQ(throng_boxes_strided(nullptr, 0, 36).corner[0], nullptr);
  strided.corner[2] = strided.corner[5] = nullptr;
  for (Box& b : flat) b.lower.z = b.upper.z = 0;
  ASSERT_EQ(throng_find(finder(), &strided, nullptr), THRONG_OK) << message();
  EXPECT_EQ(pairs(), reference_pairs(flat).pairs);
}

TEST_F(CApi, TwoSetsFiltersAndMargin) {
  std::vector<std::int32_t> owners;
  for (std::size_t i = 0; i < boxes_.size(); ++i)
    owners.push_back(static_cast<std::int32_t>(i % 3));
  const std::size_t half = boxes_.size() / 2;
  throng_boxes a = view_, b = view_;
  a.count = half;
  for (const float*& corner : b.corner) corner += 6 * half;
  b.count = boxes_.size() - half;
  Found want;
  for (const bool owned : {false, true}) {
    want.clear();
    for (const Pair p : reference_pairs(boxes_).pairs) {
      if (p.first < half && p.second >= half && !(owned && owners[p.first] == owners[p.second])) {
        want.push_back({p.first, static_cast<std::uint32_t>(p.second - half)});
      }
    }
    if (owned) {
      a.owner = {owners.data(), sizeof(std::int32_t)};
      b.owner = {owners.data() + half, sizeof(std::int32_t)};
    }
    ASSERT_EQ(throng_find(finder(), &a, &b), THRONG_OK) << message();
    EXPECT_EQ(pairs(), want) << owned;
  }
  throng_finder_destroy(finder_);
  finder_ = nullptr;
  options_.margin = std::numeric_limits<float>::infinity();
  EXPECT_EQ(throng_find(finder(), &a, &b), THRONG_BAD_OPTION);
  EXPECT_NE(message().find("margin"), std::string::npos) << message();
}

// Contiguous values if no stride is given.
TEST_F(CApi, FiltersWithoutAStride) {
  std::vector<std::int32_t> world;
  std::vector<std::uint8_t> still;
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    world.push_back(static_cast<std::int32_t>(i % 3));
    still.push_back(i % 2);
  }
  Boxes cpp = boxes_;
  cpp.filters.world = {world.data(), world.size()};
  cpp.filters.is_static = {still.data(), still.size()};
  view_.world.data = world.data();
  view_.is_static.data = still.data();
  ASSERT_EQ(throng_find(finder(), &view_, nullptr), THRONG_OK) << message();
  EXPECT_EQ(pairs(), reference_pairs(cpp).pairs);
}

// A stride of 0, as in zeroed memory, means contiguous boxes, in every layout; no layout repeats
// one box.
TEST_F(CApi, BoxesWithoutAStride) {
  const Found want = reference_pairs(boxes_).pairs;
  std::vector<Box> flat = boxes_;
  for (Box& b : flat) b.lower.z = b.upper.z = 0;
  const Found want_flat = reference_pairs(flat).pairs;
  ASSERT_NE(want.size(), want_flat.size());
  // Rows of `per_row` values, with the coordinates at positions `at`.
  const auto expect = [&](bool is_flat, std::size_t per_row, const std::size_t(&at)[6],
                          std::size_t between) {
    const std::size_t n = boxes_.size();
    std::vector<float> values(n * 6 + 6 * between);
    throng_boxes view{};
    view.count = n;
    for (std::size_t k = 0; k < 6; ++k) {
      if (is_flat && k % 3 == 2) continue;
      view.corner[k] = values.data() + at[k];
      for (std::size_t i = 0; i < n; ++i) values[at[k] + i * per_row] = (&boxes_[i].lower.x)[k];
    }
    ASSERT_EQ(throng_find(finder(), &view, nullptr), THRONG_OK) << message();
    EXPECT_EQ(pairs(), is_flat ? want_flat : want) << per_row;
  };
  const std::size_t n = boxes_.size();
  expect(false, 6, {0, 1, 2, 3, 4, 5}, 0);
  expect(false, 3, {0, 1, 2, 3 * n, 3 * n + 1, 3 * n + 2}, 0);
  expect(false, 3, {0, 1, 2, 3 * n + 1, 3 * n + 2, 3 * n + 3}, 1);
  expect(false, 1, {0, n, 2 * n, 3 * n, 4 * n, 5 * n}, 0);
  expect(true, 4, {0, 1, 9, 2, 3, 9}, 0);
  expect(true, 2, {0, 1, 9, 2 * n, 2 * n + 1, 9}, 0);
  expect(true, 1, {0, n, 9, 2 * n, 3 * n, 9}, 0);
  // Doubles, too.
  std::vector<double> doubles;
  for (const Box& b : boxes_)
    for (int k = 0; k < 6; ++k) doubles.push_back(double{(&b.lower.x)[k]});
  throng_double_boxes packed = throng_double_boxes_packed(doubles.data(), n);
  packed.stride_bytes = 0;
  ASSERT_EQ(throng_find_doubles(finder(), &packed, nullptr), THRONG_OK) << message();
  EXPECT_EQ(pairs(), want);
}

// Zeroed structs mean nothing, or the defaults.
TEST_F(CApi, ZeroedStructs) {
  const throng_boxes none{};
  EXPECT_EQ(throng_find(finder(), &none, nullptr), THRONG_OK);
  EXPECT_EQ(throng_finder_result(finder_)->found, 0u);
  throng_boxes no_corners{};
  no_corners.count = 3;
  EXPECT_EQ(throng_find(finder_, &no_corners, nullptr), THRONG_BAD_BOXES);
  const throng_options options{};
  throng_finder* other = throng_finder_create(&options);
  EXPECT_EQ(throng_find(other, &view_, nullptr), THRONG_BAD_OPTION);
  throng_finder_destroy(other);
}

TEST_F(CApi, InvertedBoxes) {
  std::swap(boxes_[7].lower.y, boxes_[7].upper.y);
  boxes_[7].lower.y += 1;
  EXPECT_EQ(throng_find(finder(), &view_, nullptr), THRONG_OK) << "an empty slot by default";
  EXPECT_EQ(throng_finder_result(finder_)->inactive, 1u);
  for (const int policy : {int{THRONG_INVERTED_REFUSE}, int{THRONG_INVERTED_INACTIVE}, 3}) {
    throng_finder_destroy(finder_);
    finder_ = nullptr;
    options_.inverted = policy;
    const throng_status status = throng_find(finder(), &view_, nullptr);
    const throng_result& r = *throng_finder_result(finder_);
    if (policy == THRONG_INVERTED_INACTIVE) {
      EXPECT_EQ(status, THRONG_OK) << message();
      EXPECT_EQ(r.inactive, 1u);
    } else if (policy == THRONG_INVERTED_REFUSE) {
      EXPECT_EQ(status, THRONG_INVERTED_BOX);
      EXPECT_EQ(r.first_invalid, 7u);
      EXPECT_EQ(r.invalid_count, 1u);
      EXPECT_STREQ(throng_status_text(status), "inverted box");
    } else {
      EXPECT_EQ(status, THRONG_BAD_OPTION);
      EXPECT_NE(message().find("inverted (3)"), std::string::npos) << message();
    }
  }
  const float center[3] = {1, 2, 3}, half[3] = {0.5f, 1, 0};
  const throng_box box = throng_box_from_center(center, half);
  EXPECT_EQ(box.lower[0], 0.5f);
  EXPECT_EQ(box.upper[1], 3);
  EXPECT_EQ(box.lower[2], 3);
}

TEST_F(CApi, Doubles) {
  std::vector<DoubleBox> boxes;
  std::vector<double> lower, upper;
  Random random(4);
  for (const Box& b : boxes_) {
    const float from[6] = {b.lower.x, b.lower.y, b.lower.z, b.upper.x, b.upper.y, b.upper.z};
    double to[6];
    for (int k = 0; k < 6; ++k) {
      to[k] = 1e6 + 0.1 * double{from[k]};
      if (random.one_in(2)) to[k] = std::nextafter(to[k], random.one_in(2) ? 0.0 : 1e9);
    }
    boxes.push_back({{to[0], to[1], to[2]}, {to[3], to[4], to[5]}});
    lower.insert(lower.end(), to, to + 3);
    upper.insert(upper.end(), to + 3, to + 6);
  }
  const Found want = reference_pairs(DoubleBoxes(boxes)).pairs;
  throng_double_boxes packed = throng_double_boxes_packed(&boxes[0].lower.x, boxes.size());
  const throng_double_boxes split =
      throng_double_boxes_split(lower.data(), upper.data(), boxes.size());
  for (const throng_double_boxes& view : {packed, split}) {
    ASSERT_EQ(throng_find_doubles(finder(), &view, nullptr), THRONG_OK) << message();
    EXPECT_EQ(pairs(), want);
  }
  Found out(want.size());
  auto* const as_floats = reinterpret_cast<throng_pair*>(out.data());
  ASSERT_EQ(throng_find_doubles_into(finder_, &packed, nullptr, as_floats, out.size()), THRONG_OK);
  EXPECT_EQ(out, want);
  const Found both = reference_pairs(DoubleBoxes(boxes), DoubleBoxes(boxes)).pairs;
  Found taken;
  const auto take = [](void* to, const throng_pair* p, size_t count) {
    for (size_t i = 0; i < count; ++i)
      static_cast<Found*>(to)->push_back({p[i].first, p[i].second});
    return 1;
  };
  ASSERT_EQ(throng_consume_doubles(finder_, &packed, &split, take, &taken), THRONG_OK);
  EXPECT_EQ(taken, both);
  EXPECT_EQ(throng_find_doubles(finder_, nullptr, nullptr), THRONG_BAD_BOXES);
  packed.stride_bytes = 52;
  EXPECT_EQ(throng_find_doubles(finder_, &packed, nullptr), THRONG_BAD_BOXES);
  EXPECT_NE(message().find("multiple of 8"), std::string::npos) << message();

  const throng_box round = throng_round_outward(&boxes[0].lower.x, &boxes[0].upper.x);
  const Box want_box = round_outward(&boxes[0].lower.x, &boxes[0].upper.x);
  EXPECT_EQ(std::memcmp(&round, &want_box, sizeof round), 0);
}

TEST_F(CApi, CallersBufferAndConsumer) {
  const Found want = reference_pairs(boxes_).pairs;
  std::vector<throng_pair> buffer(want.size());
  EXPECT_EQ(throng_find_into(finder(), &view_, nullptr, buffer.data(), buffer.size() - 1),
            THRONG_BUFFER_TOO_SMALL);
  EXPECT_EQ(throng_finder_result(finder_)->found, want.size());
  EXPECT_EQ(throng_find_into(finder(), &view_, nullptr, buffer.data(), buffer.size()), THRONG_OK);
  EXPECT_EQ(std::memcmp(buffer.data(), want.data(), buffer.size() * sizeof(throng_pair)), 0);

  Found seen;
  const auto take = [](void* context, const throng_pair* p, size_t count) -> int {
    for (size_t i = 0; i < count; ++i) {
      static_cast<Found*>(context)->push_back({p[i].first, p[i].second});
    }
    return 1;
  };
  EXPECT_EQ(throng_consume(finder(), &view_, nullptr, take, &seen), THRONG_OK) << message();
  EXPECT_EQ(seen, want);
  const auto stop = [](void*, const throng_pair*, size_t) -> int { return 0; };
  EXPECT_EQ(throng_consume(finder(), &view_, nullptr, stop, nullptr), THRONG_STOPPED);
}

// All memory and all work go through the caller's functions, without leaks.
TEST_F(CApi, CallersMemoryAndThreads) {
  struct Host {
    std::map<void*, size_t> blocks;
    size_t limit = std::numeric_limits<size_t>::max(), held = 0;
    int runs = 0;
  } host;
  options_.memory_self = options_.run_self = &host;
  options_.allocate = [](void* self, size_t bytes, size_t alignment) -> void* {
    Host& h = *static_cast<Host*>(self);
    if (h.held + bytes > h.limit) return nullptr;
    void* p = allocate_aligned(bytes, alignment);
    h.blocks[p] = bytes;
    h.held += bytes;
    return p;
  };
  options_.deallocate = [](void* self, void* p, size_t bytes, size_t) {
    Host& h = *static_cast<Host*>(self);
    EXPECT_EQ(h.blocks[p], bytes);
    h.blocks.erase(p);
    h.held -= bytes;
    free_aligned(p);
  };
  options_.concurrency = 2;
  options_.run = [](void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
    ++static_cast<Host*>(self)->runs;
    for (unsigned i = 0; i < count; ++i) task(context, i);
  };
  boxes_ = uniform_boxes(20000, 5);
  view_ = throng_boxes_packed(reinterpret_cast<const throng_box*>(boxes_.data()), boxes_.size());
  ASSERT_EQ(throng_find(finder(), &view_, nullptr), THRONG_OK) << message();
  EXPECT_EQ(pairs(), swept_pairs(boxes_).pairs);
  EXPECT_GT(host.held, 0u);
  EXPECT_GT(host.runs, 0);
  throng_finder_destroy(finder_);
  finder_ = nullptr;
  EXPECT_TRUE(host.blocks.empty());
  host.limit = 1000;
  EXPECT_EQ(throng_find(finder(), &view_, nullptr), THRONG_OUT_OF_MEMORY);
  EXPECT_GT(throng_finder_result(finder_)->bytes_needed, 1000u);
}

TEST_F(CApi, BadInputNamesTheFix) {
  EXPECT_EQ(throng_find(finder(), nullptr, nullptr), THRONG_BAD_BOXES);
  EXPECT_NE(message().find("NULL"), std::string::npos);
  boxes_[17].upper.y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(throng_find(finder(), &view_, nullptr), THRONG_NAN_BOX);
  EXPECT_EQ(throng_finder_result(finder_)->first_invalid, 17u);
  EXPECT_NE(message().find("17"), std::string::npos);
  throng_boxes odd = view_;
  odd.stride_bytes = 25;
  EXPECT_EQ(throng_find(finder(), &odd, nullptr), THRONG_BAD_BOXES);
  boxes_[17].upper.y = 0;
  EXPECT_EQ(throng_find(finder(), &view_, nullptr), THRONG_OK) << "usable after";
  EXPECT_EQ(message(), "");

  throng_finder_destroy(finder_);
  finder_ = nullptr;
  options_.algorithm = 7;
  EXPECT_EQ(throng_find(finder(), &view_, nullptr), THRONG_BAD_OPTION);
  EXPECT_NE(message().find("algorithm (7)"), std::string::npos) << message();
  throng_finder_destroy(finder_);
  options_ = {};
  finder_ = nullptr;
  EXPECT_EQ(throng_find(finder(), &view_, nullptr), THRONG_BAD_OPTION);
  EXPECT_NE(message().find("throng_options_init"), std::string::npos) << message();
  throng_finder_destroy(nullptr);
}

// Stopped by the caller's threads after they have begun.
TEST_F(CApi, StopEndsARunningCall) {
  struct Stopper {
    throng_finder* finder = nullptr;
    bool stops = true;
  } stopper;
  options_.run_self = &stopper;
  options_.concurrency = 2;
  options_.run = [](void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
    const Stopper& s = *static_cast<Stopper*>(self);
    if (s.finder) {
      EXPECT_EQ(throng_find_into(s.finder, nullptr, nullptr, nullptr, 0), THRONG_BUSY);
    }
    if (s.stops) throng_finder_stop(s.finder);
    for (unsigned i = 0; i < count; ++i) task(context, i);
  };
  boxes_ = uniform_boxes(20000, 5);
  view_ = throng_boxes_packed(reinterpret_cast<const throng_box*>(boxes_.data()), boxes_.size());
  EXPECT_EQ(throng_finder_memory_bytes(finder()), 0u);
  stopper.finder = finder_;
  ASSERT_EQ(throng_find(finder_, &view_, nullptr), THRONG_OK) << "no option makes it stoppable";
  EXPECT_GT(throng_finder_memory_bytes(finder_), 20000u);
  throng_finder_destroy(finder_);
  finder_ = nullptr;
  options_.stoppable = 1;
  options_.isa = THRONG_ISA_SCALAR;
  throng_finder_stop(finder());  // no call is running
  stopper.finder = finder_;
  EXPECT_EQ(throng_find(finder_, &view_, nullptr), THRONG_STOPPED);
  EXPECT_EQ(throng_finder_result(finder_)->found, 0u);
  stopper.stops = false;
  EXPECT_EQ(throng_find(finder_, &view_, nullptr), THRONG_OK);
  EXPECT_EQ(pairs(), swept_pairs(boxes_).pairs);
  const throng_result& r = *throng_finder_result(finder_);
  EXPECT_EQ(r.backend, THRONG_BACKEND_CPU);
  EXPECT_EQ(r.algorithm, THRONG_ALGORITHM_GRID);
  EXPECT_EQ(r.isa, THRONG_ISA_SCALAR);
  EXPECT_EQ(r.threads, 2u);
  EXPECT_GE(r.visited, boxes_.size());
  throng_finder_destroy(finder_);
  finder_ = nullptr;
  options_.isa = 7;
  EXPECT_EQ(throng_find(finder(), &view_, nullptr), THRONG_BAD_OPTION);
  EXPECT_NE(message().find("isa (7)"), std::string::npos) << message();
}

// A caller that knows only the first fields, and one that knows more than exist.
TEST_F(CApi, OtherVersionsOfTheOptions) {
  EXPECT_EQ(throng_c_version(), static_cast<unsigned>(THRONG_C_VERSION));
  EXPECT_STREQ(throng_version(), THRONG_VERSION);
  EXPECT_STREQ(throng_status_text(THRONG_NAN_BOX), "NaN box");
  struct {
    throng_options known;
    char unknown[64];
  } newer;
  std::memset(static_cast<void*>(&newer), 0xff, sizeof newer);
  throng_options_init_sized(&newer.known, sizeof newer);
  newer.known.order = THRONG_ORDER_CANONICAL;
  finder_ = throng_finder_create(&newer.known);
  EXPECT_EQ(throng_find(finder_, &view_, nullptr), THRONG_OK) << message();
  const Found want = pairs();
  throng_finder_destroy(finder_);

  throng_options older;
  std::memset(static_cast<void*>(&older), 0xff, sizeof older);
  throng_options_init_sized(&older, offsetof(throng_options, threads));
  EXPECT_EQ(older.threads, 0xffffffffu) << "fields that an older caller lacks are not written";
  older.order = THRONG_ORDER_CANONICAL;
  finder_ = throng_finder_create(&older);
  EXPECT_EQ(throng_find(finder_, &view_, nullptr), THRONG_OK) << message();
  EXPECT_EQ(pairs(), want);
  throng_finder_destroy(finder_);

  older.struct_bytes = sizeof older.struct_bytes - 1;  // no version has this size
  finder_ = throng_finder_create(&older);
  EXPECT_EQ(throng_find(finder_, &view_, nullptr), THRONG_BAD_OPTION);
  EXPECT_NE(message(), "");
}

}  // namespace
}  // namespace throng::tests
