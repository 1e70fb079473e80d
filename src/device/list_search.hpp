// A list as a search: one test per element.
#pragma once

#include <cstdint>

#include <throng/types.hpp>

#include "base/host_device_macros.hpp"

namespace throng::device {

// Adapts a list to the search interface, so that the device gathers the hits: one test per element.
template <class Test>
struct ListSearch {
  Test test;

  THRONG_HD std::uint64_t count() const noexcept { return test.count(); }
  class Walk {
   public:
    THRONG_HD Walk(const Test& test, std::uint64_t i) noexcept : test_(test), i_(i) {}
    THRONG_HD bool over() const noexcept { return over_; }
    THRONG_HD std::uint32_t comparisons() const noexcept { return compared_; }
    THRONG_HD bool step(Pair& pair) noexcept {
      over_ = true;
      return test_(i_, pair, compared_);
    }

   private:
    const Test& test_;
    std::uint64_t i_;
    std::uint32_t compared_ = 0;
    bool over_ = false;
  };
  THRONG_HD Walk begin(std::uint64_t i) const noexcept { return Walk(test, i); }
};

}  // namespace throng::device
