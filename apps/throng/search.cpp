#include "apps/throng/search.hpp"

#include <algorithm>

#include <throng/checksum.hpp>

#include <fmt/format.h>

#include "apps/common/interrupt.hpp"
#include "apps/common/median.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/failure.hpp"
#include "apps/throng/memory.hpp"

namespace throng::cli {
namespace {

using common::median;

class Runner {
 public:
  Runner(const Input& input, const SearchRequest& request)
      : input_(input), request_(request), finder_(request.options) {}

  SearchReport run() {
    SearchReport report;
    report.count = input_.a().count();
    if (input_.b()) report.count_b = input_.b()->count();
    report.frames.resize(input_.frames());
    const std::size_t passes = 1 + request_.repeat;
    Progress progress("searching: frame", passes * input_.frames());
    const PeakMeter memory;
    for (std::size_t f = 0; f < input_.frames(); ++f) {
      first_pass(f, report);
      progress.at(f + 1);
    }
    if (writer_) {
      writer_->finish();
      writer_.reset();
      guard_.reset();
    }
    times_.resize(input_.frames());
    for (std::size_t r = 0; r < request_.repeat; ++r) {
      for (std::size_t f = 0; f < input_.frames(); ++f) {
        const auto start = Clock::now();
        const Result result =
            capped() ? consume(f, [](const Pair*, std::size_t) { return true; }) : search(f);
        const double ms = ms_since(start);
        require_ok(result, input_, f, request_.hint_options);
        if (result.found != report.frames[f].pairs) {
          throw Failure(
              fmt::format("{}: {} pairs in one run and {} in the next; this is a defect "
                          "of the library, please report it",
                          input_.name(f), report.frames[f].pairs, result.found));
        }
        times_[f].add(result.times, ms);
        progress.at((r + 1) * input_.frames() + f + 1);
      }
    }
    report.peak_bytes = memory.growth();
    for (std::size_t f = 0; f < input_.frames(); ++f) times_[f].fill(report.frames[f]);
    return report;
  }

 private:
  struct Times {
    std::vector<double> plan, bin, find, order, inside, total;
    void add(const StageTimes& t, double ms) {
      plan.push_back(t.plan_ms);
      bin.push_back(t.bin_ms);
      find.push_back(t.find_ms);
      order.push_back(t.order_ms);
      inside.push_back(t.total_ms);
      total.push_back(ms);
    }
    void fill(FrameReport& frame) const {
      frame.stages = {median(plan), median(bin), median(find), median(order), median(inside)};
      frame.total_ms = median(total);
    }
  };

  bool capped() const { return request_.options.memory_cap_bytes != 0; }

  Result search(std::size_t f) {
    return input_.b() ? finder_.find(input_.a().frame(f), input_.b()->frame(f))
                      : finder_.find(input_.a().frame(f));
  }

  template <class F>
  Result consume(std::size_t f, F&& take) {
    return input_.b() ? finder_.consume(input_.a().frame(f), input_.b()->frame(f), take)
                      : finder_.consume(input_.a().frame(f), take);
  }

  // The file is created when the first pairs exist, so that a refused search keeps an older file of
  // that name; it gets its name when complete.
  void write(const Pair* pairs, std::size_t count) {
    if (request_.output.empty()) return;
    if (!writer_) {
      guard_.emplace();
      writer_.emplace(request_.output);
    }
    // In parts, so that the disk starts early and Ctrl-C is noticed promptly.
    constexpr std::size_t part = std::size_t{1} << 20;
    for (std::size_t i = 0; i < count; i += part) {
      guard_->check();
      writer_->write(pairs + i, std::min(part, count - i));
    }
    guard_->check();
  }

  void first_pass(std::size_t f, SearchReport& report) {
    FrameReport& frame = report.frames[f];
    const auto start = Clock::now();
    Result result;
    double ms = 0;
    if (capped()) {
      result = consume(f, [&](const Pair* pairs, std::size_t count) {
        frame.checksum += pair_checksum(pairs, count);
        write(pairs, count);
        return true;
      });
      ms = ms_since(start);
    } else {
      result = search(f);
      ms = ms_since(start);
    }
    require_ok(result, input_, f, request_.hint_options);
    if (result.message[0] && f == 0) print_error(fmt::format("throng: note: {}", result.message));
    if (!capped()) {
      const Pairs pairs = finder_.pairs();
      frame.checksum = pair_checksum(pairs.data(), pairs.size());
      write(pairs.data(), pairs.size());
    } else {
      write(nullptr, 0);
    }
    if (f == 0) report.first_ms = ms;
    frame.pairs = result.found;
    frame.inactive = result.inactive;
    frame.comparisons = result.comparisons;
    frame.visited = result.visited;
    report.plan = result.plan;
  }

  const Input& input_;
  const SearchRequest& request_;
  Finder finder_;
  std::optional<common::InterruptGuard> guard_;
  std::optional<scenes::PairWriter> writer_;
  std::vector<Times> times_;
};

}  // namespace

FrameReport SearchReport::sum() const {
  FrameReport sum;
  for (const FrameReport& frame : frames) {
    sum.pairs += frame.pairs;
    sum.checksum += frame.checksum;
    sum.inactive += frame.inactive;
    sum.comparisons += frame.comparisons;
    sum.visited += frame.visited;
    sum.total_ms += frame.total_ms;
    sum.stages += frame.stages;
  }
  return sum;
}

SearchReport run_search(const Input& input, const SearchRequest& request) {
  return Runner(input, request).run();
}

}  // namespace throng::cli
