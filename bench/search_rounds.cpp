#include "bench/search_rounds.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>

#include <throng/checksum.hpp>

#if defined(__linux__)
#include <unistd.h>
#endif

#include <fmt/format.h>

#include "apps/common/median.hpp"
#include "apps/report/format.hpp"
#include "bench/machine.hpp"
#include "bench/per_world.hpp"
#include "bench/throng_methods.hpp"
#include "bench/timing.hpp"

namespace throng::bench {
namespace {

std::string key(const Case& c, const MethodInfo& e, unsigned threads = 0) {
  return c.scene.label + "|" + e.name + "|" + std::to_string(threads);
}

}  // namespace

struct SearchRounds::Runner {
  const MethodInfo* info;
  std::size_t index;
  Measurement row;
  std::unique_ptr<Method> method;
  std::vector<double> samples;
  double spent = 0, last = 0, prepared = 0, first = 0;  // seconds
  std::size_t inner = 1;                                // frames per round
  std::size_t frame = 0;                                // the last one that ran
};

SearchRounds::SearchRounds(Settings settings, std::vector<MethodInfo> methods)
    : settings_(std::move(settings)), methods_(std::move(methods)), start_(now_seconds()) {}

double SearchRounds::seconds() const { return now_seconds() - start_; }

// Each measurement of memory makes the scene again in another process: only the useful ones.
bool SearchRounds::measures_memory(const Runner& r, const Case& c) const {
  const Measurement& row = r.row;
  if (row.ms > 500 || c.objects < 10000) return false;
  if (r.info->parallel && row.threads != settings_.threads.back()) return false;
  if (row.origin == Origin::throng && row.method != throng_name && row.method != "Throng, sorted")
    return false;
  const std::string& scene = c.scene.label;
  return c.objects <= 200000 || c.scene.name.empty() || scene == "uniform" || scene == "pile" ||
         scene == "mixed";
}

std::string SearchRounds::reason_to_skip(const MethodInfo& e, unsigned threads,
                                         const Case& c) const {
  if (e.name == "Throng, all pairs" && c.objects > all_pairs_limit) {
    return fmt::format("only up to {} boxes", report::format_short(all_pairs_limit));
  }
  const auto slower = dropped_.find(key(c, e));
  if (slower != dropped_.end()) return "slower than '" + slower->second + "' at a smaller size";
  const auto past = past_.find(key(c, e, threads));
  if (past == past_.end() || past->second.objects >= c.objects) return "";
  const Past& p = past->second;
  if (e.origin == Origin::throng) return "";
  if (p.seconds > settings_.limit_seconds) {
    return fmt::format("took {:.1f} s at {}", p.seconds, report::format_short(p.objects));
  }
  const double predicted = p.seconds * std::pow(double(c.objects) / double(p.objects), p.exponent);
  if (predicted > 4 * settings_.limit_seconds) {
    return fmt::format("took {:.2g} s at {} and would take about {:.0f} s here", p.seconds,
                       report::format_short(p.objects), predicted);
  }
  if (seconds() + 4 * predicted > settings_.budget_seconds) {
    return fmt::format("would take about {:.1f} s, and the time for this run is spent", predicted);
  }
  return "";
}

void SearchRounds::run_once(Runner& r, const Case& c, std::size_t frame, bool timed) {
  const Input in = c.input(frame);
  r.method->place(in);
  const double begin = now_seconds();
  r.method->run(in);
  const double took = now_seconds() - begin;
  r.spent += took;
  r.last = took;
  if (timed) r.samples.push_back(1000 * took);
}

std::vector<Measurement> SearchRounds::measure(const Case& c) {
  expected_.clear();
  std::vector<Runner> runners;
  std::vector<Measurement> rows;
  for (std::size_t i = 0; i < methods_.size(); ++i) {
    const MethodInfo& original = methods_[i];
    const bool split = !c.worlds.empty() && original.origin != Origin::throng;
    for (const unsigned threads : settings_.threads) {
      if (threads != settings_.threads.front() && !original.parallel && !split) continue;
      Runner r{&original, i, {}, nullptr, {}};
      r.row.scene = c.scene.label;
      r.row.objects = c.objects;
      r.row.method = original.name;
      r.row.origin = original.origin;
      r.row.threads = threads;
      r.row.note = reason_to_skip(original, threads, c);
      if (r.row.note.empty()) {
        const MethodInfo e = split ? one_world_at_a_time(original) : original;
        r.row.note = e.note;
        r.method = e.make(threads);
      }
      runners.push_back(std::move(r));
    }
  }

  // Compares the pairs of the last frame. The first method is the library's own and sets what is
  // expected of a frame; the tests compare that with a double loop.
  std::vector<Pair> pairs;
  const auto verify = [&](Runner& r, std::size_t frame) {
    const std::size_t f = c.index(frame);
    pairs.clear();
    r.method->collect(c.input(frame), pairs);
    const Expected got{pairs.size(), pair_checksum(pairs.data(), pairs.size())};
    const auto [it, fresh] = expected_.emplace(f, got);
    if (!fresh && (it->second.pairs != got.pairs || it->second.checksum != got.checksum))
      r.row.agrees = false;
    if (f == 0) {
      r.row.pairs = got.pairs;
      r.row.checksum = got.checksum;
    }
  };

  for (Runner& r : runners) {
    if (!r.method) continue;
    if (settings_.progress)
      settings_.progress(fmt::format("{}, {}: {}, {} thread{}", c.scene.label,
                                     report::format_short(c.objects), r.row.method, r.row.threads,
                                     r.row.threads == 1 ? "" : "s"));
    const double begin = now_seconds();
    r.method->prepare(c.input(0));
    r.prepared = now_seconds() - begin;
    run_once(r, c, 0, false);
    verify(r, 0);
    const double first = r.first = r.last;
    r.spent = 0;
    if (r.prepared + first < settings_.method_seconds && c.frames.size() > 1)
      run_once(r, c, ++r.frame, false);
    r.first = std::max(r.first, r.last);  // the first move may cost more than later ones
    // A warmed frame; of slow methods the first.
    const double typical = std::max(r.spent > 0 ? r.spent : first, 1e-7);
    r.inner = static_cast<std::size_t>(std::clamp(0.008 / typical, 1.0, 64.0));
    r.spent = 0;
  }
  for (int round = 0; round < settings_.rounds; ++round) {
    for (std::size_t k = 0; k < runners.size(); ++k) {
      Runner& r = runners[(k + static_cast<std::size_t>(round)) % runners.size()];
      if (!r.method || r.spent > settings_.method_seconds) continue;
      if (settings_.progress)
        settings_.progress(fmt::format("{}, {}: round {} of {}, {}", c.scene.label,
                                       report::format_short(c.objects), round + 1, settings_.rounds,
                                       r.row.method));
      for (std::size_t j = 0; j < r.inner; ++j) run_once(r, c, ++r.frame, true);
      if (round < 2) verify(r, r.frame);
    }
  }

  std::map<std::string, std::pair<double, std::string>> fastest;  // by variant
  for (Runner& r : runners) {
    Measurement& row = r.row;
    if (r.method) {
      row.measured = true;
      row.samples = r.samples.size();
      row.ms = common::median(r.samples);
      row.least_ms = *std::min_element(r.samples.begin(), r.samples.end());
      if (const auto result = throng_result(*r.method); result && result->comparisons) {
        row.comparisons = double(result->comparisons) / (double(c.objects) + double(result->found));
        row.plan =
            fmt::format("{}, {}", to_string(result->plan.algorithm), to_string(result->plan.isa));
      }
      Past& p = past_[key(c, *r.info, row.threads)];
      const double took = std::max({row.ms / 1000, r.prepared, r.first});
      if (p.objects != 0 && p.objects < c.objects) {
        p.exponent = std::clamp(
            std::log(took / p.seconds) / std::log(double(c.objects) / double(p.objects)), 1.0, 2.2);
      }
      p.objects = c.objects;
      p.seconds = took;
      auto& best = fastest[r.info->variant];
      if (best.second.empty() || row.ms < best.first) best = {row.ms, row.method};
      r.method.reset();
      if (settings_.memory && measures_memory(r, c))
        row.peak_bytes = peak_of(r.index, c, row.threads);
    }
  }
  for (const Runner& r : runners) {
    const auto best = fastest.find(r.info->variant);
    if (r.info->variant.empty() || !r.row.measured || best == fastest.end()) continue;
    if (c.objects >= 10000 && r.row.ms > 1.4 * best->second.first)
      dropped_[key(c, *r.info)] = best->second.second;
  }
  rows.reserve(runners.size());
  for (Runner& r : runners) rows.push_back(std::move(r.row));
  return rows;
}

std::uint64_t SearchRounds::peak_growth(const MethodInfo& original, const Case& c,
                                        unsigned threads) {
  const bool split = !c.worlds.empty() && original.origin != Origin::throng;
  const MethodInfo e = split ? one_world_at_a_time(original) : original;
  if (!reset_peak()) return 0;
  const std::uint64_t before = resident_bytes();
  const auto method = e.make(threads);
  method->prepare(c.input(0));
  for (std::size_t f = 0; f < 2; ++f) {
    method->place(c.input(f));
    method->run(c.input(f));
  }
  const std::uint64_t peak = peak_resident_bytes();
  return peak > before ? peak - before : 0;
}

// In a separate process: memory that other methods have freed would be counted or hidden.
std::uint64_t SearchRounds::peak_of(std::size_t method, const Case& c, unsigned threads) const {
#if defined(__linux__)
  const auto quoted = [](const std::string& text) {
    std::string out = "'";
    for (const char ch : text) out += ch == '\'' ? std::string("'\\''") : std::string(1, ch);
    return out + "'";
  };
  const std::string command = fmt::format(
      "exec /proc/{}/exe search --peak-of {} --scene {} --objects {} --threads {} {} 2>/dev/null",
      getpid(), method, quoted(c.scene.label), c.objects, threads, settings_.method_options);
  std::FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return 0;
  unsigned long long bytes = 0;
  const int read = std::fscanf(pipe, "%llu", &bytes);
  return pclose(pipe) == 0 && read == 1 ? bytes : 0;
#else
  (void)method, (void)c, (void)threads;
  return 0;
#endif
}

}  // namespace throng::bench
