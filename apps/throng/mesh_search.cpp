#include "apps/throng/mesh_search.hpp"

#include <algorithm>

#include <throng/checksum.hpp>

#include <fmt/format.h>

#include "apps/common/interrupt.hpp"
#include "apps/common/median.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/failure.hpp"
#include "apps/throng/memory.hpp"

namespace throng::cli {
namespace {

using common::median;

// Pairs described at a time: 10 MB of intersections.
constexpr std::size_t block_pairs = std::size_t{1} << 16;

class MeshRunner {
 public:
  MeshRunner(const NamedMesh& a, const NamedMesh* b, const MeshSearchRequest& request)
      : a_(a), b_(b), request_(request), finder_(request.options) {}

  MeshSearchReport run() {
    const PeakMeter memory;
    auto start = Clock::now();
    const MeshResult result = search();
    report_.first_ms = ms_since(start);
    require_ok(result);
    if (result.message[0]) print_error(fmt::format("throng: note: {}", result.message));
    const Pairs pairs = finder_.pairs();
    report_.pairs = result.found;
    report_.checksum = pair_checksum(pairs.data(), pairs.size());
    report_.candidates = result.candidates;
    report_.exact_tests = result.exact_tests;
    report_.plan = result.plan;
    write(pairs);
    mark(pairs);
    start = Clock::now();
    count_kinds(pairs);
    report_.kinds_ms = ms_since(start);
    repeat();
    report_.peak_bytes = memory.growth();
    return std::move(report_);
  }

 private:
  MeshResult search() {
    const TriangleMesh a = a_.mesh.view();
    if (b_ != nullptr) {
      const TriangleMesh b = b_->mesh.view();
      return request_.within ? finder_.find_within(a, b, *request_.within) : finder_.find(a, b);
    }
    return request_.within ? finder_.find_within(a, *request_.within) : finder_.find(a);
  }

  void require_ok(const Result& result) const {
    if (result.ok()) return;
    std::string name = a_.name;
    if (b_ != nullptr) name += " and " + b_->name;
    throw Failure(fmt::format("{}: {}", name, common::failure_text(result, request_.hint_options)));
  }

  void write(const Pairs& pairs) const {
    if (request_.output.empty()) return;
    const common::InterruptGuard guard;
    scenes::PairWriter writer(request_.output);
    // In parts, so that Ctrl-C is noticed promptly.
    constexpr std::size_t part = std::size_t{1} << 20;
    for (std::size_t i = 0; i < pairs.size(); i += part) {
      guard.check();
      writer.write(pairs.data() + i, std::min(part, pairs.size() - i));
    }
    guard.check();
    writer.finish();
  }

  void mark(const Pairs& pairs) {
    std::vector<std::uint8_t> a(a_.mesh.triangles.size()), b;
    if (b_ != nullptr) b.resize(b_->mesh.triangles.size());
    std::vector<std::uint8_t>& second = b_ != nullptr ? b : a;
    for (const Pair& pair : pairs) a[pair.first] = second[pair.second] = 1;
    report_.marked_triangles_a = static_cast<std::uint64_t>(std::count(a.begin(), a.end(), 1));
    report_.marked_triangles_b = static_cast<std::uint64_t>(std::count(b.begin(), b.end(), 1));
    if (!request_.marks) return;
    report_.marked_a = std::move(a);
    report_.marked_b = std::move(b);
  }

  void count_kinds(const Pairs& pairs) {
    const TriangleMesh a = a_.mesh.view(), b = b_ != nullptr ? b_->mesh.view() : a;
    for (std::size_t i = 0; i < pairs.size(); i += block_pairs) {
      for (const TriangleIntersection& found : describe_intersections(
               a, b, pairs.data() + i, std::min(block_pairs, pairs.size() - i), request_.options)) {
        std::uint64_t& count = found.kind == IntersectionKind::none       ? report_.apart
                               : found.kind == IntersectionKind::crossing ? report_.crossing
                               : found.kind == IntersectionKind::touching ? report_.touching
                                                                          : report_.coplanar;
        ++count;
      }
    }
  }

  void repeat() {
    std::vector<double> plan, bin, find, order, inside, total;
    Progress progress("searching: run", request_.repeat);
    for (std::size_t r = 0; r < request_.repeat; ++r) {
      const auto start = Clock::now();
      const MeshResult result = search();
      total.push_back(ms_since(start));
      require_ok(result);
      if (result.found != report_.pairs) {
        throw Failure(
            fmt::format("{}: {} pairs in one run and {} in the next; this is a defect "
                        "of the library, please report it",
                        a_.name, report_.pairs, result.found));
      }
      plan.push_back(result.times.plan_ms);
      bin.push_back(result.times.bin_ms);
      find.push_back(result.times.find_ms);
      order.push_back(result.times.order_ms);
      inside.push_back(result.times.total_ms);
      progress.at(r + 1);
    }
    report_.stages = {median(plan), median(bin), median(find), median(order), median(inside)};
    report_.total_ms = median(total);
  }

  const NamedMesh& a_;
  const NamedMesh* b_;
  const MeshSearchRequest& request_;
  MeshFinder finder_;
  MeshSearchReport report_;
};

}  // namespace

MeshSearchReport run_mesh_search(const NamedMesh& a, const NamedMesh* b,
                                 const MeshSearchRequest& request) {
  return MeshRunner(a, b, request).run();
}

}  // namespace throng::cli
