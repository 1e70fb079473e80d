// Compares the library's result for a case with the double loop's, and counts comparisons.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "support/cases.hpp"
#include "support/configs.hpp"
#include "support/vectorized_reference.hpp"

namespace throng::tests {

// Counts of compared work. A box or pair counts once per search whose full result was compared.
struct ComparisonCounts {
  std::uint64_t cases = 0, searches = 0, boxes = 0, pairs = 0, close_cases = 0, close_checked = 0;
};

class Oracle {
 public:
  Oracle();

  const std::vector<Config>& configs() const { return configs_; }
  // Runs the double loop over the case; later calls of search() compare with it.
  void begin(const Case& c);
  // Searches the case of begin() with a configuration; `choice` selects the form (own memory,
  // caller's buffer, consumer) and the capacity. Throws Difference.
  void search(const Case& c, std::size_t config, std::uint32_t choice);
  // Frees large workspaces: thirty thousand boxes in one spot have 450 million pairs, which take
  // gigabytes. begin() calls it too.
  void drop_large();
  const VectorizedReference& expected() const { return expected_; }
  // A coverage table: searches by algorithm, instruction set and filter.
  std::string table() const;

  ComparisonCounts totals;

 private:
  void buffer(const Case& c, Finder& finder, const Config& config, std::uint32_t capacity_choice);
  void check(const Result& r, const Config& config) const;
  void require(bool good, const Config& config, const std::string& what) const;
  void compare(const Case& c, const Config& config, const Pair* got, std::size_t count);

  std::vector<Config> configs_;
  std::vector<Finder> finders_;  // keep state from earlier cases; it must not matter
  std::vector<std::array<std::uint64_t, 9>> reached_;  // see table()
  std::vector<Pair> out_;
  VectorizedReference expected_;
  bool refused_ = false;
  struct {
    std::uint64_t first = 0, count = 0;
  } nan_;  // boxes with a NaN; the first set counts first
};

// One line, for messages.
std::string describe(const Case& c);

}  // namespace throng::tests
