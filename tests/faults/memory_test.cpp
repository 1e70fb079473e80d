// Memory that fails at each request in turn, once or from then on: the documented error, no leak,
// no partial result reported as complete, and an object that works afterwards.
#include <functional>
#include <string>

#include <throng/throng.h>
#include <throng/throng.hpp>

#include "support/configs.hpp"
#include "support/failing_resource.hpp"
#include "support/hard_boxes.hpp"
#include "support/in_turn.hpp"

namespace throng::tests {
namespace {

const Executor three_in_turn = in_turn(3);

struct Scene {
  BoxList a, b;
  std::vector<std::int32_t> world;
  std::vector<std::uint8_t> is_static;
  Boxes first() const {
    Boxes v = a;
    v.filters.world = {world.data(), a.size()};
    v.filters.is_static = {is_static.data(), a.size()};
    return v;
  }
};

// Large enough for several tasks; small for what is quadratic or slow.
Scene make_scene(bool large = false) {
  Scene s;
  s.a = huge_among_small(large && !sanitized ? 4500 : 900, 2);
  s.b = uniform_boxes(large ? 1500 : 400, 3);
  for (std::size_t i = 0; i < s.a.size(); ++i) {
    s.world.push_back(static_cast<std::int32_t>(i % 3) - 1);
    s.is_static.push_back(i % 5 == 0);
  }
  return s;
}

// Calls act(finder) with each request failing in turn; `act` returns the Result and puts the
// received pairs into `got`. Returns the number of requests.
using Act = std::function<Result(Finder&, std::vector<Pair>& got)>;
std::size_t every_request(const Options& options, const Answer& answer, const Act& act) {
  FailingResource memory;
  Options with = options;
  with.memory = &memory;
  with.executor = &three_in_turn;
  std::size_t requests = 0;
  for (const bool all_after : {false, true}) {
    for (std::size_t k = 0;; ++k) {
      {
        Finder finder(with);
        std::vector<Pair> got;
        memory.fail(k, all_after);
        const Result r = act(finder, got);
        const bool refused = memory.refused() != 0;
        memory.calm();
        if (r.ok()) {
          // A failed request may have a fallback; then the result is complete.
          EXPECT_TRUE(same_pairs(got, answer.pairs)) << "request " << k;
        } else {
          EXPECT_TRUE(refused);
          EXPECT_EQ(r.status, Status::out_of_memory) << "request " << k << ": " << r.message;
          EXPECT_GT(r.bytes_needed, 0u);
          EXPECT_NE(std::string(r.message).find(std::to_string(r.bytes_needed)), std::string::npos)
              << r.message;
          EXPECT_EQ(finder.pairs().size(), 0u);
        }
        got.clear();
        const Result again = act(finder, got);
        EXPECT_TRUE(again.ok()) << "after request " << k << ": " << again.message;
        EXPECT_TRUE(same_pairs(got, answer.pairs)) << "after request " << k;
        if (!refused) {
          requests = k;
          break;
        }
      }
      EXPECT_EQ(memory.held(), 0u) << "leaked at request " << k;
      if (testing::Test::HasFailure() || k > 3000) return k;
    }
  }
  EXPECT_EQ(memory.held(), 0u);
  return requests;
}

struct Case {
  Backend backend;
  Algorithm algorithm;
  Order order;
};
std::string case_name(const testing::TestParamInfo<Case>& info) {
  return std::string(to_string(info.param.backend)) +
         (info.param.algorithm == Algorithm::grid ? "_grid" : "_all_pairs") +
         (info.param.order == Order::canonical ? "_canonical" : "_any");
}

class FailingMemory : public testing::TestWithParam<Case> {
 protected:
  Options options() const {
    Options o;
    o.backend = GetParam().backend;
    o.algorithm = GetParam().algorithm;
    o.order = GetParam().order;
    return o;
  }
  Scene scene() const {
    return make_scene(GetParam().backend == Backend::cpu &&
                      GetParam().algorithm == Algorithm::grid);
  }
};

TEST_P(FailingMemory, GrowingOneSet) {
  const Scene s = scene();
  const std::size_t requests =
      every_request(options(), reference_pairs(s.first()), [&](Finder& f, std::vector<Pair>& got) {
        const Result r = f.find(s.first());
        got = to_vector(f.pairs());
        return r;
      });
  EXPECT_GE(requests, 3u);
}

TEST_P(FailingMemory, BufferTwoSets) {
  const Scene s = scene();
  const Answer answer = reference_pairs(s.first(), s.b);
  every_request(options(), answer, [&](Finder& f, std::vector<Pair>& got) {
    got.assign(answer.pairs.size() + 8, Pair{7, 7});
    const Result r = f.find(s.first(), s.b, got.data(), answer.pairs.size());
    for (std::size_t i = answer.pairs.size(); i < got.size(); ++i) EXPECT_EQ(got[i], (Pair{7, 7}));
    got.resize(r.ok() ? static_cast<std::size_t>(r.written) : 0);
    return r;
  });
}

TEST_P(FailingMemory, Consumer) {
  const Scene s = scene();
  const Answer answer = reference_pairs(s.a);
  every_request(options(), answer, [&](Finder& f, std::vector<Pair>& got) {
    const Result r = f.consume(s.a, [&](const Pair* pairs, std::size_t count) {
      got.insert(got.end(), pairs, pairs + count);
      return true;
    });
    // The consumer received valid pairs before memory failed, each once.
    std::sort(got.begin(), got.end());
    EXPECT_TRUE(std::includes(answer.pairs.begin(), answer.pairs.end(), got.begin(), got.end()));
    return r;
  });
}

INSTANTIATE_TEST_SUITE_P(All, FailingMemory,
                         testing::Values(Case{Backend::cpu, Algorithm::grid, Order::any},
                                         Case{Backend::cpu, Algorithm::grid, Order::canonical},
                                         Case{Backend::cpu, Algorithm::all_pairs, Order::canonical},
                                         Case{Backend::emulated, Algorithm::grid, Order::canonical},
                                         Case{Backend::emulated, Algorithm::all_pairs, Order::any}),
                         case_name);

TEST(FailingMemoryOther, Explain) {
  const Scene s = make_scene();
  every_request({}, reference_pairs(s.a), [&](Finder& f, std::vector<Pair>& got) {
    Result r;
    try {
      r = f.explain(s.a).result;
    } catch (const Error& error) {
      r = error.result();
    }
    got = to_vector(f.pairs());
    return r;
  });
}

TEST(FailingMemoryOther, CInterface) {
  const Scene s = make_scene();
  const Answer answer = reference_pairs(s.a);
  const throng_boxes boxes =
      throng_boxes_packed(reinterpret_cast<const throng_box*>(s.a.data()), s.a.size());
  FailingResource memory;
  throng_options options;
  throng_options_init(&options);
  options.threads = 1;
  options.memory_self = &memory;
  options.allocate = [](void* self, size_t bytes, size_t alignment) -> void* {
    try {
      return static_cast<FailingResource*>(self)->allocate(bytes, alignment);
    } catch (...) {
      return nullptr;
    }
  };
  options.deallocate = [](void* self, void* p, size_t bytes, size_t alignment) {
    static_cast<FailingResource*>(self)->deallocate(p, bytes, alignment);
  };
  bool refused = true;
  for (std::size_t k = 0; refused && k < 1000; ++k) {
    throng_finder* finder = throng_finder_create(&options);
    ASSERT_NE(finder, nullptr);
    memory.fail(k, false);
    const throng_status status = throng_find(finder, &boxes, nullptr);
    refused = memory.refused() != 0;
    memory.calm();
    if (status != THRONG_OK) {
      EXPECT_EQ(status, THRONG_OUT_OF_MEMORY);
      EXPECT_GT(throng_finder_result(finder)->bytes_needed, 0u);
    }
    EXPECT_EQ(throng_find(finder, &boxes, nullptr), THRONG_OK);
    size_t count = 0;
    throng_finder_pairs(finder, &count);
    EXPECT_EQ(count, answer.pairs.size());
    throng_finder_destroy(finder);
    EXPECT_EQ(memory.held(), 0u);
  }
  EXPECT_FALSE(refused);
}

// A sequence of BroadPhase calls, with its k-th request failing.
TEST(FailingMemoryOther, BroadPhaseQueriesAndChanges) {
  const BoxList boxes = uniform_boxes(1200, 5), others = uniform_boxes(1200, 6);
  std::vector<Sweep> sweeps;
  for (std::size_t i = 0; i < 200; ++i) sweeps.push_back({others[i], {3, 1, 0}});
  const std::vector<std::uint8_t> is_static(boxes.size(), 1);
  FailingResource memory;
  Options options;
  options.memory = &memory;
  options.executor = &three_in_turn;
  std::vector<ObjectId> ids(boxes.size());
  // One sequence; each call is repeated until it succeeds, and its results are recorded.
  const auto run_calls = [&](std::size_t& failures) {
    BroadPhase b(options);
    std::vector<std::uint64_t> results;
    const auto call = [&](auto&& act) {
      for (int attempt = 0;; ++attempt) {
        const Result r = act();
        if (r.ok()) return results.push_back(r.found);
        ++failures;
        EXPECT_EQ(r.status, Status::out_of_memory) << r.message;
        ASSERT_LT(attempt, 2);
      }
    };
    call([&] { return b.add(boxes, ids.data()); });
    for (int round = 0; round < 3; ++round) {
      call([&] { return b.update(); });
      results.push_back(b.begun().size());
      call([&] { return b.find_overlaps(others); });
      results.push_back(pair_checksum(b.overlaps().data(), b.overlaps().size()));
      call([&] { return b.find_hits(sweeps.data(), sweeps.size()); });
      results.push_back(b.hits().size());
      if (round == 0) call([&] { return b.move_all(others); });
      if (round == 1) {
        call([&] { return b.move(ids.data(), Boxes(boxes.data(), 3)); });
        call([&] { return b.remove(&ids[9], 5); });
        Filters filters;
        filters.is_static = {is_static.data(), 5};
        call([&] { return b.set_filters(&ids[20], 5, filters); });
      }
    }
    results.push_back(b.pairs().size());
    return results;
  };
  std::size_t failures = 0, failed_sequences = 0;
  const std::vector<std::uint64_t> right = run_calls(failures);
  ASSERT_EQ(failures, 0u);
  EXPECT_EQ(memory.held(), 0u);
  for (std::size_t k = 0; k < 1000; ++k) {
    failures = 0;
    memory.fail(k, false);
    const std::vector<std::uint64_t> results = run_calls(failures);
    const bool refused = memory.refused() != 0;
    memory.calm();
    EXPECT_EQ(results, right) << "request " << k;
    EXPECT_EQ(memory.held(), 0u) << "leaked at request " << k;
    failed_sequences += failures != 0;
    if (!refused || testing::Test::HasFailure()) break;
  }
  EXPECT_GE(failed_sequences, 10u);
}

}  // namespace
}  // namespace throng::tests
