// Errors and omissions in the paper, each with its proof, computed here where possible.
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "apps/paper/evaluation/experiments.hpp"
#include "apps/paper/mapping.hpp"
#include "apps/report/format.hpp"
#include "base/pair_index.hpp"

namespace throng::paper {
namespace {

// How many k of n objects have two rows with S(a) <= k <= S(a+1).
std::uint64_t count_ambiguous(std::uint64_t n) {
  std::uint64_t twice = 0;
  const auto count = static_cast<std::int64_t>(n);
  for (std::uint64_t k = 0; k < base::pair_count(n); ++k) {
    int rows = 0;
    for (std::int64_t a = 1; a < count; ++a) {
      const auto at = static_cast<std::int64_t>(k);
      rows += first_index(a, count) <= at && at <= first_index(a + 1, count);
    }
    twice += rows > 1;
  }
  return twice;
}

// How many of all k get their row by formula (1), in float64, with this sign before 8k.
std::uint64_t count_right_rows(std::uint64_t n, double sign) {
  std::uint64_t right = 0;
  const double m = static_cast<double>(n);
  for (std::uint64_t k = 0; k < base::pair_count(n); ++k) {
    const double radicand = 4 * m * m - 4 * m + sign * 8 * static_cast<double>(k) + 1;
    const double a = std::floor((2 * m + 1 - std::sqrt(radicand)) / 2);
    right += a == static_cast<double>(base::pair_of_row_index(k, n).first) + 1;
  }
  return right;
}

// Wrong pairs after a second repair that tests a > b, or a >= b, of those that two steps leave
// wrong.
std::uint64_t count_wrong_after(std::uint64_t n, bool strict) {
  Formula<FastRoot<float>> plain{{carmack_constant, 2, LastOperation::product}, false};
  std::uint64_t wrong = 0;
  const auto count = static_cast<std::int64_t>(n);
  for (std::uint64_t k = 0; k < base::pair_count(n); ++k) {
    std::int64_t a = plain.row(k, n);
    std::int64_t b = a + 1 + (static_cast<std::int64_t>(k) - first_index(a, count));
    if (b > count) {
      a = a + 1;
      b = a + (b - count);
    }
    if (strict ? a > b : a >= b) {
      b = count - (a - b);
      a = a - 1;
    }
    const Pair right = base::pair_of_row_index(k, n);
    wrong += a != std::int64_t{right.first} + 1 || b != std::int64_t{right.second} + 1;
  }
  return wrong;
}

}  // namespace

Section errata(const Lab& lab) {
  Section section("errata", "Slips in the paper, with proof");
  lab.say("errata");
  report::Table table("", {"the paper says", "it should be", "because"});
  const auto add = [&](const std::string& says, const std::string& should,
                       const std::string& because) {
    table.add_row({says, should, because});
  };
  const std::uint64_t n = 200, last = base::pair_count(n) - 1;

  add("3.2.1: S(a) <= k <= S(a+1)", "S(a) <= k < S(a+1)",
      fmt::format("S(a+1) is the first number of the next row: of the {} threads of {} objects {} "
                  "have two rows with both bounds, counted here",
                  report::format_count(last + 1), n, report::format_count(count_ambiguous(n))));
  add("3.1 and Table 1: threads 0 to (n^2-n)/2", "to (n^2-n)/2 - 1",
      fmt::format("{} objects have {} pairs, so the last number from 0 on is {}", n,
                  report::format_count(last + 1), report::format_count(last)));
  add("3.2.1: the special case k = Sn", "k = S(a)",
      "the row is what is sought, and the equation that follows has a in it");
  add("3.3: the radicand 4n^2 - 4n + 8k + 1", "4n^2 - 4n - 8k + 1, as in formula (1)",
      fmt::format("with + {} of {} threads get their row, with - {}",
                  report::format_count(count_right_rows(n, 1)), report::format_count(last + 1),
                  report::format_count(count_right_rows(n, -1))));
  const std::uint64_t many = 2000;
  add("3.3: the second case of a wrong pair is a > b", "a >= b, as in the code below it",
      fmt::format("a row that is one too high gives a + 1 + b - n <= a + 1, with equality for the "
                  "last column: with a > b {} of {} objects' pairs stay wrong (two Newton steps), "
                  "with a >= b {}",
                  report::format_count(count_wrong_after(many, true)), report::format_count(many),
                  report::format_count(count_wrong_after(many, false))));
  add("3.3: return number * y", "return nb * y",
      "the function's parameter is called nb; as printed the code does not compile");
  add("3.4: each thread reads its byte, ORs its bit in and writes the byte",
      "one atomic OR, a vote of the warp, or a thread per word",
      "eight threads share the byte and nothing orders them, so of two that find an overlap one's "
      "write can undo the other's; Table 5's rows show how many pairs that loses");
  add("Abstract and Figure 5: 100,000 objects under 25 ms", "27.91 ms, by Table 6",
      fmt::format("3.38 + 11.12 + 13.41 = {:.2f}", 3.38 + 11.12 + 13.41));
  const auto rate = [](double objects, double ms) {
    return objects * (objects - 1) / 2 / (ms * 1e6);
  };
  add("Table 2: 0.21, 2.25 and 29.66 ms for 1K, 10K and 100K objects", "not times of all pairs",
      fmt::format("they would be {:.3g}, {:.3g} and {:.3g} G pairs per second; Table 5 has {:.3g}, "
                  "{:.3g} and {:.3g} at 1000, 5000 and 7500, as a constant rate must be",
                  rate(1e3, 0.21), rate(1e4, 2.25), rate(1e5, 29.66), rate(1e3, 2.70),
                  rate(5e3, 73.95), rate(7.5e3, 163.6)));
  add("1000 objects take 2.70 ms (Table 5), 0.872 (Table 7), 0.21 (Table 2)", "one of them",
      "the same brute force on the same card; the kernel alone of Table 5 takes 3.1 times what "
      "Table "
      "7 has for all of it");
  add("With the grid 1.840 and 3.257 ms at 1K and 10K (Table 7)", "or 0.25 and 2.35 (Table 6)",
      fmt::format("the same system at the same sizes, {:.1f} and {:.1f} times apart", 1.840 / 0.25,
                  3.257 / 2.35));
  add("5: below 1000 objects the grid is of no use", "at 1000, too",
      "Table 7's own row has 0.872 ms without and 1.840 with it; and 3.5.2 says 3000");
  add("4: nothing about a pair that shares several cells",
      "one cell must own it: on each axis the later one of the two lower corners' cells",
      "both boxes are in that cell, and it is unique; otherwise a pair is reported as often as "
      "there "
      "are cells that both boxes touch");
  add("4.2: nothing about the size of the cells' lists", "counted, summed, then filled",
      "a list of fixed size loses pairs when it is full");
  add("3.3: after the repairs 0 % of errors", "as long as no row is off by two",
      "the section on the repairs has, for each root, objects beyond which pairs stay wrong");
  section.tables.push_back(std::move(table));
  section.finding = fmt::format("{} of them; none changes what the paper's method is.",
                                section.tables.front().rows());
  return section;
}

}  // namespace throng::paper
