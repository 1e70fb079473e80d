// The process's operator new fails, at each call in turn.
#include <atomic>
#include <cstdlib>
#include <new>

#include <throng/throng.h>
#include <throng/throng.hpp>

#include "support/aligned_memory.hpp"
#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace {

// Index of the call of operator new that fails, counted from now on; negative: none.
std::atomic<long> failing_new{-1};
std::atomic<unsigned> news_refused{0};

bool refuse_new() {
  if (failing_new.load(std::memory_order_relaxed) < 0) return false;
  if (failing_new.fetch_sub(1) != 0) return false;
  ++news_refused;
  return true;
}
void* take(std::size_t bytes) noexcept {
  return refuse_new() ? nullptr : std::malloc(bytes ? bytes : 1);
}

}  // namespace

using throng::tests::allocate_aligned;
using throng::tests::free_aligned;

// GCC sees free() in one and does not see malloc() in the other.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
#endif
void* operator new(std::size_t bytes) {
  if (void* memory = take(bytes)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return take(bytes); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  if (!refuse_new()) {
    if (void* memory = allocate_aligned(bytes, static_cast<std::size_t>(alignment))) return memory;
  }
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { free_aligned(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { free_aligned(memory); }

namespace throng::tests {
namespace {

// Runs act() with each call of operator new failing in turn. act() checks its results and returns
// whether it succeeded.
template <class Act>
unsigned for_each_failing_new(const Act& act) {
  unsigned failures = 0;
  for (long k = 0; k < 2000; ++k) {
    news_refused = 0;
    failing_new = k;
    const bool done = act();
    failing_new = -1;
    if (news_refused == 0) {
      EXPECT_TRUE(done);
      return failures;
    }
    failures += !done;
  }
  ADD_FAILURE() << "failures did not end";
  return failures;
}

TEST(FailingProcess, FindPairs) {
  const BoxList boxes = uniform_boxes(sanitized ? 1000 : 3000, 1);
  const Answer answer = swept_pairs(boxes);
  for (const Backend backend : {Backend::cpu, Backend::emulated}) {
    for (const unsigned threads : {1u, 3u}) {
      Options options;
      options.backend = backend;
      options.threads = threads;
      const unsigned failures = for_each_failing_new([&] {
        std::vector<Pair> out;
        const Result r = find_pairs(boxes, out, options);
        failing_new = -1;
        if (r.ok()) {
          EXPECT_TRUE(same_pairs(out, answer.pairs));
        } else {
          EXPECT_EQ(r.status, Status::out_of_memory) << r.message;
          EXPECT_TRUE(out.empty());
        }
        return r.ok();
      });
      EXPECT_GT(failures, 2u);
      // The throwing form.
      for_each_failing_new([&] {
        try {
          std::vector<Pair> pairs = find_pairs(boxes, options);
          failing_new = -1;
          EXPECT_TRUE(same_pairs(std::move(pairs), answer.pairs));
          return true;
        } catch (const Error& error) {
          EXPECT_EQ(error.result().status, Status::out_of_memory);
        } catch (const std::bad_alloc&) {  // for the Error's own text
        }
        return false;
      });
    }
  }
}

TEST(FailingProcess, Explain) {
  const BoxList boxes = uniform_boxes(1500, 1);
  const Answer answer = reference_pairs(boxes);
  Finder finder;
  for_each_failing_new([&] {
    try {
      const Explanation e = finder.explain(boxes);
      failing_new = -1;
      EXPECT_EQ(e.result.found, answer.pairs.size());
      return true;
    } catch (const Error& error) {
      EXPECT_EQ(error.result().status, Status::out_of_memory);
    } catch (const std::bad_alloc&) {
    }
    return false;
  });
  EXPECT_TRUE(finder.find(boxes).ok());
  EXPECT_TRUE(same_pairs(to_vector(finder.pairs()), answer.pairs));
}

TEST(FailingProcess, BroadPhase) {
  const BoxList boxes = uniform_boxes(800, 1);
  const Answer answer = reference_pairs(boxes);
  Options options;
  options.threads = 2;
  for_each_failing_new([&] {
    throng::BroadPhase persistent(options);
    const Result added = persistent.add(boxes, nullptr);
    const Result updated = persistent.update();
    failing_new = -1;
    EXPECT_TRUE(added.ok() || added.status == Status::out_of_memory);
    EXPECT_TRUE(updated.ok() || updated.status == Status::out_of_memory);
    if (!added.ok()) {
      EXPECT_TRUE(persistent.add(boxes, nullptr).ok());
    }
    EXPECT_TRUE(persistent.update().ok());
    EXPECT_EQ(persistent.pair_count(), answer.pairs.size());
    return added.ok() && updated.ok();
  });
}

TEST(FailingProcess, CInterface) {
  const BoxList boxes = uniform_boxes(500, 1);
  const throng_boxes view =
      throng_boxes_packed(reinterpret_cast<const throng_box*>(boxes.data()), boxes.size());
  const unsigned failures = for_each_failing_new([&] {
    throng_finder* finder = throng_finder_create(nullptr);
    if (!finder) return false;
    const throng_status status = throng_find(finder, &view, nullptr);
    failing_new = -1;
    EXPECT_TRUE(status == THRONG_OK || status == THRONG_OUT_OF_MEMORY);
    throng_finder_destroy(finder);
    return status == THRONG_OK;
  });
  EXPECT_GT(failures, 2u);
}

}  // namespace
}  // namespace throng::tests
