// throng check: every backend, algorithm, instruction set, thread count, order and form against two
// loops.
#include <algorithm>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include <throng/cuda.hpp>
#include <throng/finder.hpp>

#include "cli/commands.hpp"
#include "cli/console.hpp"
#include "cli/failure.hpp"
#include "cli/input.hpp"
#include "cli/truth.hpp"
#include "report/format.hpp"

namespace throng::cli {
namespace {

const char* help_text =
    R"(Compares, pair by pair, what every algorithm finds with every instruction set that this
processor has, with several numbers of threads, in both orders, with what a double loop of its own
finds. The double loop compares every box with every other: 300,000 boxes take some seconds,
a million some minutes. On large inputs fewer threads and orders are tried, and all-pairs only once;
--full tries everything.

Examples:
  throng check boxes.npy
  throng check robots.npy scene.npy --margin 0.01
  throng check worlds.npy --world worlds-world.npy
  throng check recording.npy --frames 10
Exit status: 0 all agree, 1 something differs, 2 bad input.)";

struct Arguments {
  InputArguments input;
  std::size_t frames = 3;
  bool full = false;
};

enum class Form { growing, buffer, consumer };

class Check {
 public:
  Check(const Input& input, const Options& options, std::size_t frame)
      : input_(input), options_(options), frame_(frame), a_(input.a().frame(frame)) {
    if (input.b()) b_ = input.b()->frame(frame);
  }

  // Gives the number of runs that differ.
  std::size_t run(bool full) {
    // First, so that boxes which the library refuses are told in no time.
    Finder probe(options_);
    Result result = b_ ? probe.find(a_, *b_) : probe.find(a_);
    require_ok(result, input_, frame_);
    Progress progress("double loop: box", a_.size());
    Truth truth(a_, b_ ? &*b_ : nullptr, options_.margin,
                [&](std::size_t done) { progress.at(done); });
    progress.wipe();
    truth_ = &truth;
    say(fmt::format(
        "{}: {} boxes{}, {} pairs, {} inactive by the double loop\n", input_.name(frame_),
        report::format_count(a_.size()), b_ ? " and " + report::format_count(b_->size()) : "",
        report::format_count(truth.pairs().size()), report::format_count(truth.inactive())));
    say(fmt::format("  {:<9} {:<10} {:<8} {:>5} {:>14}  {}\n", "backend", "algorithm", "isa",
                    "runs", "fastest", "result"));
    const double n = static_cast<double>(a_.size());
    const double tests = b_ ? n * static_cast<double>(b_->size()) : 0.5 * n * n;
    // All-pairs is quadratic: where it would take minutes it is left out, and the table says so.
    const double bearable = result.plan.isa == Isa::scalar ? 1e10 : 1e11;
    const bool small = full || (tests < 1e9 && truth.pairs().size() < 2000000);
    for (const Algorithm algorithm :
         {Algorithm::automatic, Algorithm::grid, Algorithm::all_pairs}) {
      for (const Isa isa :
           {Isa::automatic, Isa::scalar, Isa::sse4, Isa::avx2, Isa::avx512, Isa::neon}) {
        const bool skip = algorithm == Algorithm::all_pairs && !small &&
                          (isa != Isa::automatic || tests > bearable);
        row(Backend::cpu, algorithm, isa, small, skip);
      }
    }
    // What a GPU runs, on this processor; and on a GPU, where there is one.
    const bool gpu = cuda::available().ok();
    for (const Algorithm algorithm :
         {Algorithm::automatic, Algorithm::grid, Algorithm::all_pairs}) {
      const bool quadratic = algorithm == Algorithm::all_pairs;
      row(Backend::emulated, algorithm, Isa::automatic, small, quadratic && !small);
      if (gpu) row(Backend::cuda, algorithm, Isa::automatic, small, quadratic && tests > bearable);
    }
    return differing_;
  }

 private:
  void row(Backend backend, Algorithm algorithm, Isa isa, bool small, bool skip) {
    const std::string head =
        fmt::format("  {:<9} {:<10} {:<8}", to_string(backend), to_string(algorithm),
                    backend == Backend::cpu ? to_string(isa) : "-");
    backend_ = backend;
    if (!skip && !has(isa)) return;
    if (skip) {
      if (isa == Isa::automatic || has(isa)) {
        say(head +
            fmt::format(" {:>5} {:>14}  skipped: too many comparisons, see --full\n", 0, "-"));
      }
      return;
    }
    runs_ = 0;
    fastest_ms_ = 1e300;
    complaints_.clear();
    std::vector<unsigned> threads = {1, 2, 5, 0};  // 0: all; 5: more than some machines have
    if (!small) threads = {0};
    for (const unsigned t : threads) {
      for (const Order order : {Order::any, Order::canonical}) {
        one(algorithm, isa, t, order, Form::growing);
      }
    }
    if (isa == Isa::automatic && (small || algorithm != Algorithm::all_pairs)) {
      if (!small) one(algorithm, isa, 1, Order::any, Form::growing);
      for (const Form form : {Form::buffer, Form::consumer}) {
        one(algorithm, isa, 0, Order::any, form);
        one(algorithm, isa, 0, Order::canonical, form);
      }
    }
    say(head + fmt::format(" {:>5} {:>14}  {}\n", runs_, milliseconds(fastest_ms_),
                           complaints_.empty() ? "agrees" : "DIFFERS"));
    for (const std::string& line : complaints_) say("    " + line + "\n");
    finish_output();  // a row may take seconds: let it be seen
  }

