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

#include "cli/truth.hpp"

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
    std::vector<std::string> complaints;

    std::string text() const;
  };
  // The first wrong pair of all runs, and its run.
  struct First {
    std::string run;
    Truth::Difference difference;
  };

  // Referenced objects must outlive it. Of the options, margin, nan and cell_scale are used.
  Comparison(const Boxes& a, const Boxes* b, const Options& options, Truth& truth)
      : a_(a), b_(b), options_(options), truth_(truth) {}

  static std::string head();
  // Calls back after each row; returns the number of runs that differ.
  std::size_t run(bool full, const std::function<void(const Row&)>& tell);
  const std::optional<First>& first() const noexcept { return first_; }

 private:
  void row(Backend backend, Algorithm algorithm, Isa isa, bool skip);
  void one(Row& row, unsigned threads, Order order, capture::Form form);
  bool has(Isa isa) const;

  const Boxes a_;
  const Boxes* b_;
  const Options options_;
  Truth& truth_;
  std::function<void(const Row&)> tell_;
  bool small_ = false;
  std::size_t differing_ = 0;
  std::optional<First> first_;
};

}  // namespace throng::cli
