// Compares every backend, algorithm, instruction set, thread count, order and form with the
// expected result: used by `check` and `replay`.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <throng/boxes.hpp>
#include <throng/capture.hpp>
#include <throng/finder.hpp>
#include <throng/options.hpp>

#include "apps/throng/expected_pairs.hpp"

namespace throng::cli {

// One search in the requested form. The growing form leaves `pairs` in the Finder.
struct FormRun {
  Result result;
  std::vector<Pair> taken;
  const Pair* pairs = nullptr;
  std::size_t count = 0;
};
FormRun run_form(Finder& finder, const Boxes& a, const Boxes* b, capture::Form form,
                 std::size_t capacity);

class Comparison {
 public:
  // The runs of one backend, algorithm and instruction set.
  struct Row {
    Backend backend;
    Algorithm algorithm;
    Isa isa;
    bool skipped = false;
    std::size_t runs = 0;
    double fastest_ms = 0;
    std::vector<std::string> problems;

    std::string text() const;
  };
  // The first wrong pair of all runs, and its run.
  struct First {
    std::string run;
    ExpectedPairs::Difference difference;
  };

  // Referenced objects must outlive it. Of the options, margin, nan and cell_scale are used.
  Comparison(const Boxes& a, const Boxes* b, const Options& options, ExpectedPairs& expected_pairs)
      : a_(a), b_(b), options_(options), expected_pairs_(expected_pairs) {}

  static std::string head();
  // Calls back after each row; returns the number of runs that differ.
  std::size_t run(bool full, const std::function<void(const Row&)>& on_row);
  const std::optional<First>& first() const noexcept { return first_; }

 private:
  void row(Backend backend, Algorithm algorithm, Isa isa, bool skip);
  void one(Row& row, unsigned threads, Order order, capture::Form form);
  bool has(Isa isa) const;

  const Boxes a_;
  const Boxes* b_;
  const Options options_;
  ExpectedPairs& expected_pairs_;
  std::function<void(const Row&)> on_row_;
  bool run_all_forms_ = false;
  std::size_t differing_runs_ = 0;
  std::optional<First> first_;
};

}  // namespace throng::cli
