#include "apps/throng/comparison.hpp"

#include <algorithm>

#include <fmt/format.h>

#include <throng/cuda.hpp>
#include <throng/finder.hpp>

#include "apps/throng/console.hpp"

namespace throng::cli {

using capture::Form;

FormRun run_form(Finder& finder, const Boxes& a, const Boxes* b, Form form, std::size_t capacity) {
  FormRun run;
  if (form == Form::growing) {
    run.result = b ? finder.find(a, *b) : finder.find(a);
    run.pairs = finder.pairs().data();
    run.count = finder.pairs().size();
  } else if (form == Form::buffer) {
    run.taken.resize(capacity);
    run.result = b ? finder.find(a, *b, run.taken.data(), capacity)
                   : finder.find(a, run.taken.data(), capacity);
    run.pairs = run.taken.data();
    run.count = static_cast<std::size_t>(run.result.written);
  } else {
    const auto take = [&](const Pair* block, std::size_t count) {
      run.taken.insert(run.taken.end(), block, block + count);
      return true;
    };
    run.result = b ? finder.consume(a, *b, take) : finder.consume(a, take);
    run.pairs = run.taken.data();
    run.count = run.taken.size();
  }
  return run;
}

std::string Comparison::head() {
  return fmt::format("  {:<9} {:<10} {:<8} {:>5} {:>14}  {}\n", "backend", "algorithm", "isa",
                     "runs", "fastest", "result");
}

std::string Comparison::Row::text() const {
  std::string text =
      fmt::format("  {:<9} {:<10} {:<8} {:>5} {:>14}  {}\n", to_string(backend),
                  to_string(algorithm), backend == Backend::cpu ? to_string(isa) : "-", runs,
                  skipped ? "-" : milliseconds(fastest_ms),
                  skipped            ? "skipped: too many comparisons, see --full"
                  : problems.empty() ? "agrees"
                                     : "DIFFERS");
  for (const std::string& line : problems) text += "    " + line + "\n";
  return text;
}

std::size_t Comparison::run(bool full, const std::function<void(const Row&)>& on_row) {
  on_row_ = on_row;
  const double n = static_cast<double>(a_.size());
  const double tests = b_ ? n * static_cast<double>(b_->size()) : 0.5 * n * n;
  // All-pairs is quadratic: where it would take minutes it is skipped, and the table says so.
  const double max_comparisons = !has(Isa::sse4) && !has(Isa::neon) ? 1e10 : 1e11;
  run_all_forms_ = full || (tests < 1e9 && expected_pairs_.pairs().size() < 2000000);
  for (const Algorithm algorithm : {Algorithm::automatic, Algorithm::grid, Algorithm::all_pairs}) {
    const bool skip_all_pairs = algorithm == Algorithm::all_pairs && !run_all_forms_;
    row(Backend::cpu, algorithm, Isa::automatic, skip_all_pairs && tests > max_comparisons);
    for (const Isa isa : all_isas)
      if (has(isa)) row(Backend::cpu, algorithm, isa, skip_all_pairs);
  }
  // The device pipeline on the CPU, and on a GPU where there is one.
  const bool gpu = cuda::available().ok();
  for (const Algorithm algorithm : {Algorithm::automatic, Algorithm::grid, Algorithm::all_pairs}) {
    const bool quadratic = algorithm == Algorithm::all_pairs;
    row(Backend::emulated, algorithm, Isa::automatic, quadratic && !run_all_forms_);
    if (gpu) row(Backend::cuda, algorithm, Isa::automatic, quadratic && tests > max_comparisons);
  }
  return differing_runs_;
}

void Comparison::row(Backend backend, Algorithm algorithm, Isa isa, bool skip) {
  Row row{backend, algorithm, isa, skip, 0, 1e300, {}};
  if (!skip) {
    std::vector<unsigned> threads = {1, 2, 5, 0};  // 0: all; 5: more than some machines have
    if (!run_all_forms_) threads = {0};
    for (const unsigned t : threads) {
      for (const Order order : {Order::any, Order::canonical}) one(row, t, order, Form::growing);
    }
    if (isa == Isa::automatic && (run_all_forms_ || algorithm != Algorithm::all_pairs)) {
      if (!run_all_forms_) one(row, 1, Order::any, Form::growing);
      for (const Form form : {Form::buffer, Form::consumer}) {
        one(row, 0, Order::any, form);
        one(row, 0, Order::canonical, form);
      }
    }
  }
  on_row_(row);
}

bool Comparison::has(Isa isa) const {
  const Box boxes[2] = {{{0, 0, 0}, {1, 1, 1}}, {{0, 0, 0}, {1, 1, 1}}};
  Options options;
  options.isa = isa;
  Finder finder(options);
  return finder.find(Boxes(boxes, 2)).status != Status::unsupported_isa;
}

void Comparison::one(Row& row, unsigned threads, Order order, Form form) {
  Options options = options_;
  options.backend = row.backend;
  options.algorithm = row.algorithm;
  options.isa = row.isa;
  options.threads = threads;
  options.order = order;
  Finder finder(options);
  const auto start = Clock::now();
  const FormRun run = run_form(finder, a_, b_, form, expected_pairs_.pairs().size());
  row.fastest_ms = std::min(row.fastest_ms, ms_since(start));
  ++row.runs;
  const Result& result = run.result;
  const char* forms[] = {"growing", "caller's buffer", "consumer"};
  const std::string name =
      fmt::format("{} threads, {} order, {}", threads ? fmt::to_string(threads) : "all",
                  order == Order::any ? "any" : "canonical", forms[static_cast<int>(form)]);
  std::vector<std::string> wrong;
  if (!result.ok()) {
    wrong.push_back(result.message[0] ? result.message : to_string(result.status));
  } else {
    wrong = expected_pairs_.differences(run.pairs, run.count, order == Order::canonical);
    if (!wrong.empty() && !first_ && expected_pairs_.first()) {
      first_ = {fmt::format("{}, {}, {}, {}", to_string(row.backend), to_string(row.algorithm),
                            to_string(row.isa), name),
                *expected_pairs_.first()};
    }
    if (result.found != expected_pairs_.pairs().size()) {
      wrong.push_back(fmt::format("reported {} pairs, wanted {}", result.found,
                                  expected_pairs_.pairs().size()));
    }
    if (result.inactive != expected_pairs_.inactive()) {
      wrong.push_back(fmt::format("reported {} inactive boxes, wanted {}", result.inactive,
                                  expected_pairs_.inactive()));
    }
  }
  if (wrong.empty()) return;
  ++differing_runs_;
  row.problems.push_back(name + ":");
  for (const std::string& line : wrong) row.problems.push_back("  " + line);
}

}  // namespace throng::cli
