// A memory resource that fails one request, or that one and all later ones.
#pragma once

#include <gtest/gtest.h>

#include <new>

#include <throng/options.hpp>

#include "support/counting_resource.hpp"

namespace throng::tests {

class FailingResource : public CountingResource {
 public:
  static constexpr std::size_t never = static_cast<std::size_t>(-1);
  // Fails the request with index `at`, from 0, counted from now on; with `all_after` later ones
  // too.
  void fail(std::size_t at, bool all_after) {
    at_ = at;
    seen_ = 0;
    refused_ = 0;
    all_after_ = all_after;
  }
  void calm() { fail(never, false); }
  std::size_t refused() const { return refused_; }
  std::size_t seen() const { return seen_; }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    const std::size_t number = seen_++;
    if (number == at_ || (all_after_ && number > at_)) {
      ++refused_;
      throw std::bad_alloc();
    }
    return CountingResource::do_allocate(bytes, alignment);
  }
  std::size_t at_ = never, seen_ = 0, refused_ = 0;
  bool all_after_ = false;
};

// Repeats `act`, allowing one more request each time, until it succeeds. Until then see() must not
// change. Returns the number of failures.
template <class See, class Act>
std::size_t until_it_works(FailingResource& memory, See&& see, Act&& act) {
  const auto before = see();
  for (std::size_t allowed = 0;; ++allowed) {
    memory.fail(allowed, true);
    const Result r = act();
    memory.calm();
    if (r.ok()) return allowed;
    EXPECT_EQ(r.status, Status::out_of_memory) << r.message;
    EXPECT_NE(r.bytes_needed, 0u);
    EXPECT_TRUE(see() == before) << "after " << allowed << " requests";
    if (testing::Test::HasFailure() || allowed > 1000) return allowed;
  }
}

}  // namespace throng::tests
