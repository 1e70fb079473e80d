#include "bench/machine.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <ctime>
#include <fstream>
#include <memory>
#include <sstream>
#include <thread>

#include <throng/version.hpp>

#include "bench/crew.hpp"
#include "bench/rivals.hpp"

namespace throng::bench {
namespace {

// The value of "key : value" in a file of /proc.
std::string field(const char* file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.compare(0, key.size(), key) != 0) continue;
    const std::size_t at = line.find(':');
    const std::size_t from = at == std::string::npos ? at : line.find_first_not_of(" \t", at + 1);
    if (from != std::string::npos) return line.substr(from);
  }
  return "";
}

std::uint64_t status_bytes(const char* key) {
  std::istringstream text(field("/proc/self/status", key));
  std::uint64_t kib = 0;
  text >> kib;
  return kib * 1024;
}

}  // namespace

unsigned hardware_threads() { return std::max(1u, std::thread::hardware_concurrency()); }

std::vector<std::pair<std::string, std::string>> machine_description() {
  std::vector<std::pair<std::string, std::string>> d;
  const std::string model = field("/proc/cpuinfo", "model name");
  d.emplace_back("processor", model.empty() ? "unknown" : model);
  d.emplace_back("hardware threads", std::to_string(hardware_threads()));
  const std::string flags = field("/proc/cpuinfo", "flags");
  std::string sets;
  for (const char* set : {"sse4_1", "avx2", "avx512f", "avx512vbmi2"})
    if ((" " + flags + " ").find(std::string(" ") + set + " ") != std::string::npos)
      sets += (sets.empty() ? "" : ", ") + std::string(set);
  if (!sets.empty()) d.emplace_back("instruction sets", sets);
  d.emplace_back("memory", field("/proc/meminfo", "MemTotal"));
  d.emplace_back("compiler",
#if defined(__clang__)
                 "clang " __clang_version__
#elif defined(__GNUC__)
                 "gcc " __VERSION__
#else
                 "unknown"
#endif
  );
  std::ifstream release("/etc/os-release");
  for (std::string line; std::getline(release, line);)
    if (line.compare(0, 13, "PRETTY_NAME=\"") == 0)
      d.emplace_back("system", line.substr(13, line.size() - 14));
  d.emplace_back("Throng", THRONG_VERSION);
  std::string versions, missing;
  for (const auto& v : rival_versions()) versions += (versions.empty() ? "" : ", ") + v;
  for (const auto& v : missing_rivals()) missing += (missing.empty() ? "" : ", ") + v;
  d.emplace_back("rivals", versions.empty() ? "none" : versions);
  if (!missing.empty()) d.emplace_back("rivals not found", missing);
  std::ifstream load("/proc/loadavg");
  std::string one;
  load >> one;
  if (!one.empty()) d.emplace_back("load when started", one);
  char date[32];
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof date, "%Y-%m-%d", std::gmtime(&now));
  d.emplace_back("date", date);
  return d;
}

double copy_bandwidth(unsigned threads) {
  // A quarter GiB each: far beyond the caches of most; one of hundreds of MiB flatters the figure.
  const std::size_t bytes = std::size_t{256} << 20;
  const std::unique_ptr<char[]> from(new char[bytes]), to(new char[bytes]);
  Crew crew(threads);
  double best = 0;
  for (int round = 0; round < 6; ++round) {
    const auto start = std::chrono::steady_clock::now();
    crew.run([&](unsigned t) {
      const std::size_t begin = Crew::part(bytes, t, threads),
                        end = Crew::part(bytes, t + 1, threads);
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
