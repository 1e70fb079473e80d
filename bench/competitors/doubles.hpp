// Methods that find the overlapping pairs of boxes of doubles.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <throng/types.hpp>

#include "competitors.hpp"

namespace throng::bench {

class DoubleMethod {
 public:
  virtual ~DoubleMethod() = default;
  virtual std::string name() const = 0;
  // Timed: from the caller's boxes to the pairs in memory. Returns the number of pairs.
  virtual std::size_t run(const std::vector<DoubleBox>& boxes) = 0;
};

std::vector<std::unique_ptr<DoubleMethod>> cgal_double_methods();
// Those that were found at build time; on one thread.
THRONG_BENCH_EXPORT std::vector<std::unique_ptr<DoubleMethod>> double_competitors();

}  // namespace throng::bench
