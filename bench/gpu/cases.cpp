#include "bench/cases.hpp"
#include "bench/gpu/cases.hpp"

#include <algorithm>
#include <stdexcept>
#include <thread>

#include "apps/scenes/npy.hpp"
#include "apps/scenes/scene.hpp"

namespace throng::bench::gpu {
namespace {

constexpr std::size_t K = 1000, M = 1000000;

Case uniform(const char* experiment, std::size_t objects, bool canonical) {
  // Different boxes in each frame, so that no frame finds its data in a cache; at 100M two frames
  // are larger than all caches.
  return {experiment, "uniform, density 2",         "uniform", 2,
          objects,    objects >= 100 * M ? 2u : 4u, canonical};
}

}  // namespace

std::vector<Case> cases_of(const std::string& part, std::size_t most) {
  std::vector<Case> all;
  if (part == "scaling") {
    for (const std::size_t n : {K, 10 * K, 100 * K, M, 10 * M, 100 * M})
      all.push_back(uniform("scaling", n, true));
  } else if (part == "stages") {
    for (const std::size_t n : {100 * K, M, 10 * M, 100 * M})
      all.push_back(uniform("stages", n, false));
    for (const char* name : {"pile", "mixed", "clusters"})
      for (const std::size_t n : {M, 10 * M}) {
        const SceneChoice& scene = find_scene(name);
        all.push_back({"stages", scene.label, scene.name, scene.density, n, 2, false});
      }
  } else if (part == "scenes") {
    const auto add = [&](const SceneChoice& s, std::size_t n) {
      all.push_back({"scenes", s.label, s.name, s.density, n, 2, false});
    };
    // Worlds first: 8192 of 64 boxes each. Then the other scenes.
    add(find_scene("worlds"), 8192 * 64);
    for (const char* name : {"pile", "mixed", "clusters"})
      for (const std::size_t n : {100 * K, M, 10 * M}) add(find_scene(name), n);
    for (const SceneChoice& s : all_scenes()) {
      const auto seen = [&](const Case& c) { return c.label == s.label && c.objects == M; };
      if (s.label == "uniform, density 2" || std::any_of(all.begin(), all.end(), seen)) continue;
      for (const std::size_t n : {100 * K, M}) add(s, n);
    }
  } else if (part == "crossover") {
    for (const std::size_t n : {K, 2 * K, 4 * K, 8 * K, 16 * K})
      for (const Algorithm algorithm : {Algorithm::all_pairs, Algorithm::grid}) {
        all.push_back(uniform("crossover", n, false));
        all.back().algorithm = algorithm;
      }
  } else {
    throw std::invalid_argument("no part is called '" + part + "'");
  }
  all.erase(std::remove_if(all.begin(), all.end(), [&](const Case& c) { return c.objects > most; }),
            all.end());
  return all;
}

std::vector<Case> cases_of_files(const std::vector<std::string>& files) {
  std::vector<Case> all;
  for (const std::string& path : files) {
    const scenes::BoxFile file = scenes::read_boxes(path);
    all.push_back({"files", path, "", 0, file.count, file.frames, false});
  }
  return all;
}

float mean_width(const Box* boxes, std::size_t n) {
  double sum = 0;
  const std::size_t some = std::min<std::size_t>(n, 1000);
  for (std::size_t i = 0; i < some; ++i)
    sum += static_cast<double>(boxes[i].upper.x) - static_cast<double>(boxes[i].lower.x);
  return static_cast<float>(sum / static_cast<double>(some));
}

struct FrameMaker::Source {
  std::unique_ptr<scenes::Scene> scene;
  bool backwards = false;
  scenes::BoxFile file;
};

FrameMaker::FrameMaker(const Case& c) : source_(std::make_unique<Source>()), objects_(c.objects) {
  if (c.scene.empty()) {
    source_->file = scenes::read_boxes(c.label);
    return;
  }
  scenes::Spec spec;
  spec.name = c.scene;
  spec.objects = c.objects;
  spec.density = c.density;
  spec.frames = 100;
  source_->scene = std::make_unique<scenes::Scene>(spec);
  // The column is dense at the end of its fall; in other scenes any frames will do.
  source_->backwards = c.scene == "column";
  // Not cleared: each thread is the first to touch its part.
  boxes_.reset(new Box[objects_]);
  if (!source_->scene->has_worlds()) return;
  worlds_.resize(objects_);
  for (std::size_t i = 0; i < objects_; ++i) worlds_[i] = source_->scene->world(i);
}

FrameMaker::~FrameMaker() = default;

const Box* FrameMaker::frame(std::size_t f) {
  if (!source_->scene) return source_->file.frame(f);
  const std::size_t at = source_->backwards ? 99 - f : f;
  const std::size_t threads = std::clamp<std::size_t>(
      objects_ / 20000, 1, std::max(1u, std::thread::hardware_concurrency()));
  std::vector<std::thread> pool;
  for (std::size_t t = 0; t < threads; ++t)
    pool.emplace_back([&, t] {
      const std::size_t begin = objects_ * t / threads, end = objects_ * (t + 1) / threads;
      source_->scene->boxes(at, begin, end, boxes_.get() + begin);
    });
  for (std::thread& t : pool) t.join();
  return boxes_.get();
}

}  // namespace throng::bench::gpu
