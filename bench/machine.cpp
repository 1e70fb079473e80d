#include "bench/machine.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>

#include <throng/version.hpp>

#include "apps/common/machine.hpp"
#include "bench/competitors/competitors.hpp"
#include "bench/competitors/thread_pool.hpp"

namespace throng::bench {
namespace {

std::uint64_t status_bytes(const char* key) {
  std::istringstream text(common::proc_field("/proc/self/status", key));
  std::uint64_t kib = 0;
  text >> kib;
  return kib * 1024;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> machine_description() {
  auto d = common::machine_description();
  d.emplace_back("Throng", THRONG_VERSION);
  std::string versions, missing;
  for (const auto& v : competitor_versions()) versions += (versions.empty() ? "" : ", ") + v;
  for (const auto& v : missing_competitors()) missing += (missing.empty() ? "" : ", ") + v;
  d.emplace_back("other libraries", versions.empty() ? "none" : versions);
  if (!missing.empty()) d.emplace_back("libraries not found", missing);
  return d;
}

double copy_bandwidth(unsigned threads) {
  // A quarter GiB each: larger than most caches; a cache of hundreds of MiB raises the figure.
  const std::size_t bytes = std::size_t{256} << 20;
  const std::unique_ptr<char[]> from(new char[bytes]), to(new char[bytes]);
  ThreadPool pool(threads);
  double best = 0;
  for (int round = 0; round < 6; ++round) {
    const auto start = std::chrono::steady_clock::now();
    pool.run([&](unsigned t) {
      const std::size_t begin = ThreadPool::part(bytes, t, threads),
                        end = ThreadPool::part(bytes, t + 1, threads);
      if (round == 0) {
        std::memset(from.get() + begin, 1, end - begin);
        std::memset(to.get() + begin, 2, end - begin);
      } else {
        std::memcpy(to.get() + begin, from.get() + begin, end - begin);
      }
    });
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (round > 0) best = std::max(best, 2.0 * static_cast<double>(bytes) / seconds / 1e9);
  }
  return best;
}

std::uint64_t resident_bytes() { return status_bytes("VmRSS"); }
std::uint64_t peak_resident_bytes() { return status_bytes("VmHWM"); }
bool reset_peak() {
  std::ofstream out("/proc/self/clear_refs");
  out << "5" << std::flush;
  return out.good();
}

}  // namespace throng::bench
