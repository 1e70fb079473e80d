// The effect of the paper's two repairs: wrong pairs before and after, and where each root first
// fails.
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "apps/paper/evaluation/experiments.hpp"
#include "apps/paper/mapping.hpp"
#include "apps/report/format.hpp"
#include "base/pair_index.hpp"

namespace throng::paper {
namespace {

Variant formula(RootKind root, int steps, bool repair, Radicand radicand = Radicand::integer) {
  Variant variant;
  variant.root = root;
  variant.steps = steps;
  variant.repair = repair;
  variant.radicand = radicand;
  return variant;
}

std::string name_of(const Variant& v) {
  const bool fast = v.root == RootKind::carmack || v.root == RootKind::lomont;
  return fmt::format("{}{}{}{}", name(v.root),
                     fast ? fmt::format(", {} step{}", v.steps, v.steps == 1 ? "" : "s") : "",
                     v.radicand == Radicand::real ? ", radicand in floating point" : "",
                     v.repair ? ", repaired" : "");
}

// The largest number of objects that have at most `tests` pairs.
std::uint64_t objects_of(std::uint64_t tests) {
  std::uint64_t n = 2;
  while (base::pair_count(n + 1) <= tests) ++n;
  return n;
}

// The smallest n with a wrong pair at the end of a row; 0 if there is none up to `limit`.
std::uint64_t first_failure(const Variant& variant, std::uint64_t limit) {
  for (std::uint64_t n = 2; n <= limit; ++n) {
    if (count_errors(variant, n, 1).rows > 0) return n;
  }
  return 0;
}

bool right(const Variant& variant, std::uint64_t k, std::uint64_t n) {
  return with_mapping(variant, nullptr, [&](const auto& mapping) {
    Pair got{};
    return mapping(k, n, got) && got == base::pair_of_row_index(k, n);
  });
}

}  // namespace

Section repairs(const Lab& lab) {
  Section section("repairs", "Section 3.3: the effect of the two repairs");

  // "From 1K to 100M tests, a 0 % of error is obtained."
  bool none = true;
  std::size_t beyond = 0, failing = 0;
  for (const std::uint64_t tests :
       lab.sizes({1000, 10000, 100000, 1000000, 10000000, 100000000}, 100000000)) {
    const std::uint64_t n = objects_of(tests);
    for (int steps = 2; steps <= 3; ++steps) {
      lab.say(fmt::format("repairs: {} tests, {} steps", report::format_short(tests), steps));
      const auto share = [&](bool repair) {
        return 100.0 *
               static_cast<double>(
                   count_errors(formula(RootKind::carmack, steps, repair), n).indices) /
               static_cast<double>(base::pair_count(n));
      };
      Row row = plain_row(fmt::format("Carmack, {} steps, repaired", steps), n,
                          fmt::format("wrong pairs of {} tests", report::format_short(tests)), "%");
      row.paper = 0;
      row.measured = share(true);
      none = none && *row.measured == 0;
      row.found = fmt::format("{}; {:.4f} % before the repairs",
                              *row.measured == 0 ? "agrees" : "differs", share(false));
      section.rows.push_back(std::move(row));
    }
  }

  // Errors are at the ends of rows, so checking those finds the first.
  const auto first = [&](const Variant& variant, std::uint64_t limit) {
    lab.say(fmt::format("repairs: where {} first fails", name_of(variant)));
    const std::uint64_t n = first_failure(variant, limit);
    Row row = plain_row(name_of(variant), 0, "first n with a wrong pair", "objects");
    if (variant.repair) row.paper_text = std::string("none");
    beyond += variant.repair;
    failing += variant.repair && n != 0;
    if (n == 0) {
      row.measured_text = fmt::format("none up to {}", report::format_count(limit));
      row.found = "searched from 2 objects on";
    } else {
      row.measured = static_cast<double>(n);
      const MappingErrors errors = count_errors(variant, n);
      row.found = fmt::format("{}thread {} is the first wrong one",
                              variant.repair ? "differs: the repairs do not fix it; " : "",
                              report::format_count(errors.first_index));
    }
    section.rows.push_back(std::move(row));
  };
  first(formula(RootKind::float32, 2, false), 5000);
  first(formula(RootKind::float32, 2, false, Radicand::real), 5000);
  first(formula(RootKind::float32, 2, true, Radicand::real), 6000);
  for (const RootKind root : {RootKind::carmack, RootKind::lomont})
    for (int steps = 1; steps <= max_steps; ++steps) first(formula(root, steps, false), 5000);
  first(formula(RootKind::carmack, 1, true), 2000);
  first(formula(RootKind::lomont, 1, true), 2000);

  // Too large to search from 2 on: checks n - 1 and n.
  const auto between = [&](const Variant& variant, std::uint64_t n, std::uint64_t limit) {
    if (n > limit) return;
    lab.say(fmt::format("repairs: {} at {} objects", name_of(variant), report::format_count(n)));
    const MappingErrors before = count_errors(variant, n - 1, 1), at = count_errors(variant, n, 1);
    Row row = plain_row(name_of(variant), n, "rows with a wrong end", "rows");
    if (variant.repair) row.paper = 0;
    beyond += variant.repair;
    failing += variant.repair && at.rows > 0;
    row.measured = static_cast<double>(at.rows);
    row.found = fmt::format(
        "{} objects: {}; {} objects: {}", report::format_count(n - 1),
        before.rows == 0 ? "none" : report::format_count(before.rows), report::format_count(n),
        at.rows == 0
            ? "none"
            : fmt::format("{}, the first wrong thread is {}", report::format_count(at.rows),
                          report::format_count(at.first_index)));
    section.rows.push_back(std::move(row));
  };
  const std::uint64_t limit = lab.sizes({1000000, 10000000, 200000000}, 1000000).empty()
                                  ? 0
                                  : lab.sizes({1000000, 10000000, 200000000}, 1000000).back();
  between(formula(RootKind::carmack, 2, true), 209992, limit);
  between(formula(RootKind::lomont, 2, true), 209934, limit);
  between(formula(RootKind::float32, 2, true), 8388611, limit);
  between(formula(RootKind::float64, 2, false, Radicand::real), 94906267, limit);
  between(formula(RootKind::float64, 2, false), 117440514, limit);

  // The same, computed directly: one thread.
  const Variant wide = formula(RootKind::float64, 2, false);
  Row row = plain_row(name_of(wide), 117440514, "thread 117,440,512", "");
  row.measured_text = std::string(right(wide, 117440512, row.n) ? "right" : "wrong");
  row.found = fmt::format("with one object fewer, that thread is {}",
                          right(wide, 117440512, row.n - 1) ? "right" : "wrong");
  section.rows.push_back(std::move(row));

  section.finding = fmt::format(
      "At the paper's numbers of tests the repairs leave {}; in {} of the {} repaired forms "
      "checked "
      "beyond those, pairs stay wrong.",
      none ? "no wrong pair, as it says" : "wrong pairs", failing, beyond);
  section.words = {
      "A row that is off by one is repaired exactly, whatever the root, if formula (2) is computed "
      "in "
      "integers: with row a-1 found for (a, b), (2) gives n + (b - a) > n, and the first repair "
      "gives (a, b) back; with row a+1 found it gives a + 1 + b - n <= a + 1, and the second does. "
      "A "
      "row that is off by two or more stays wrong, and may name an object that does not exist."};
  return section;
}

}  // namespace throng::paper
