#include "apps/common/machine.hpp"

#include <algorithm>
#include <ctime>
#include <fstream>
#include <thread>

namespace throng::common {

std::string proc_field(const std::string& file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.compare(0, key.size(), key) != 0) continue;
    const std::size_t at = line.find(':');
    const std::size_t from = at == std::string::npos ? at : line.find_first_not_of(" \t", at + 1);
    if (from != std::string::npos) return line.substr(from);
  }
  return "";
}

unsigned hardware_threads() { return std::max(1u, std::thread::hardware_concurrency()); }

std::string processor_name() {
  const std::string model = proc_field("/proc/cpuinfo", "model name");
  return model.empty() ? "unknown" : model;
}

std::vector<std::pair<std::string, std::string>> machine_description() {
  std::vector<std::pair<std::string, std::string>> d;
  d.emplace_back("processor", processor_name());
  d.emplace_back("hardware threads", std::to_string(hardware_threads()));
  const std::string flags = proc_field("/proc/cpuinfo", "flags");
  std::string sets;
  for (const char* set : {"sse4_1", "avx2", "avx512f", "avx512vbmi2"})
    if ((" " + flags + " ").find(std::string(" ") + set + " ") != std::string::npos)
      sets += (sets.empty() ? "" : ", ") + std::string(set);
  if (!sets.empty()) d.emplace_back("instruction sets", sets);
  d.emplace_back("memory", proc_field("/proc/meminfo", "MemTotal"));
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

}  // namespace throng::common
