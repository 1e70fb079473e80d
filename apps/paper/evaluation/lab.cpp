#include "apps/paper/evaluation/lab.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include <throng/checksum.hpp>
#include <throng/throng.hpp>

#include "apps/common/machine.hpp"
#include "apps/common/median.hpp"
#include "apps/paper/cuda.hpp"
#include "apps/paper/failure.hpp"
#include "apps/paper/grid.hpp"

namespace throng::paper {

Lab::Lab(Setting setting) : setting_(std::move(setting)) {
  names_[0] = fmt::format("{}, {} thread{}", common::processor_name(), setting_.threads,
                          setting_.threads == 1 ? "" : "s");
  if (why_no_cuda().empty()) names_[1] = cuda_device_name();
}

const std::string& Lab::name(DeviceKind device) const {
  return names_[device == DeviceKind::cuda ? 1 : 0];
}

void Lab::say(const std::string& what) const {
  if (setting_.progress) setting_.progress(what);
}

std::vector<std::uint64_t> Lab::sizes(std::vector<std::uint64_t> all,
                                      std::uint64_t quick_limit) const {
  const std::uint64_t limit = quick() ? std::min(quick_limit, setting_.up_to) : setting_.up_to;
  std::erase_if(all, [&](std::uint64_t n) { return n > limit; });
  return all;
}

Lab::Measurement Lab::run(const Variant& variant, const Box* boxes, std::uint64_t n,
                          DeviceKind device, unsigned threads) const {
  Job job;
  job.variant = variant;
  job.n = n;
  job.environment = environment_of(boxes, n);
  job.memory_bytes = setting_.memory_bytes;
  job.threads = threads == 0 ? setting_.threads : threads;
  try {
    const std::unique_ptr<Stepper> stepper = make_stepper_on(device, job);
    return {measure(*stepper, boxes, repeat(), budget_ms()), ""};
  } catch (const TooLarge& failure) {
    return {{}, std::string("skipped: ") + failure.what()};
  }
}

Row Lab::row(const std::string& what, std::uint64_t n, const std::string& quantity,
             const std::string& unit, DeviceKind device) const {
  Row row;
  row.what = what;
  row.n = n;
  row.quantity = quantity;
  row.unit = unit;
  row.device = name(device);
  return row;
}

Row Lab::row(const std::string& what, std::uint64_t n, const std::string& quantity,
             DeviceKind device, const Measurement& measurement, double Times::*stage) const {
  Row result = row(what, n, quantity, "ms", device);
  result.found = measurement.skip_reason;
  if (measurement.measured) {
    result.measured = measurement.measured->step.times.*stage;
    result.pairs = measurement.measured->step.pairs.size();
    result.checksum = measurement.measured->checksum;
  }
  return result;
}

Lab::Library Lab::library(const Box* boxes, std::uint64_t n, DeviceKind device, unsigned threads,
                          float cell_scale) const {
  Options options;
  options.backend = device == DeviceKind::cuda ? Backend::cuda : Backend::cpu;
  options.threads = threads == 0 ? setting_.threads : threads;
  options.cell_scale = cell_scale;
  Finder finder(options);
  const throng::Boxes view(boxes, n);
  Result result;
  const double ms = median_ms(
      [&] {
        result = finder.find(view);
        if (!result.ok()) throw Failure(result.message);
      },
      quick() ? 11 : 31, budget_ms());
  const Pairs pairs = finder.pairs();
  return {ms, result.found, pair_checksum(pairs.data(), pairs.size()),
          to_string(result.plan.algorithm)};
}

double ms_of(const std::function<void()>& call) {
  const auto start = std::chrono::steady_clock::now();
  call();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

double median_ms(const std::function<void()>& call, int repeat, double budget_ms) {
  const double cold = ms_of(call);
  if (cold > budget_ms) return cold;
  std::vector<double> times;
  double spent = 0;
  // Short calls on several threads are slow until the system has spread the threads over the cores.
  constexpr double min_total_ms = 100;
  while (times.empty() ||
         ((static_cast<int>(times.size()) < repeat || spent < min_total_ms) && spent < budget_ms)) {
    times.push_back(ms_of(call));
    spent += times.back();
  }
  return common::median(times);
}

}  // namespace throng::paper
