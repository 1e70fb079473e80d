// Methods that answer ray casts and overlap queries among boxes that move.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <throng/broad_phase.hpp>

#include "moving.hpp"

namespace throng::bench {

// The box of a ray is a point: its start.
struct QueryBatch {
  enum Kind { first_hit, all_hits, overlaps };
  Kind kind = first_hit;
  bool one_call = false;  // all queries in one call, if the method can
  std::vector<Sweep> rays;
  std::vector<Box> regions;

  std::size_t size() const { return kind == overlaps ? regions.size() : rays.size(); }
};

class QueryMethod {
 public:
  virtual ~QueryMethod() = default;
  virtual std::string name() const = 0;
  virtual bool supports(QueryBatch::Kind kind) const = 0;
  virtual void start(const std::vector<Box>& boxes) = 0;
  // Both timed. run() returns the number of objects that all queries found.
  virtual void update(const Moves& moves) = 0;
  virtual std::uint64_t run(const QueryBatch& batch) = 0;
};

// Those that were found at build time.
THRONG_BENCH_EXPORT std::vector<std::unique_ptr<QueryMethod>> query_competitors();

}  // namespace throng::bench
