// Tables 3 and 4: the error rates of fast square roots, the effect of the repairs, and the speed.
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "apps/paper/cuda.hpp"
#include "apps/paper/evaluation/experiments.hpp"
#include "apps/paper/root_shares.hpp"
#include "apps/paper/variant.hpp"
#include "apps/report/format.hpp"
#include "base/pair_index.hpp"

namespace throng::paper {
namespace {

struct Constant {
  const char* name;
  std::uint32_t bits;
  RootKind kind;
};
constexpr Constant constants[] = {{"Carmack", carmack_constant, RootKind::carmack},
                                  {"Lomont", lomont_constant, RootKind::lomont}};

// The paper's Table 3, as printed.
struct Printed {
  int steps;
  const char* constant;
  const char* share[6];
};
constexpr Printed printed[] = {
    {2, "Carmack", {"2.9", "0.89", "0.27", "0.1800", "0.3681", "0.9847"}},
    {2, "Lomont", {"2.9", "0.89", "0.27", "0.1803", "0.3685", "0.9855"}},
    {3, "Carmack", {"0.7", "0.12", "0.035", "0.0110", "0.0040", "0.0134"}},
    {3, "Lomont", {"0.7", "0.12", "0.035", "0.0111", "0.0057", "0.0142"}}};
constexpr std::uint64_t tests_of_table3[] = {1000, 10000, 100000, 1000000, 10000000, 100000000};

// The share truncated (or rounded) to the printed number of digits.
bool matches_printed(double share, const std::string& text, bool cut) {
  const std::size_t point = text.find('.');
  const int digits = static_cast<int>(text.size() - point - 1);
  const double scale = std::pow(10.0, digits);
  const double at = share * scale;
  // The share is a ratio of integers: a small value is added so that 0.27 is not 0.269999...
  const double whole = cut ? std::floor(at + 1e-9 * scale) : std::round(at);
  return fmt::format("{:.{}f}", whole / scale, digits) == text;
}

struct Definition {
  bool wide;
  LastOperation last;
  std::string name() const {
    return fmt::format("{}, {}", last == LastOperation::product ? "x*y" : "1/y",
                       wide ? "steps wider than float" : "all in float");
  }
};
constexpr Definition definitions[] = {{true, LastOperation::product},
                                      {true, LastOperation::reciprocal},
                                      {false, LastOperation::product},
                                      {false, LastOperation::reciprocal}};

double percent(std::uint64_t part, std::uint64_t all) {
  return 100.0 * static_cast<double>(part) / static_cast<double>(all);
}

}  // namespace

Section table3(const Lab& lab) {
  Section section("table3", "Table 3: wrong integer square roots, before repair");
  const std::vector<std::uint64_t> tests =
      lab.sizes({std::begin(tests_of_table3), std::end(tests_of_table3)}, 10000000);
  if (tests.empty()) return section;

  report::Table all("All definitions tried: wrong integer roots of i = 0 .. N-1", {"root"});
  std::vector<std::string> columns = {"root", "last operation", "steps"};
  for (const std::uint64_t n : tests) columns.push_back(report::format_short(n));
  all = report::Table(all.title(), columns);
  // counts[steps][constant][definition][test]
  std::vector<std::uint64_t> counts[max_steps + 1][2][4];
  // Whether the root of N itself, and that of 0, is wrong: for counting from 1 to N.
  std::vector<std::uint64_t> past[max_steps + 1][2][4];
  std::uint64_t zero[max_steps + 1][2][4] = {};
  std::vector<std::uint64_t> ends = {1};
  for (const std::uint64_t n : tests) {
    ends.push_back(n);
    ends.push_back(n + 1);
  }
  for (int steps = min_steps; steps <= max_steps; ++steps)
    for (std::size_t c = 0; c < 2; ++c)
      for (std::size_t d = 0; d < 4; ++d) {
        lab.say(fmt::format("Table 3: {}, {} steps, {}", constants[c].name, steps,
                            definitions[d].name()));
        const std::vector<std::uint64_t> found =
            wrong_roots({constants[c].bits, steps, definitions[d].wide, definitions[d].last}, ends);
        zero[steps][c][d] = found[0];
        for (std::size_t i = 1; i < found.size(); i += 2) {
          counts[steps][c][d].push_back(found[i]);
          past[steps][c][d].push_back(found[i + 1] - found[i]);
        }
        std::vector<std::string> cells = {constants[c].name, definitions[d].name(),
                                          std::to_string(steps)};
        for (const std::uint64_t count : counts[steps][c][d]) {
          cells.push_back(report::format_count(count));
        }
        all.add_row(cells);
      }

  std::size_t agree = 0;
  for (const Printed& p : printed) {
    const std::size_t c = std::string(p.constant) == "Lomont";
    // The definition that matches most of the printed row represents it.
    std::size_t best = 0, most = 0;
    for (std::size_t d = 0; d < 4; ++d) {
      std::size_t same = 0;
      for (std::size_t i = 0; i < tests.size(); ++i) {
        same += matches_printed(percent(counts[p.steps][c][d][i], tests[i]), p.share[i], true);
      }
      if (same > most) most = same, best = d;
    }
    for (std::size_t i = 0; i < tests.size(); ++i) {
      Row row;
      row.what = fmt::format("{}, {} steps", p.constant, p.steps);
      row.n = tests[i];
      row.quantity = definitions[best].name();
      row.unit = "%";
      row.paper = std::stod(p.share[i]);
      row.paper_text = p.share[i];
      row.measured = percent(counts[p.steps][c][best][i], tests[i]);
      if (matches_printed(*row.measured, p.share[i], true)) {
        ++agree;
        row.found = "agrees to the printed digits, cut off";
      } else if (matches_printed(*row.measured, p.share[i], false)) {
        ++agree;
        row.found = "agrees to the printed digits, rounded";
      } else {
        std::string others;
        for (std::size_t d = 0; d < 4; ++d) {
          if (matches_printed(percent(counts[p.steps][c][d][i], tests[i]), p.share[i], true)) {
            others += (others.empty() ? "" : "; ") + definitions[d].name();
          }
        }
        const std::uint64_t from_one =
            counts[p.steps][c][best][i] + past[p.steps][c][best][i] - zero[p.steps][c][best];
        if (matches_printed(percent(from_one, tests[i]), p.share[i], true)) {
          row.found =
              fmt::format("differs from the rest of its row: so it is for i = 1 .. N, {} wrong",
                          report::format_count(from_one));
        } else {
          row.found = others.empty()
                          ? fmt::format("differs: none of the definitions tried gives these digits")
                          : fmt::format("differs from the rest of its row: here it is {}", others);
        }
      }
      section.rows.push_back(std::move(row));
    }
  }
  for (std::size_t c = 0; c < 2; ++c) {
    // "The percentage of error with 4 steps is exactly the same as with 3."
    const auto& three = counts[3][c][1];
    const auto& four = counts[4][c][1];
    for (std::size_t i = 0; i < tests.size(); ++i) {
      Row row;
      row.what = fmt::format("{}, 4 steps beyond 3", constants[c].name);
      row.n = tests[i];
      row.quantity = definitions[1].name();
      row.unit = "wrong roots";
      row.paper = 0;
      row.measured = static_cast<double>(four[i]) - static_cast<double>(three[i]);
      row.found = four[i] == three[i]
                      ? "agrees: exactly as many as with 3 steps"
                      : fmt::format("differs: {} with 4 steps, {} with 3",
                                    report::format_count(four[i]), report::format_count(three[i]));
      section.rows.push_back(std::move(row));
    }
  }
  section.finding = fmt::format(
      "{} of {} printed shares come out in their digits. The rows of two and of three steps need "
      "different last operations: {} and {}.",
      agree, std::size(printed) * tests.size(), section.rows.front().quantity,
      section.rows[2 * tests.size()].quantity);
  section.words = {
      "Counted: of i = 0 .. N-1 those whose fast root has another integer part than the hardware's "
      "root of the same float. The paper does not say how it computed; four definitions are tried, "
      "and the one that matches most of a printed row represents it."};
  section.tables.push_back(std::move(all));
  return section;
}

Section table4(const Lab& lab) {
  Section section("table4", "Table 4: the time of square roots");
  struct PaperRow {
    std::uint64_t n;
    double carmack, lomont, hardware, gain;
  };
  static constexpr PaperRow paper_rows[] = {{1000000, 0.042, 0.042, 0.048, 12.6},
                                            {10000000, 0.409, 0.409, 0.478, 14.7},
                                            {100000000, 4.102, 4.102, 4.722, 13.2},
                                            {1000000000, 41.01, 41.01, 48.01, 14.6}};
  const auto paper_row_for = [&](std::uint64_t n) -> const PaperRow* {
    for (const PaperRow& g : paper_rows) {
      if (g.n == n) return &g;
    }
    return nullptr;
  };
  std::vector<std::uint64_t> counts =
      lab.sizes({1000000, 10000000, 100000000, 1000000000}, 10000000);
  if (counts.empty()) counts = {lab.setting().up_to};
  for (const DeviceKind device : lab.devices()) {
    report::Plot plot{"Table 4, " + lab.name(device), "square roots", "ms", true, true, {}};
    report::Series lines[3] = {{"hardware, float32", {}, {}, true, false},
                               {"Carmack, 2 steps", {}, {}, false, false},
                               {"Carmack, 3 steps", {}, {}, false, false}};
    report::Series paper{"paper: CUDA", {}, {}, false, true};
    std::string gains;
    for (const std::uint64_t n : counts) {
      const PaperRow* const g = paper_row_for(n);
      const auto time = [&](const std::string& what, RootKind kind, int steps) {
        lab.say(fmt::format("Table 4: {} roots, {}, {}", report::format_short(n), what,
                            lab.name(device)));
        const int repeat = n > 100000000 && device == DeviceKind::cpu ? 1 : lab.repeat();
        const RootTime t = device == DeviceKind::cuda
                               ? time_roots_on_cuda(kind, steps, n, repeat)
                               : time_roots_on_host(kind, steps, n, repeat, lab.setting().threads);
        Row row = lab.row(what, n, "", "ms", device);
        row.measured = t.ms;
        row.checksum = t.sum;
        return row;
      };
      Row hardware = time("hardware, float32", RootKind::float32, 1);
      if (g) hardware.paper = g->hardware;
      hardware.found = speed_sentence(hardware);
      lines[0].x.push_back(static_cast<double>(n));
      lines[0].y.push_back(*hardware.measured);
      if (g) paper.x.push_back(static_cast<double>(n));
      if (g) paper.y.push_back(g->hardware);
      section.rows.push_back(hardware);
      section.rows.push_back(time("hardware, float64", RootKind::float64, 1));
      for (int steps = min_steps; steps <= max_steps; ++steps) {
        for (const Constant& c : constants) {
          Row row = time(fmt::format("{}, {} steps", c.name, steps), c.kind, steps);
          // The paper does not say how many steps it timed; Table 3 has two and three.
          if (steps == 2 && g) row.paper = c.kind == RootKind::carmack ? g->carmack : g->lomont;
          const double gain = 100 * (1 - *row.measured / *hardware.measured);
          row.found = gain > 0 ? fmt::format("{:.1f} % less than the hardware's", gain)
                               : fmt::format("{:.1f} % more than the hardware's", -gain);
          if (c.kind == RootKind::carmack && (steps == 2 || steps == 3)) {
            lines[steps - 1].x.push_back(static_cast<double>(n));
            lines[steps - 1].y.push_back(*row.measured);
          }
          section.rows.push_back(row);
          if (c.kind != RootKind::carmack || steps != 2) continue;
          Row saved = lab.row("saved by Carmack, 2 steps", n, "", "% of the time", device);
          if (g) saved.paper = g->gain;
          saved.measured = gain;
          saved.found = gain > 0 ? "agrees in kind: the fast root is faster here, too"
                                 : "differs: here the hardware's root is faster";
          section.rows.push_back(saved);
          gains += fmt::format("{}{} at {}", gains.empty() ? "" : ", ",
                               report::format_ratio(*row.measured / *hardware.measured),
                               report::format_short(n));
        }
      }
    }
    for (report::Series& line : lines) plot.series.push_back(std::move(line));
    plot.series.push_back(std::move(paper));
    section.plots.push_back(std::move(plot));
    section.finding += fmt::format(
        "On {} the fast root with two steps takes {} the time of the hardware's (paper: 0.85x to "
        "0.87x). ",
        lab.name(device), gains);
  }
  section.words = {
      "The same loop for every kind: the root of an integer, its integer part, added to a sum that "
      "is checked. Two steps are compared with the paper's figures, which do not say how many they "
      "are. "
      "Processors and cards of today round a float32 root correctly in one instruction, which the "
      "fast "
      "root's constant was made to avoid."};
  return section;
}

}  // namespace throng::paper
