// Parameters of the conformance suite: algorithm, instruction set, threads, order.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <ostream>
#include <string>
#include <vector>

#include <throng/cuda.hpp>
#include <throng/throng.hpp>

#include "support/reference.hpp"
#include "support/sanitized.hpp"

namespace throng::tests {

struct Config {
  Algorithm algorithm;
  Isa isa;
  unsigned threads;
  Order order;
  Backend backend = Backend::cpu;

  Options options() const {
    Options o;
    o.backend = backend;
    o.algorithm = algorithm;
    o.isa = isa;
    o.threads = threads;
    o.order = order;
    o.inverted = InvertedPolicy::inactive;  // hard scenes contain empty slots, for find_pairs too
    return o;
  }
  std::string name() const {
    return std::string(backend == Backend::cpu ? "" : to_string(backend)) +
           (backend == Backend::cpu ? "" : "_") +
           std::string(algorithm == Algorithm::all_pairs ? "all_pairs"
                       : algorithm == Algorithm::grid    ? "grid"
                                                         : "auto") +
           "_" + to_string(isa) + "_" + std::to_string(threads) +
           (order == Order::canonical ? "_canonical" : "_any");
  }
};

inline void PrintTo(const Config& config, std::ostream* out) { *out << config.name(); }

inline bool is_supported(Isa isa) {
  const Box boxes[2] = {{{0, 0, 0}, {1, 1, 1}}, {{1, 1, 1}, {2, 2, 2}}};
  Options options;
  options.isa = isa;
  options.threads = 1;
  Finder finder(options);
  return finder.find(Boxes(boxes, 2)).status != Status::unsupported_isa;
}

inline std::vector<Isa> supported_isas() {
  std::vector<Isa> isas;
  for (const Isa isa : all_isas)
    if (isa == Isa::scalar || is_supported(isa)) isas.push_back(isa);
  return isas;
}

// Every instruction set on one thread and three, the widest also on two and five. `automatic` once
// per thread count and order, as most callers use it.
inline std::vector<Config> plain_configs() {
  std::vector<Config> configs;
  const std::vector<Isa> isas = supported_isas();
  for (const Algorithm algorithm : {Algorithm::all_pairs, Algorithm::grid})
    for (const Isa isa : isas)
      for (const unsigned threads : {1u, 2u, 3u, 5u})
        for (const Order order : {Order::any, Order::canonical})
          if (threads == 1 || threads == 3 || isa == isas.back())
            configs.push_back({algorithm, isa, threads, order});
  for (const unsigned threads : {0u, 1u})
    for (const Order order : {Order::any, Order::canonical})
      configs.push_back({Algorithm::automatic, Isa::automatic, threads, order});
  // The device pipeline, emulated on the CPU.
  for (const Algorithm algorithm : {Algorithm::all_pairs, Algorithm::grid}) {
    configs.push_back({algorithm, Isa::scalar, 1, Order::any, Backend::emulated});
    configs.push_back({algorithm, Isa::scalar, 3, Order::canonical, Backend::emulated});
  }
  return configs;
}

// Sanitizers slow tests down 3 to 15 times, so this keeps the scalar and the widest set and drops
// configurations whose code another one runs too.
inline std::vector<Config> sanitizer_configs() {
  constexpr Order any = Order::any, canonical = Order::canonical;
  const Isa widest = supported_isas().back();
  std::vector<Config> configs = {
      {Algorithm::all_pairs, widest, 3, any},
      {Algorithm::grid, widest, 3, canonical},
      {Algorithm::grid, Isa::scalar, 3, any},
      {Algorithm::automatic, Isa::automatic, 0, any},
      {Algorithm::automatic, Isa::automatic, 1, any},
      {Algorithm::all_pairs, Isa::scalar, 0, any, Backend::emulated},
      {Algorithm::grid, Isa::scalar, 0, any, Backend::emulated},
  };
  if (!thread_sanitized) {
    configs.push_back({Algorithm::all_pairs, Isa::scalar, 1, any});
    configs.push_back({Algorithm::grid, Isa::scalar, 1, any});
    configs.push_back({Algorithm::grid, Isa::scalar, 0, canonical, Backend::emulated});
    if (widest != Isa::scalar) configs.push_back({Algorithm::grid, widest, 1, any});
  }
  return configs;
}

inline std::vector<Config> all_configs() {
  std::vector<Config> configs = sanitized ? sanitizer_configs() : plain_configs();
  // And on a GPU, if there is one.
  if (cuda::available().ok())
    for (const Algorithm algorithm : {Algorithm::all_pairs, Algorithm::grid, Algorithm::automatic})
      for (const Order order : {Order::any, Order::canonical})
        configs.push_back({algorithm, Isa::scalar, 1, order, Backend::cuda});
  return configs;
}

// The configurations that the conformance suite runs: half of `plain_configs` (of those with an
// explicit algorithm and instruction set), chosen so that all pairs of values of algorithm,
// instruction set, threads and order occur, and with each instruction set all pairs of the others.
// All of them with THRONG_CONFIGS=all, as in `scripts/check conformance`.
inline std::vector<Config> suite_configs() {
  std::vector<Config> configs = all_configs();
  const char* wanted = std::getenv("THRONG_CONFIGS");
  if (sanitized || (wanted && std::string(wanted) == "all")) return configs;
  const auto is_left_out = [](const Config& c) {
    if (c.backend != Backend::cpu || c.algorithm == Algorithm::automatic) return false;
    const int odd =
        (c.algorithm == Algorithm::grid) + (c.order == Order::canonical) + (c.threads > 2);
    return odd % 2 != 0;
  };
  configs.erase(std::remove_if(configs.begin(), configs.end(), is_left_out), configs.end());
  return configs;
}

// One per algorithm and instruction set, for tests that do not depend on threads and order.
inline std::vector<Config> single_configs() {
  std::vector<Config> configs;
  for (const Config& config : all_configs())
    if (config.threads == 1 && config.order == Order::any) configs.push_back(config);
  return configs;
}

inline std::string config_name(const testing::TestParamInfo<Config>& info) {
  return info.param.name();
}

// Checks the fields of any successful result.
inline void expect_sound(const Result& result, const Config& config, const Answer& answer,
                         std::size_t compared) {
  EXPECT_EQ(result.status, Status::ok) << result.message;
  EXPECT_EQ(result.plan.backend, config.backend);
  EXPECT_EQ(result.found, answer.pairs.size());
  EXPECT_EQ(result.written, answer.pairs.size());
  EXPECT_EQ(result.inactive, answer.inactive);
  EXPECT_EQ(result.first_invalid, 0u);
  EXPECT_EQ(result.invalid_count, 0u);
  EXPECT_EQ(result.bytes_needed, 0u);
  EXPECT_STREQ(result.message, "");
  ASSERT_NE(result.plan.reason, nullptr);
  EXPECT_GE(result.comparisons, result.found);
  if (compared >= 1000) {
    EXPECT_STRNE(result.plan.reason, "");
    EXPECT_NE(result.plan.algorithm, Algorithm::automatic);
    EXPECT_NE(result.plan.isa, Isa::automatic);
    if (config.algorithm != Algorithm::automatic) {
      EXPECT_EQ(result.plan.algorithm, config.algorithm);
    }
    if (config.isa != Isa::automatic) {
      EXPECT_EQ(result.plan.isa, config.isa);
    }
    if (config.threads != 0) {
      EXPECT_LE(result.plan.threads, config.threads);
    }
  }
  EXPECT_GE(result.plan.threads, 1u);
}

inline void expect_pairs(const Result& result, const Config& config, const Answer& answer,
                         std::vector<Pair> got, std::size_t compared) {
  expect_sound(result, config, answer, compared);
  if (config.order == Order::canonical) {
    EXPECT_TRUE(std::is_sorted(got.begin(), got.end())) << "not sorted";
  }
  EXPECT_TRUE(same_pairs(std::move(got), answer.pairs));
}

// Finds with `config` and compares everything with the answer.
template <class AnyBoxes>
void expect_found(const AnyBoxes& boxes, const Config& config, const Answer& answer) {
  Finder finder(config.options());
  const Result result = finder.find(boxes);
  expect_pairs(result, config, answer, to_vector(finder.pairs()), boxes.size());
}
template <class AnyBoxes>
void expect_found(const AnyBoxes& a, const AnyBoxes& b, const Config& config,
                  const Answer& answer) {
  Finder finder(config.options());
  const Result result = finder.find(a, b);
  expect_pairs(result, config, answer, to_vector(finder.pairs()), std::min(a.size(), b.size()));
}
inline void expect_exact(const Boxes& boxes, const Config& config, const Answer& answer) {
  expect_found(boxes, config, answer);
}
inline void expect_exact(const Boxes& a, const Boxes& b, const Config& config,
                         const Answer& answer) {
  expect_found(a, b, config, answer);
}
inline void expect_exact(const DoubleBoxes& boxes, const Config& config, const Answer& answer) {
  expect_found(boxes, config, answer);
}
inline void expect_exact(const DoubleBoxes& a, const DoubleBoxes& b, const Config& config,
                         const Answer& answer) {
  expect_found(a, b, config, answer);
}

class Conformance : public testing::TestWithParam<Config> {
 protected:
  const Config& config() const { return GetParam(); }
  Options options() const { return GetParam().options(); }
};

// Each file of the suite names its own subclass, so that failures and filters name the file.
#define THRONG_INSTANTIATE(suite, configs)                                            \
  INSTANTIATE_TEST_SUITE_P(All, suite, testing::ValuesIn(::throng::tests::configs()), \
                           ::throng::tests::config_name)

}  // namespace throng::tests
