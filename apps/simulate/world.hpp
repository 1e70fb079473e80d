// Rigid bodies that fall on a plane: Bullet's dynamics over a selectable broad phase.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <throng/options.hpp>
#include <throng/types.hpp>

#include "apps/simulate/scenario.hpp"

namespace throng::simulate {

enum class Phase { throng, dbvt, axis_sweep };
const std::vector<std::string>& phase_names();
const char* to_string(Phase phase);

struct Spec {
  Scene scene = Scene::column;
  Shape shape = Shape::cube;
  Phase phase = Phase::throng;
  std::size_t objects = 0;
  std::uint64_t seed = 1;
  Options options;  // of Throng
  // Another broad phase gets the same boxes in every step, and the pairs are compared.
  bool compare = false;
};

struct StepReport {
  double step_ms = 0;         // the whole step, without a comparison
  double broad_phase_ms = 0;  // boxes passed on, and pairs found
};

struct Contacts {
  std::size_t points = 0;
  double deepest = 0;             // penetration, >= 0
  std::vector<float> of_objects;  // how many others (or the plane) each touches
};

// Of one comparison: pairs whose boxes overlap, by Bullet's own test.
struct Comparison {
  std::size_t pairs = 0;
  std::size_t missing = 0;  // in the other one only
  std::size_t extra = 0;    // in the other one; and what is no overlap in Throng's cache
};

class World {
 public:
  explicit World(const Spec& spec);
  ~World();
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  // 1/60 s.
  StepReport step();

  std::size_t objects() const noexcept;
  // Of the last step, as the broad phase got them; without the plane.
  const std::vector<Box>& boxes() const noexcept;
  // In the engine's pair cache; for btDbvt and axis-sweep not all of them overlap.
  std::size_t pairs() const noexcept;
  Contacts contacts() const;
  // Of the last step, if Spec requested it.
  const Comparison& comparison() const noexcept;
  // The centre of an object.
  Vec3 position(std::size_t object) const;

 private:
  struct Engine;
  std::unique_ptr<Engine> engine_;
};

}  // namespace throng::simulate
