// Holds the library's answer to a case against the double loop's, and counts what was compared.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "support/cases.hpp"
#include "support/configs.hpp"
#include "support/plain_loop.hpp"

namespace throng::tests {

// What was compared. A box counts once a search whose whole answer was held against the plain
// method's; a pair likewise.
struct Tally {
  std::uint64_t cases = 0, searches = 0, boxes = 0, pairs = 0, close_cases = 0, looked_close = 0;
};

class Judge {
 public:
  Judge();

  const std::vector<Config>& configs() const { return configs_; }
  // The double loop over the case; the calls of search() that follow are held against it.
  void begin(const Case& c);
  // One search of the case of begin() by a configuration, its form (own memory, a caller's buffer,
  // a consumer) and room drawn by `choice`. Throws Difference.
  void search(const Case& c, std::size_t config, std::uint32_t choice);
  // Thirty thousand boxes in one spot have 450 million pairs, which take gigabytes: gives back what
  // a scene like that took. begin() does so, too.
  void drop_large();
  const PlainLoop& truth() const { return truth_; }
  // Searches by algorithm, instruction set, filter: a table that shows what was reached.
  std::string table() const;

  Tally tally;

 private:
  void buffer(const Case& c, Finder& finder, const Config& config, std::uint32_t room);
  void check(const Result& r, const Config& config) const;
  void require(bool good, const Config& config, const std::string& what) const;
  void compare(const Case& c, const Config& config, const Pair* got, std::size_t count);

  std::vector<Config> configs_;
  std::vector<Finder> finders_;  // they come with whatever earlier cases left: it must not matter
  std::vector<std::array<std::uint64_t, 9>> reached_;  // see table()
  std::vector<Pair> out_;
  PlainLoop truth_;
  bool refused_ = false;
  struct {
    std::uint64_t first = 0, count = 0;
  } nan_;  // boxes with a NaN, of the first set first
};

// In a line, for messages.
std::string describe(const Case& c);

}  // namespace throng::tests
