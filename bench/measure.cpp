#include "bench/measure.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <stdexcept>

#if defined(__linux__)
#include <unistd.h>
#endif

#include <fmt/format.h>

#include "bench/library.hpp"
#include "bench/machine.hpp"
#include "bench/worlds.hpp"
#include "program/median.hpp"
#include "report/format.hpp"
#include "scene/checksum.hpp"

namespace throng::bench {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
std::string key(const Case& c, const Entry& e, unsigned threads = 0) {
  return c.scene.label + "|" + e.name + "|" + std::to_string(threads);
}

}  // namespace

struct Bench::Runner {
  const Entry* entry;
  std::size_t index;
  Row row;
  std::unique_ptr<Contender> contender;
  std::vector<double> samples;
  double spent = 0, last = 0, prepared = 0, first = 0;  // seconds
  std::size_t inner = 1;                                // frames a round
  std::size_t frame = 0;                                // the last one run
};

Bench::Bench(Settings settings, std::vector<Entry> entries)
    : settings_(std::move(settings)), entries_(std::move(entries)), start_(now()) {}

double Bench::seconds() const { return now() - start_; }

// Each weighing makes the scene anew in another process: only what says something new is weighed.
bool Bench::worth_weighing(const Runner& r, const Case& c) const {
  const Row& row = r.row;
  if (row.ms > 500 || c.objects < 10000) return false;
  if (r.entry->parallel && row.threads != settings_.threads.back()) return false;
  if (row.kind == Kind::library && row.contender != main_row &&
      row.contender != "Throng, canonical order")
    return false;
  const std::string& scene = c.scene.label;
  return c.objects <= 200000 || c.scene.name.empty() || scene == "uniform" || scene == "pile" ||
         scene == "mixed";
}

