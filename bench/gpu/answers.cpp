// A file of answers: what one backend found, to compare another one with.
#include <fstream>
#include <stdexcept>

#include "bench/gpu/measurement.hpp"

namespace throng::bench::gpu {
namespace {

constexpr const char* columns = "scene,objects,frame,pairs,checksum";

std::string key_of(const std::string& scene, std::uint64_t objects, std::uint64_t frame) {
  return report::escape_csv(scene.substr(scene.find_last_of('/') + 1)) + ',' +
         std::to_string(objects) + ',' + std::to_string(frame);
}

}  // namespace

void Answers::add(const std::string& scene, std::uint64_t objects, std::uint64_t frame,
                  const Answer& answer) {
  answers_[key_of(scene, objects, frame)] = answer;
}

const Answer* Answers::find(const std::string& scene, std::uint64_t objects,
                            std::uint64_t frame) const {
  const auto at = answers_.find(key_of(scene, objects, frame));
  return at == answers_.end() ? nullptr : &at->second;
}

std::string Answers::csv() const {
  std::string text = std::string(columns) + '\n';
  for (const auto& [key, answer] : answers_)
    text += key + ',' + std::to_string(answer.pairs) + ',' + hex(answer.checksum) + '\n';
  return text;
}

Answers Answers::read(const std::string& path) {
  std::ifstream in(path);
  std::string line;
  if (!std::getline(in, line) || line.substr(0, std::string(columns).size()) != columns)
    throw std::invalid_argument(path + ": wanted a file whose first line is " + columns);
  Answers all;
  for (int number = 2; std::getline(in, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    // The scene may have commas, quoted; what follows it has none.
    const std::size_t last = line.rfind(',');
    const std::size_t middle =
        last == std::string::npos || last == 0 ? last : line.rfind(',', last - 1);
    bool good = middle != std::string::npos && line.size() - last - 1 == 16;
    if (good) {
      try {
        std::size_t used = 0;
        const std::string pairs = line.substr(middle + 1, last - middle - 1);
        Answer answer{std::stoull(pairs, &used), 0};
        good = used == pairs.size();
        answer.checksum = std::stoull(line.substr(last + 1), &used, 16);
        good = good && used == 16;
        all.answers_[line.substr(0, middle)] = answer;
      } catch (const std::exception&) {
        good = false;
      }
    }
    if (!good)
      throw std::invalid_argument(path + ", line " + std::to_string(number) + ": '" + line +
                                  "' is not " + columns);
  }
  return all;
}

}  // namespace throng::bench::gpu
