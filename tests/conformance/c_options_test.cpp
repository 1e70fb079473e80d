// Each option of the C API has the effect that throng.h documents, on each kind of handle that it
// applies to; and each status has a name.
#include <throng/throng.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"
#include "support/sanitized.hpp"

namespace throng::tests {
namespace {

// A caller's memory and threads, which record what was used.
struct Host {
  std::map<void*, size_t> blocks;
  size_t held = 0, peak = 0, allocations = 0, limit = std::numeric_limits<size_t>::max();
  unsigned runs = 0, most_tasks = 0;
  std::function<void()> before_tasks;

  static void* allocate(void* self, size_t bytes, size_t alignment) {
    Host& h = *static_cast<Host*>(self);
    if (h.held + bytes > h.limit) return nullptr;
    void* const p = allocate_aligned(bytes, alignment);
    h.blocks[p] = bytes;
    h.held += bytes;
    h.peak = std::max(h.peak, h.held);
    ++h.allocations;
    return p;
  }
  static void deallocate(void* self, void* p, size_t bytes, size_t) {
    Host& h = *static_cast<Host*>(self);
    EXPECT_EQ(h.blocks[p], bytes);
    h.blocks.erase(p);
    h.held -= bytes;
    free_aligned(p);
  }
  static void run(void* self, unsigned count, void (*task)(void*, unsigned), void* context) {
    Host& h = *static_cast<Host*>(self);
    ++h.runs;
    h.most_tasks = std::max(h.most_tasks, count);
    if (h.before_tasks) h.before_tasks();
    for (unsigned i = 0; i < count; ++i) task(context, i);
  }
  void give_memory(throng_options& o) {
    o.allocate = allocate;
    o.deallocate = deallocate;
    o.memory_self = this;
  }
  void give_threads(throng_options& o, unsigned concurrency) {
    o.run = run;
    o.concurrency = concurrency;
    o.run_self = this;
  }
};

throng_options defaults() {
  throng_options o;
  throng_options_init(&o);
  return o;
}

// A new option makes this fail to compile: add a test for it here.
[[maybe_unused]] void options_are_those_below(const throng_options& o) {
  const auto& [struct_bytes, algorithm, order, backend, nan, margin, threads, memory_cap_bytes,
               concurrency, run, run_self, allocate, deallocate, memory_self, isa, stoppable,
               inverted] = o;
  (void)struct_bytes, (void)algorithm, (void)order, (void)backend, (void)nan, (void)margin;
  (void)threads, (void)memory_cap_bytes, (void)concurrency, (void)run, (void)run_self;
  (void)allocate, (void)deallocate, (void)memory_self, (void)isa, (void)stoppable, (void)inverted;
}

throng_boxes view_of(const BoxList& boxes) {
  return throng_boxes_packed(reinterpret_cast<const throng_box*>(boxes.data()), boxes.size());
}

// The observable results of one finder call.
struct Seen {
  throng_status status;
  throng_result result;
  std::string message;
  std::vector<Pair> pairs;
};
Seen find(const throng_options& options, const BoxList& boxes) {
  throng_finder* const finder = throng_finder_create(&options);
  const throng_boxes view = view_of(boxes);
  Seen seen{throng_find(finder, &view, nullptr), *throng_finder_result(finder), "", {}};
  seen.message = seen.result.message;
  size_t count = 0;
  const throng_pair* const pairs = throng_finder_pairs(finder, &count);
  for (size_t i = 0; i < count; ++i) seen.pairs.push_back({pairs[i].first, pairs[i].second});
  throng_finder_destroy(finder);
  return seen;
}
// With a consumer that detects overlapping calls.
Seen consume(const throng_options& options, const BoxList& boxes) {
  throng_finder* const finder = throng_finder_create(&options);
  const throng_boxes view = view_of(boxes);
  Seen seen{};
  struct Taken {
    std::vector<Pair> pairs;
    std::atomic<int> inside{0}, overlapped{0};
  } taken;
  const auto take = [](void* context, const throng_pair* pairs, size_t count) {
    Taken& t = *static_cast<Taken*>(context);
    t.overlapped += t.inside++ != 0;
    for (size_t i = 0; i < count; ++i) t.pairs.push_back({pairs[i].first, pairs[i].second});
    --t.inside;
    return 1;
  };
  seen.status = throng_consume(finder, &view, nullptr, take, &taken);
  seen.result = *throng_finder_result(finder);
  seen.message = seen.result.message;
  seen.pairs = taken.pairs;
  EXPECT_EQ(taken.overlapped, 0);
  throng_finder_destroy(finder);
  return seen;
}

class COptions : public testing::Test {
 protected:
  const BoxList boxes_ = uniform_boxes(8000, 5);
  const Answer answer_ = swept_pairs(boxes_);
};

TEST_F(COptions, Algorithm) {
  throng_options o = defaults();
  EXPECT_EQ(find(o, boxes_).result.algorithm, THRONG_ALGORITHM_GRID);
  for (const int algorithm : {THRONG_ALGORITHM_ALL_PAIRS, THRONG_ALGORITHM_GRID}) {
    o.algorithm = algorithm;
    const Seen seen = find(o, boxes_);
    ASSERT_EQ(seen.status, THRONG_OK) << seen.message;
    EXPECT_EQ(seen.result.algorithm, algorithm);
    EXPECT_TRUE(same_pairs(seen.pairs, answer_.pairs));
    const std::uint64_t all = 8000ull * 7999 / 2;
    if (algorithm == THRONG_ALGORITHM_ALL_PAIRS)
      EXPECT_GE(seen.result.comparisons, all);
    else
      EXPECT_LT(seen.result.comparisons, all / 10);
  }
}

TEST_F(COptions, Order) {
  throng_options o = defaults();
  o.algorithm = THRONG_ALGORITHM_GRID;
  o.threads = 1;
  const Seen any = find(o, boxes_);
  EXPECT_FALSE(std::is_sorted(any.pairs.begin(), any.pairs.end())) << "the default sorts";
  EXPECT_TRUE(same_pairs(any.pairs, answer_.pairs));
  o.order = THRONG_ORDER_CANONICAL;
  EXPECT_EQ(find(o, boxes_).pairs, answer_.pairs);
  EXPECT_EQ(consume(o, boxes_).pairs, answer_.pairs);
}

TEST_F(COptions, Backend) {
  throng_options o = defaults();
  for (const int backend : {THRONG_BACKEND_CPU, THRONG_BACKEND_EMULATED, THRONG_BACKEND_CUDA}) {
    o.backend = backend;
    const Seen seen = find(o, boxes_);
    if (backend == THRONG_BACKEND_CUDA && !cuda::available().ok()) {
      EXPECT_EQ(seen.status, THRONG_NO_DEVICE);
      EXPECT_NE(seen.message, "");
      continue;
    }
    ASSERT_EQ(seen.status, THRONG_OK) << seen.message;
    EXPECT_EQ(seen.result.backend, backend);
    EXPECT_TRUE(same_pairs(seen.pairs, answer_.pairs));
  }
}

TEST_F(COptions, Nan) {
  BoxList boxes = boxes_;
  boxes[17].lower.z = boxes[4000].upper.x = std::numeric_limits<float>::quiet_NaN();
  throng_options o = defaults();
  const Seen refused = find(o, boxes);
  EXPECT_EQ(refused.status, THRONG_NAN_BOX);
  EXPECT_EQ(refused.result.first_invalid, 17u);
  EXPECT_EQ(refused.result.invalid_count, 2u);
  EXPECT_EQ(refused.result.found, 0u);
  o.nan = THRONG_NAN_INACTIVE;
  const Seen taken = find(o, boxes);
  ASSERT_EQ(taken.status, THRONG_OK) << taken.message;
  EXPECT_EQ(taken.result.inactive, 2u);
  EXPECT_TRUE(same_pairs(taken.pairs, swept_pairs(boxes).pairs));
}

TEST_F(COptions, Inverted) {
  BoxList boxes = boxes_;
  std::swap(boxes[17].lower.z, boxes[17].upper.z);
  std::swap(boxes[4000].lower.x, boxes[4000].upper.x);
  throng_options o = defaults();
  o.inverted = THRONG_INVERTED_REFUSE;
  const Seen refused = find(o, boxes);
  EXPECT_EQ(refused.status, THRONG_INVERTED_BOX);
  EXPECT_EQ(refused.result.first_invalid, 17u);
  EXPECT_EQ(refused.result.invalid_count, 2u);
  EXPECT_EQ(refused.result.found, 0u);
  for (const int allowed : {THRONG_INVERTED_AUTOMATIC, THRONG_INVERTED_INACTIVE}) {
    o.inverted = allowed;
    const Seen taken = find(o, boxes);
    ASSERT_EQ(taken.status, THRONG_OK) << taken.message;
    EXPECT_EQ(taken.result.inactive, 2u);
    EXPECT_TRUE(same_pairs(taken.pairs, swept_pairs(boxes).pairs));
  }
}

TEST_F(COptions, Margin) {
  const BoxList boxes = uniform_boxes(2000, 6);
  throng_options o = defaults();
  const std::vector<Pair> plain = reference_pairs(boxes).pairs;
  for (const float margin : {0.0f, 0.25f, 3.0f}) {
    o.margin = margin;
    const std::vector<Pair> want = reference_pairs(boxes, margin).pairs;
    EXPECT_EQ(want.size() > plain.size(), margin > 0);
    EXPECT_TRUE(same_pairs(find(o, boxes).pairs, want)) << margin;
  }
  for (const float wrong : {-1.0f, infinity, std::numeric_limits<float>::quiet_NaN()}) {
    o.margin = wrong;
    EXPECT_EQ(find(o, boxes).status, THRONG_BAD_OPTION) << wrong;
  }
}

TEST_F(COptions, ThreadsAndExecutor) {
  for (const unsigned threads : {0u, 1u, 2u, 3u, 7u}) {
    for (const int order : {THRONG_ORDER_ANY, THRONG_ORDER_CANONICAL}) {
      Host host;
      throng_options o = defaults();
      host.give_threads(o, 5);
      o.threads = threads;
      o.order = order;
      const unsigned want = threads == 0 ? 5 : threads;
      const Seen seen = find(o, boxes_);
      ASSERT_EQ(seen.status, THRONG_OK) << seen.message;
      EXPECT_EQ(seen.result.threads, want);
      EXPECT_EQ(host.most_tasks, want == 1 ? 0 : want) << "tasks run at once";
      EXPECT_TRUE(same_pairs(seen.pairs, answer_.pairs));
      EXPECT_TRUE(same_pairs(consume(o, boxes_).pairs, answer_.pairs));
    }
  }
  // The default executor also runs no more tasks than that.
  throng_options o = defaults();
  o.threads = 1;
  EXPECT_EQ(find(o, boxes_).result.threads, 1u);
  o.threads = 3;
  EXPECT_EQ(find(o, boxes_).result.threads, 3u);
}

TEST_F(COptions, MemoryCap) {
  for (const int order : {THRONG_ORDER_ANY, THRONG_ORDER_CANONICAL}) {
    for (const unsigned threads : {1u, 2u}) {
      throng_options o = defaults();
      o.order = order;
      o.threads = threads;
      o.memory_cap_bytes = 1000;
      EXPECT_EQ(find(o, boxes_).status, THRONG_OK) << "it applies to throng_consume";
      int refusals = 0;
      for (;; ++refusals) {
        ASSERT_LT(refusals, 10);
        Host host;
        host.give_memory(o);
        const Seen seen = consume(o, boxes_);
        EXPECT_LE(host.peak, o.memory_cap_bytes);
        if (seen.status == THRONG_OK) {
          EXPECT_TRUE(same_pairs(seen.pairs, answer_.pairs));
          break;
        }
        ASSERT_EQ(seen.status, THRONG_MEMORY_CAP_TOO_SMALL) << seen.message;
        ASSERT_GT(seen.result.bytes_needed, o.memory_cap_bytes);
        o.memory_cap_bytes = static_cast<size_t>(seen.result.bytes_needed);
      }
      EXPECT_GT(refusals, 0) << "a cap of 1000 bytes was accepted";
    }
  }
}

TEST_F(COptions, Memory) {
  Host host;
  throng_options o = defaults();
  host.give_memory(o);
  o.threads = 2;
  ASSERT_EQ(find(o, boxes_).status, THRONG_OK);
  EXPECT_GT(host.allocations, 0u);
  EXPECT_TRUE(host.blocks.empty()) << "not released";
  host.limit = 1000;
  const Seen seen = find(o, boxes_);
  EXPECT_EQ(seen.status, THRONG_OUT_OF_MEMORY);
  EXPECT_GT(seen.result.bytes_needed, 0u);
  for (const bool which : {false, true}) {
    throng_options half = o;
    if (which)
      half.allocate = nullptr;
    else
      half.deallocate = nullptr;
    const Seen refused = find(half, boxes_);
    EXPECT_EQ(refused.status, THRONG_BAD_OPTION);
    EXPECT_NE(refused.message.find("allocate"), std::string::npos) << refused.message;
  }
}

TEST_F(COptions, InstructionSet) {
  throng_options o = defaults();
  for (const Isa isa : all_isas) {
    o.isa = static_cast<int>(isa);
    const Seen seen = find(o, boxes_);
    if (!is_supported(isa)) {
      EXPECT_EQ(seen.status, THRONG_UNSUPPORTED_ISA);
      continue;
    }
    ASSERT_EQ(seen.status, THRONG_OK) << seen.message;
    EXPECT_EQ(seen.result.isa, o.isa);
    EXPECT_TRUE(same_pairs(seen.pairs, answer_.pairs));
  }
}

// Stopped from the tasks' threads before they begin: ends with the option, not without it.
TEST_F(COptions, Stoppable) {
  const throng_boxes view = view_of(boxes_);
  for (const int stoppable : {0, 1}) {
    Host host;
    throng_options o = defaults();
    o.stoppable = stoppable;
    host.give_threads(o, 2);
    throng_finder* const finder = throng_finder_create(&o);
    host.before_tasks = [&] { throng_finder_stop(finder); };
    const throng_status status = throng_find(finder, &view, nullptr);
    EXPECT_EQ(status, stoppable ? THRONG_STOPPED : THRONG_OK);
    EXPECT_EQ(throng_finder_result(finder)->found, stoppable ? 0 : answer_.pairs.size());
    host.before_tasks = nullptr;
    EXPECT_EQ(throng_find(finder, &view, nullptr), THRONG_OK) << "it ends one call";
    EXPECT_EQ(throng_finder_result(finder)->found, answer_.pairs.size());
    throng_finder_destroy(finder);
  }
}

// One below the first value and one above the last of each enumeration, on each kind of handle.
TEST_F(COptions, InvalidValues) {
  struct Choice {
    const char* name;
    int throng_options::*field;
    int last;
  };
  const Choice choices[] = {{"algorithm", &throng_options::algorithm, THRONG_ALGORITHM_GRID},
                            {"order", &throng_options::order, THRONG_ORDER_CANONICAL},
                            {"backend", &throng_options::backend, THRONG_BACKEND_EMULATED},
                            {"nan", &throng_options::nan, THRONG_NAN_INACTIVE},
                            {"isa", &throng_options::isa, THRONG_ISA_WASM},
                            {"stoppable", &throng_options::stoppable, 1},
                            {"inverted", &throng_options::inverted, THRONG_INVERTED_INACTIVE}};
  const BoxList two(boxes_.begin(), boxes_.begin() + 2);
  const throng_boxes view = view_of(two);
  for (const Choice& choice : choices) {
    for (const int wrong : {-1, choice.last + 1, std::numeric_limits<int>::max(),
                            std::numeric_limits<int>::min(), 256}) {
      SCOPED_TRACE(choice.name + std::string(" ") + std::to_string(wrong));
      throng_options o = defaults();
      o.*choice.field = wrong;
      const std::string text = choice.name + std::string(" (") + std::to_string(wrong) + ")";
      const auto expect_refused = [&](throng_status status, const throng_result* result) {
        EXPECT_EQ(status, THRONG_BAD_OPTION);
        EXPECT_NE(std::string(result->message).find(text), std::string::npos) << result->message;
      };
      throng_finder* const finder = throng_finder_create(&o);
      expect_refused(throng_find(finder, &view, nullptr), throng_finder_result(finder));
      throng_finder_destroy(finder);
      throng_broad_phase* const live = throng_broad_phase_create(&o);
      expect_refused(throng_broad_phase_add(live, &view, nullptr), throng_broad_phase_result(live));
      EXPECT_EQ(throng_broad_phase_object_count(live), 0u);
      throng_broad_phase_destroy(live);
      throng_query* const query = throng_query_create(&o);
      throng_broad_phase* const good = throng_broad_phase_create(nullptr);
      ASSERT_EQ(throng_broad_phase_add(good, &view, nullptr), THRONG_OK);
      expect_refused(throng_query_find_overlaps(query, good, &view), throng_query_result(query));
      throng_query_destroy(query);
      throng_broad_phase_destroy(good);
    }
  }
}

// The options that apply to persistent objects, and the two that must keep their defaults.
TEST_F(COptions, OfABroadPhase) {
  const auto update = [&](const throng_options& o, const BoxList& boxes, Seen& seen) {
    throng_broad_phase* const live = throng_broad_phase_create(&o);
    const throng_boxes view = view_of(boxes);
    seen.status = throng_broad_phase_add(live, &view, nullptr);
    if (seen.status == THRONG_OK) seen.status = throng_broad_phase_update(live);
    seen.result = *throng_broad_phase_result(live);
    seen.message = seen.result.message;
    seen.pairs.clear();
    size_t count = 0;
    const throng_live_pair* const pairs = throng_broad_phase_pairs(live, &count);
    for (size_t i = 0; i < count; ++i) seen.pairs.push_back({pairs[i].first, pairs[i].second});
    throng_broad_phase_destroy(live);
  };
  Seen seen;
  BoxList bad = boxes_;
  bad[3].lower.y = std::numeric_limits<float>::quiet_NaN();
  throng_options o = defaults();
  update(o, bad, seen);
  EXPECT_EQ(seen.status, THRONG_NAN_BOX);
  EXPECT_EQ(seen.result.first_invalid, 3u);
  o.nan = THRONG_NAN_INACTIVE;
  update(o, bad, seen);
  EXPECT_EQ(seen.status, THRONG_OK) << seen.message;
  EXPECT_EQ(seen.result.inactive, 1u);
  EXPECT_EQ(seen.pairs, swept_pairs(bad).pairs);

  o = defaults();
  o.margin = 0.5f;
  const BoxList few(boxes_.begin(), boxes_.begin() + 2000);
  update(o, few, seen);
  EXPECT_EQ(seen.pairs, reference_pairs(few, 0.5f).pairs);

  for (const unsigned threads : {0u, 1u, 3u}) {
    Host host;
    o = defaults();
    o.threads = threads;
    host.give_threads(o, 4);
    host.give_memory(o);
    update(o, boxes_, seen);
    ASSERT_EQ(seen.status, THRONG_OK) << seen.message;
    EXPECT_EQ(seen.pairs, answer_.pairs);
    EXPECT_EQ(host.most_tasks, threads == 0 ? 4 : threads == 1 ? 0 : threads);
    EXPECT_EQ(seen.result.threads, threads == 0 ? 4 : threads);
    EXPECT_GT(host.allocations, 0u);
    EXPECT_TRUE(host.blocks.empty());
  }
  // No effect: the pairs are sorted anyway, and a cap applies only to throng_consume.
  o = defaults();
  o.algorithm = THRONG_ALGORITHM_ALL_PAIRS;
  o.order = THRONG_ORDER_CANONICAL;
  o.memory_cap_bytes = 1000;
  update(o, boxes_, seen);
  EXPECT_EQ(seen.status, THRONG_OK) << seen.message;
  EXPECT_EQ(seen.pairs, answer_.pairs);
  for (const int backend : {THRONG_BACKEND_CUDA, THRONG_BACKEND_EMULATED}) {
    o.backend = backend;
    update(o, boxes_, seen);
    EXPECT_EQ(seen.status, THRONG_BAD_OPTION);
    EXPECT_NE(seen.message.find("backend"), std::string::npos) << seen.message;
  }
  for (const int stoppable : {0, 1}) {
    Host host;
    o = defaults();
    o.stoppable = stoppable;
    host.give_threads(o, 2);
    throng_broad_phase* const live = throng_broad_phase_create(&o);
    const throng_boxes view = view_of(boxes_);
    ASSERT_EQ(throng_broad_phase_add(live, &view, nullptr), THRONG_OK);
    host.before_tasks = [&] { throng_broad_phase_stop(live); };
    EXPECT_EQ(throng_broad_phase_update(live), stoppable ? THRONG_STOPPED : THRONG_OK);
    EXPECT_EQ(throng_broad_phase_pair_count(live), stoppable ? 0 : answer_.pairs.size());
    throng_broad_phase_destroy(live);
  }
}

TEST_F(COptions, OfAQuery) {
  throng_broad_phase* const live = throng_broad_phase_create(nullptr);
  const throng_boxes view = view_of(boxes_);
  ASSERT_EQ(throng_broad_phase_add(live, &view, nullptr), THRONG_OK);
  ASSERT_EQ(throng_broad_phase_update(live), THRONG_OK);
  BoxList bad = boxes_;
  bad[3].lower.y = std::numeric_limits<float>::quiet_NaN();
  const throng_boxes bad_view = view_of(bad);
  const size_t overlaps = 2 * answer_.pairs.size() + boxes_.size() - answer_.inactive;
  for (const unsigned threads : {1u, 3u}) {
    for (const int nan : {THRONG_NAN_REFUSE, THRONG_NAN_INACTIVE}) {
      Host host;
      throng_options o = defaults();
      o.nan = nan;
      o.threads = threads;
      o.margin = 7;  // ignored
      host.give_threads(o, 4);
      host.give_memory(o);
      throng_query* const query = throng_query_create(&o);
      EXPECT_EQ(throng_query_find_overlaps(query, live, &view), THRONG_OK);
      size_t count = 0;
      throng_query_overlaps(query, &count);
      EXPECT_EQ(count, overlaps);
      EXPECT_EQ(throng_query_result(query)->found, overlaps);
      EXPECT_EQ(host.most_tasks, threads == 1 ? 0 : threads);
      EXPECT_GT(host.allocations, 0u);
      EXPECT_EQ(throng_query_find_overlaps(query, live, &bad_view),
                nan == THRONG_NAN_REFUSE ? THRONG_NAN_BOX : THRONG_OK);
      throng_query_destroy(query);
      EXPECT_TRUE(host.blocks.empty());
    }
  }
  for (const int stoppable : {0, 1}) {
    Host host;
    throng_options o = defaults();
    o.stoppable = stoppable;
    host.give_threads(o, 2);
    throng_query* const query = throng_query_create(&o);
    host.before_tasks = [&] { throng_query_stop(query); };
    EXPECT_EQ(throng_query_find_overlaps(query, live, &view),
              stoppable ? THRONG_STOPPED : THRONG_OK);
    EXPECT_EQ(throng_query_result(query)->found, stoppable ? 0 : overlaps);
    throng_query_destroy(query);
  }
  throng_broad_phase_destroy(live);
}

// The text of any number. The check of enumerations would refuse what this test is about.
THRONG_NO_SANITIZE std::string text_of(std::uint32_t number) {
  throng_status status;
  std::memcpy(&status, &number, sizeof status);
  return throng_status_text(status);
}

// C may pass any number: all numbers around the valid statuses, those that match one in the last
// byte, and the extremes.
TEST(CStatus, EveryNumberHasItsText) {
  constexpr std::uint32_t statuses = static_cast<std::uint32_t>(Status::bad_mesh) + 1;
  std::map<std::string, std::uint32_t> seen;
  for (std::uint32_t number = 0; number < statuses; ++number) {
    EXPECT_EQ(text_of(number), to_string(static_cast<Status>(number)));
    EXPECT_NE(text_of(number), "unknown") << number;
    EXPECT_NE(text_of(number), "");
    EXPECT_TRUE(seen.emplace(text_of(number), number).second)
        << number << " and " << seen[text_of(number)] << " are both '" << text_of(number) << "'";
  }
  EXPECT_EQ(text_of(THRONG_OK), "ok");
  for (std::uint32_t number = statuses; number < 70'000; ++number)
    ASSERT_EQ(text_of(number), "unknown") << number;
  for (std::uint32_t number = 0; number < statuses; ++number) {
    for (const std::uint32_t above : {1u << 16, 1u << 24, 1u << 31, 0xffffff00u})
      EXPECT_EQ(text_of(number + above), "unknown") << number + above;
    EXPECT_EQ(text_of(0u - number - 1), "unknown") << "-" << number + 1;
  }
}

}  // namespace
}  // namespace throng::tests