std::string Bench::excuse(const Entry& e, unsigned threads, const Case& c) const {
  if (e.name == "Throng, all pairs" && c.objects > all_pairs_limit) {
    return fmt::format("only up to {} boxes", report::format_short(all_pairs_limit));
  }
  const auto slower = dropped_.find(key(c, e));
  if (slower != dropped_.end()) return "slower than '" + slower->second + "' at a smaller size";
  const auto past = past_.find(key(c, e, threads));
  if (past == past_.end() || past->second.objects >= c.objects) return "";
  const Past& p = past->second;
  if (e.kind == Kind::library) return "";
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

void Bench::run_once(Runner& r, const Case& c, std::size_t frame, bool timed) {
  const Input in = c.input(frame);
  r.contender->place(in);
  const double begin = now();
  r.contender->run(in);
  const double took = now() - begin;
  r.spent += took;
  r.last = took;
  if (timed) r.samples.push_back(1000 * took);
}

std::vector<Row> Bench::measure(const Case& c) {
  expected_.clear();
  std::vector<Runner> runners;
  std::vector<Row> rows;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry& original = entries_[i];
    const bool split = !c.worlds.empty() && original.kind != Kind::library;
    for (const unsigned threads : settings_.threads) {
      if (threads != settings_.threads.front() && !original.parallel && !split) continue;
      Runner r{&original, i, {}, nullptr, {}};
      r.row.scene = c.scene.label;
      r.row.objects = c.objects;
      r.row.contender = original.name;
      r.row.kind = original.kind;
      r.row.threads = threads;
      r.row.note = excuse(original, threads, c);
      if (r.row.note.empty()) {
        const Entry e = split ? one_world_at_a_time(original) : original;
        r.row.note = e.note;
        r.contender = e.make(threads);
      }
      runners.push_back(std::move(r));
    }
  }

  // Compared on the frame just run. The first contender, the library's own, sets what is expected
  // of a frame; the tests hold it against a double loop.
  std::vector<Pair> pairs;
  const auto verify = [&](Runner& r, std::size_t frame) {
    const std::size_t f = c.index(frame);
    pairs.clear();
    r.contender->collect(c.input(frame), pairs);
    const Expected got{pairs.size(), scene::pair_checksum(pairs.data(), pairs.size())};
    const auto [it, fresh] = expected_.emplace(f, got);
    if (!fresh && (it->second.pairs != got.pairs || it->second.checksum != got.checksum))
      r.row.agrees = false;
    if (f == 0) {
      r.row.pairs = got.pairs;
      r.row.checksum = got.checksum;
    }
  };

  for (Runner& r : runners) {
    if (!r.contender) continue;
    if (settings_.progress)
      settings_.progress(fmt::format("{}, {}: {}, {} thread{}", c.scene.label,
                                     report::format_short(c.objects), r.row.contender,
                                     r.row.threads, r.row.threads == 1 ? "" : "s"));
    const double begin = now();
    r.contender->prepare(c.input(0));
    r.prepared = now() - begin;
    run_once(r, c, 0, false);
    verify(r, 0);
    const double first = r.first = r.last;
    r.spent = 0;
    if (r.prepared + first < settings_.contender_seconds && c.frames.size() > 1)
      run_once(r, c, ++r.frame, false);
    r.first = std::max(r.first, r.last);  // the first move may cost more than any later one
    // A frame that warms nothing up any more; of slow ones the first must do.
    const double typical = std::max(r.spent > 0 ? r.spent : first, 1e-7);
    r.inner = static_cast<std::size_t>(std::clamp(0.008 / typical, 1.0, 64.0));
    r.spent = 0;
  }
  for (int round = 0; round < settings_.rounds; ++round) {
    for (std::size_t k = 0; k < runners.size(); ++k) {
      Runner& r = runners[(k + static_cast<std::size_t>(round)) % runners.size()];
      if (!r.contender || r.spent > settings_.contender_seconds) continue;
      if (settings_.progress)
        settings_.progress(fmt::format("{}, {}: round {} of {}, {}", c.scene.label,
                                       report::format_short(c.objects), round + 1, settings_.rounds,
                                       r.row.contender));
      for (std::size_t j = 0; j < r.inner; ++j) run_once(r, c, ++r.frame, true);
      if (round < 2) verify(r, r.frame);
    }
  }

  std::map<std::string, std::pair<double, std::string>> fastest;  // by variant
  for (Runner& r : runners) {
    Row& row = r.row;
    if (r.contender) {
      row.measured = true;
      row.samples = r.samples.size();
      row.ms = program::median(r.samples);
      row.best_ms = *std::min_element(r.samples.begin(), r.samples.end());
      if (const auto result = library_result(*r.contender); result && result->comparisons) {
        row.comparisons = double(result->comparisons) / (double(c.objects) + double(result->found));
        row.plan =
            fmt::format("{}, {}", to_string(result->plan.algorithm), to_string(result->plan.isa));
      }
      Past& p = past_[key(c, *r.entry, row.threads)];
      const double took = std::max({row.ms / 1000, r.prepared, r.first});
      if (p.objects != 0 && p.objects < c.objects) {
        p.exponent = std::clamp(
            std::log(took / p.seconds) / std::log(double(c.objects) / double(p.objects)), 1.0, 2.2);
      }
      p.objects = c.objects;
      p.seconds = took;
      auto& best = fastest[r.entry->variant];
      if (best.second.empty() || row.ms < best.first) best = {row.ms, row.contender};
      r.contender.reset();
      if (settings_.memory && worth_weighing(r, c))
        row.peak_bytes = peak_of(r.index, c, row.threads);
    }
  }
  for (const Runner& r : runners) {
    const auto best = fastest.find(r.entry->variant);
    if (r.entry->variant.empty() || !r.row.measured || best == fastest.end()) continue;
    if (c.objects >= 10000 && r.row.ms > 1.4 * best->second.first)
      dropped_[key(c, *r.entry)] = best->second.second;
  }
  rows.reserve(runners.size());
  for (Runner& r : runners) rows.push_back(std::move(r.row));
  return rows;
}

std::uint64_t Bench::peak_growth(const Entry& original, const Case& c, unsigned threads) {
  const bool split = !c.worlds.empty() && original.kind != Kind::library;
  const Entry e = split ? one_world_at_a_time(original) : original;
  if (!reset_peak()) return 0;
  const std::uint64_t before = resident_bytes();
  const auto contender = e.make(threads);
  contender->prepare(c.input(0));
  for (std::size_t f = 0; f < 2; ++f) {
    contender->place(c.input(f));
    contender->run(c.input(f));
  }
  const std::uint64_t peak = peak_resident_bytes();
  return peak > before ? peak - before : 0;
}

// In a process of its own, or what others left behind would be counted or hidden.
std::uint64_t Bench::peak_of(std::size_t entry, const Case& c, unsigned threads) const {
#if defined(__linux__)
  const auto quoted = [](const std::string& text) {
    std::string out = "'";
    for (const char ch : text) out += ch == '\'' ? std::string("'\\''") : std::string(1, ch);
    return out + "'";
  };
  const std::string command = fmt::format(
      "exec /proc/{}/exe --peak-of {} --scene {} --objects {} --threads {} {} 2>/dev/null",
      getpid(), entry, quoted(c.scene.label), c.objects, threads, settings_.entry_options);
  std::FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return 0;
  unsigned long long bytes = 0;
  const int read = std::fscanf(pipe, "%llu", &bytes);
  return pclose(pipe) == 0 && read == 1 ? bytes : 0;
#else
  (void)entry, (void)c, (void)threads;
  return 0;
#endif
}

}  // namespace throng::bench
