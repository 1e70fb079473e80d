// The half of the configurations that the conformance suite runs covers all pairs of values.
#include <set>
#include <tuple>

#include "support/configs.hpp"

namespace throng::tests {
namespace {

using Two = std::tuple<int, int, int, int>;         // (parameter, value) twice
using Three = std::tuple<int, int, int, int, int>;  // the instruction set and two others

// CPU backend with an explicit algorithm; the emulated device and `automatic` are never left out.
bool is_plain(const Config& c) {
  return c.backend == Backend::cpu && c.algorithm != Algorithm::automatic;
}

std::vector<int> values(const Config& c) {
  return {static_cast<int>(c.algorithm), static_cast<int>(c.threads), static_cast<int>(c.order),
          static_cast<int>(c.isa)};
}

std::set<Two> twos(const std::vector<Config>& configs) {
  std::set<Two> met;
  for (const Config& c : configs)
    if (is_plain(c))
      for (int i = 0; i < 4; ++i)
        for (int j = i + 1; j < 4; ++j) met.insert({i, values(c)[i], j, values(c)[j]});
  return met;
}

std::set<Three> threes(const std::vector<Config>& configs) {
  std::set<Three> met;
  for (const Config& c : configs)
    if (is_plain(c))
      for (int i = 0; i < 3; ++i)
        for (int j = i + 1; j < 3; ++j)
          met.insert({values(c)[3], i, values(c)[i], j, values(c)[j]});
  return met;
}

TEST(Configs, SuiteCoversPairsOfSettings) {
  const std::vector<Config> all = all_configs(), suite = suite_configs();
  EXPECT_EQ(twos(suite), twos(all));
  if (!sanitized) {
    EXPECT_EQ(threes(suite), threes(all));
  }
  const char* wanted = std::getenv("THRONG_CONFIGS");
  if (!sanitized && !wanted) {
    const auto plain = [](const std::vector<Config>& configs) {
      return std::count_if(configs.begin(), configs.end(), is_plain);
    };
    EXPECT_EQ(2 * plain(suite), plain(all));
    EXPECT_EQ(suite.size() - plain(suite), all.size() - plain(all));
  }
}

}  // namespace
}  // namespace throng::tests
