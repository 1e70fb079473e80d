// A search under one cap for all memory: in memory where all fits, else streamed.
#include <cstdlib>
#include <filesystem>

#include <throng/cuda.hpp>
#include <throng/finder.hpp>
#include <throng/large_pages.hpp>

#include "apps/common/interrupt.hpp"
#include "apps/stream/stream.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/memory.hpp"
#include "apps/throng/search.hpp"

namespace throng::cli {
namespace {

// The user's choice; else the output's folder, which needs space for large files anyway; else the
// system's temporary folder.
std::string scratch_folder(const std::string& output) {
  if (const char* chosen = std::getenv("TMPDIR"); chosen && *chosen) return chosen;
  std::error_code error;
  if (!output.empty() && std::filesystem::is_regular_file(output, error)) {
    const auto folder = std::filesystem::canonical(output, error).parent_path();
    if (!error) return folder.string();
  }
  if (!output.empty() && !std::filesystem::exists(output, error)) {
    const auto folder = std::filesystem::path(output).parent_path();
    return folder.empty() ? "." : folder.string();
  }
  const auto folder = std::filesystem::temp_directory_path(error);
  return error ? "." : folder.string();
}

stream::SetFiles files_of(const std::string& boxes, const FilterFiles& f) {
  return {boxes, f.group, f.mask, f.owner, f.world, f.is_static};
}

SearchReport run_streamed(stream::Request request) {
  const common::InterruptGuard guard;
  constexpr std::size_t steps = 10000;
  Progress progress("searching:", steps);
  request.options.stop = &common::InterruptGuard::flag();
  request.progress = [&](double share) {
    guard.check();
    progress.at(static_cast<std::size_t>(share * steps));
  };
  const PeakMeter memory;
  const stream::Report streamed = stream::run(request);

  SearchReport report;
  report.count = streamed.count;
  if (!request.b.boxes.empty()) report.count_b = streamed.count_b;
  for (const stream::FrameResult& from : streamed.frames) {
    FrameReport& frame = report.frames.emplace_back();
    frame.pairs = from.pairs;
    frame.checksum = from.checksum;
    frame.inactive = from.inactive;
    frame.comparisons = from.comparisons;
    frame.visited = from.visited;
    frame.total_ms = from.ms;
  }
  StageTimes& stages = report.frames.front().stages;  // sums over all frames
  stages.find_ms = streamed.search_ms;
  stages.order_ms = streamed.order_ms;
  stages.total_ms = streamed.read_ms + streamed.search_ms + streamed.order_ms;
  report.first_ms = report.frames.front().total_ms;
  report.plan = streamed.plan;
  report.peak_bytes = memory.growth();
  report.streamed =
      StreamedReport{streamed.slabs, streamed.searches, streamed.scratch_bytes, streamed.read_ms};
  return report;
}

}  // namespace

SearchReport run_capped_search(const InputArguments& input, SearchRequest request) {
  if (input.b.empty()) input.require_no_filters_b();
  stream::Request streamed;
  streamed.a = files_of(input.a, input.filters_a);
  if (!input.b.empty()) streamed.b = files_of(input.b, input.filters_b);
  streamed.round_outward = input.round_outward;
  // A memory resource would keep `auto` from choosing a GPU.
  if (!cuda::available().ok()) request.options.memory = large_pages();
  streamed.options = request.options;
  streamed.output = request.output;
  streamed.scratch_folder = scratch_folder(request.output);
  const std::size_t cap = request.options.memory_cap_bytes;
  if (stream::bytes_in_memory(streamed) <= cap) {
    try {
      const Input whole(input);
      request.options.memory_cap_bytes -= static_cast<std::size_t>(whole.bytes());
      return run_search(whole, request);
    } catch (const CapTooSmall&) {
      // More memory than estimated; its pairs are discarded.
    }
  }
  return run_streamed(std::move(streamed));
}

}  // namespace throng::cli
