// throng-paper roots: how often fast square roots are wrong, what that does to pairs, and how fast
// they are.
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "paper/commands.hpp"
#include "paper/cuda.hpp"
#include "paper/failure.hpp"
#include "paper/input.hpp"
#include "paper/root_shares.hpp"
#include "program/numbers.hpp"
#include "report/format.hpp"

namespace throng::paper {
namespace {

const char* help_text =
    R"(Three tables. Shares: of i = 0 .. N-1, how many have floor(fast root) != floor(hardware root), in %
(Table 3 of the paper), with Newton steps evaluated in double or in float, and x*y or 1/y as the last
operation. Pairs: for n objects, the share of indices whose pair is wrong before and after the repairs,
and of rows whose first or last pair is. Times: N roots, nothing else (Table 4).

Examples:
  throng-paper roots --up-to 1M
  throng-paper roots --up-to 100M --device cuda --repeat 11)";

struct Arguments {
  std::string up_to = "1M", objects = "10K", device = "cpu";
  int repeat = 5;
  unsigned threads = 1;
};

struct Named {
  const char* name;
  RootKind kind;
  std::uint32_t constant;
};
constexpr Named fast_roots[] = {{"Carmack", RootKind::carmack, carmack_constant},
                                {"Lomont", RootKind::lomont, lomont_constant}};

std::string shares(const std::vector<std::uint64_t>& tests) {
  std::string text = fmt::format("{:<34}", "wrong integer roots, %");
  for (const std::uint64_t n : tests) text += fmt::format("{:>10}", report::format_short(n));
  text += "\n";
  for (int steps = min_steps; steps <= max_steps; ++steps)
    for (const Named& root : fast_roots)
      for (const bool wide : {true, false})
        for (const LastOperation last : {LastOperation::product, LastOperation::reciprocal}) {
          const auto wrong = wrong_roots({root.constant, steps, wide, last}, tests);
          text += fmt::format(
              "{:<34}", fmt::format("{} {}, {}, {}", root.name, steps, wide ? "double" : "float",
                                    last == LastOperation::product ? "x*y" : "1/y"));
          for (std::size_t i = 0; i < tests.size(); ++i) {
            text += fmt::format(
                "{:>10.4f}", 100.0 * static_cast<double>(wrong[i]) / static_cast<double>(tests[i]));
          }
          text += "\n";
        }
  return text;
}

// The roots of the formula, each before and after the repairs: the share of indices of n objects
// that get a wrong pair, and, where those are too many to walk, of rows with a wrong end.
std::string pairs(std::uint64_t objects) {
  const std::uint64_t walked[] = {1000, 4097, 4098, objects};
  static constexpr std::uint64_t ends[] = {100000, 1000000};
  std::string text = fmt::format("\n{:<22}", "wrong, %, n =");
  for (const std::uint64_t n : walked) text += fmt::format("{:>14}", report::format_count(n));
  for (const std::uint64_t n : ends)
    text += fmt::format("{:>16}", report::format_count(n) + " rows");
  text += "\n";
  const auto share = [](std::uint64_t wrong, double all, int width) {
    return wrong == 0 ? fmt::format("{:>{}}", 0, width)
                      : fmt::format("{:>{}.6f}", 100.0 * static_cast<double>(wrong) / all, width);
  };
  const auto row = [&](const Variant& variant, std::string name) {
    if (variant.repair) name += ", repaired";
    text += fmt::format("{:<22}", name);
    for (const std::uint64_t n : walked) {
      text += share(count_faults(variant, n).indices, static_cast<double>(thread_count(variant, n)),
                    14);
    }
    for (const std::uint64_t n : ends) {
      text += share(count_faults(variant, n, 1).rows, static_cast<double>(n), 16);
    }
    text += "\n";
  };
  for (const bool repair : {false, true}) {
    Variant variant;
    variant.repair = repair;
    row(variant, "float32");
    variant.root = RootKind::float64;
    row(variant, "float64");
    for (const Named& root : fast_roots)
      for (variant.steps = min_steps; variant.steps <= max_steps; ++variant.steps) {
        variant.root = root.kind;
        row(variant, fmt::format("{} {}", root.name, variant.steps));
      }
  }
  return text;
}

std::string times(const Arguments& a, const std::vector<std::uint64_t>& tests) {
  const bool cuda = a.device == "cuda";
  std::string text = fmt::format("\n{:<34}", fmt::format("ms for N roots, {}", a.device));
  for (const std::uint64_t n : tests) text += fmt::format("{:>10}", report::format_short(n));
  text += "\n";
  const auto row = [&](const std::string& name, RootKind kind, int steps) {
    text += fmt::format("{:<34}", name);
    for (const std::uint64_t n : tests) {
      const RootTime time = cuda ? time_roots_on_cuda(kind, steps, n, a.repeat)
                                 : time_roots_on_host(kind, steps, n, a.repeat, a.threads);
      text += fmt::format("{:>10}", report::format_ms(time.ms));
    }
    text += "\n";
  };
  for (const Named& root : fast_roots)
    for (int steps = min_steps; steps <= max_steps; ++steps)
      row(fmt::format("{} {}", root.name, steps), root.kind, steps);
  row("hardware float32", RootKind::float32, 1);
  row("hardware float64", RootKind::float64, 1);
  return text;
}

int run(const Arguments& a) {
  const std::uint64_t up_to = program::parse_count(a.up_to, "--up-to");
  if (up_to < 1000 || up_to >= std::uint64_t{1} << 32) {
    throw Failure(fmt::format("--up-to: found {}, wanted 1K to 4G", a.up_to));
  }
  const std::uint64_t objects = program::parse_count(a.objects, "--objects");
  if (objects < 2 || objects > 1000000) {
    throw Failure(fmt::format("--objects: found {}, wanted 2 to 1M", a.objects));
  }
  if (a.device == "cuda") {
    const std::string reason = why_no_cuda();
    if (!reason.empty()) throw Failure("--device cuda: " + reason);
  }
  std::vector<std::uint64_t> tests;
  for (std::uint64_t n = 1000; n <= up_to; n *= 10) tests.push_back(n);
  if (tests.back() != up_to) tests.push_back(up_to);
  say(shares(tests));
  say(pairs(objects));
  say(times(a, tests));
  return exit_done;
}

}  // namespace

Run add_roots(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("roots", "How wrong and how fast square roots are");
  app.footer(help_text);
  app.add_option("--up-to", a->up_to, "the largest N (1M); the paper's are 100M and, for times, 1G")
      ->type_name("N");
  app.add_option("--objects", a->objects, "a number of objects to count wrong pairs for (10K)")
      ->type_name("N");
  app.add_option("--device", a->device, "where to take the times (cpu)")
      ->check(CLI::IsMember({"cpu", "cuda"}).description(""))
      ->type_name("cpu|cuda");
  app.add_option("--threads", a->threads, "threads of the cpu (1)")
      ->check(CLI::Range(1, 1024).description(""))
      ->type_name("N");
  app.add_option("--repeat", a->repeat, "runs to take the median of (5)")
      ->check(CLI::Range(1, 1000000).description(""))
      ->type_name("K");
  return [a] { return run(*a); };
}

}  // namespace throng::paper