  bool has(Isa isa) const {
    const Box boxes[2] = {{{0, 0, 0}, {1, 1, 1}}, {{0, 0, 0}, {1, 1, 1}}};
    Options options;
    options.isa = isa;
    Finder finder(options);
    return finder.find(Boxes(boxes, 2)).status != Status::unsupported_isa;
  }

  void one(Algorithm algorithm, Isa isa, unsigned threads, Order order, Form form) {
    Options options = options_;
    options.backend = backend_;
    options.algorithm = algorithm;
    options.isa = isa;
    options.threads = threads;
    options.order = order;
    Finder finder(options);
    std::vector<Pair> taken;
    const Pair* pairs = nullptr;
    Result result;
    const auto start = Clock::now();
    if (form == Form::growing) {
      result = b_ ? finder.find(a_, *b_) : finder.find(a_);
      pairs = finder.pairs().data();
    } else if (form == Form::buffer) {
      taken.resize(truth_->pairs().size());
      result = b_ ? finder.find(a_, *b_, taken.data(), taken.size())
                  : finder.find(a_, taken.data(), taken.size());
      pairs = taken.data();
    } else {
      const auto take = [&](const Pair* block, std::size_t count) {
        taken.insert(taken.end(), block, block + count);
        return true;
      };
      result = b_ ? finder.consume(a_, *b_, take) : finder.consume(a_, take);
      pairs = taken.data();
    }
    fastest_ms_ = std::min(fastest_ms_, ms_since(start));
    ++runs_;
    std::vector<std::string> wrong;
    if (!result.ok()) {
      wrong.push_back(result.message[0] ? result.message : to_string(result.status));
    } else {
      const std::size_t count = form == Form::growing    ? finder.pairs().size()
                                : form == Form::consumer ? taken.size()
                                                         : static_cast<std::size_t>(result.written);
      wrong = truth_->differences(pairs, count, order == Order::canonical);
      if (result.found != truth_->pairs().size()) {
        wrong.push_back(
            fmt::format("told {} pairs, wanted {}", result.found, truth_->pairs().size()));
      }
      if (result.inactive != truth_->inactive()) {
        wrong.push_back(
            fmt::format("told {} inactive boxes, wanted {}", result.inactive, truth_->inactive()));
      }
    }
    if (wrong.empty()) return;
    ++differing_;
    const char* forms[] = {"growing", "caller's buffer", "consumer"};
    complaints_.push_back(
        fmt::format("{} threads, {} order, {}:", threads ? fmt::to_string(threads) : "all",
                    order == Order::any ? "any" : "canonical", forms[static_cast<int>(form)]));
    for (const std::string& line : wrong) complaints_.push_back("  " + line);
  }

  const Input& input_;
  const Options options_;
  const std::size_t frame_;
  const Boxes a_;
  std::optional<Boxes> b_;
  Truth* truth_ = nullptr;
  Backend backend_ = Backend::cpu;
  std::size_t differing_ = 0, runs_ = 0;
  double fastest_ms_ = 0;
  std::vector<std::string> complaints_;
};

int run(const Arguments& arguments) {
  const Input input(arguments.input);
  const Options options = to_options(arguments.input, SearchArguments{});
  const std::size_t all = input.frames();
  const std::size_t wanted = arguments.full ? all : std::min(arguments.frames, all);
  std::size_t differing = 0;
  for (std::size_t k = 0; k < wanted; ++k) {
    // Evenly spread, the first and the last among them.
    const std::size_t frame = wanted > 1 ? k * (all - 1) / (wanted - 1) : 0;
    try {
      differing += Check(input, options, frame).run(arguments.full);
    } catch (const std::bad_alloc&) {
      throw Failure(
          fmt::format("{}: out of memory; the double loop keeps {} bytes a pair, twice "
                      "over",
                      input.name(frame), sizeof(Pair)));
    }
  }
  if (wanted < all) {
    say(fmt::format("{} of {} frames were checked; --frames N checks more\n", wanted, all));
  }
  say(differing ? fmt::format("{} runs DIFFER from the double loop\n", differing)
                : std::string("all agree with the double loop\n"));
  return differing ? exit_differs : exit_done;
}

}  // namespace

Run add_check(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("check", "Compare every algorithm with a double loop");
  app.footer(help_text);
  add_input_arguments(app, arguments->input);
  app.add_option("--frames", arguments->frames, "of several frames, check so many (3)")
      ->check(CLI::Range(1, 1000000000).description(""))
      ->type_name("N");
  app.add_flag("--full", arguments->full, "everything, whatever it takes");
  return [arguments] { return run(*arguments); };
}

}  // namespace throng::cli
