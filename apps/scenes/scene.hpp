// Generated scenes: the same boxes for tests, benchmarks and pictures.
//
// Box i of frame f is a function of (spec, i, f) in integer arithmetic and correctly rounded double
// operations, so every compiler, thread and machine produces the same bits (in round-to-nearest
// mode, without fused multiply-add). z points up.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <throng/types.hpp>

namespace throng::scenes {

// Above it a double does not resolve a fast box's position to a fraction of its size.
inline constexpr std::size_t max_frames = 1 << 24;
// Below it boxes are too far apart.
inline constexpr double min_density = 1e-9, max_density = 1e6;

struct Spec {
  std::string name;
  std::size_t objects = 0;
  std::size_t frames = 1;
  double density = 0.0;  // expected pairs per box; 0: the scene's default
  std::uint64_t seed = 1;
  double moving = 1.0;  // share of the boxes that move between frames
};

// uniform   unit cubes at random in a cube; 0.5 pairs per box
// pile      unit cubes heaped in a column that is denser at its foot; 4.9
// column    box 0 is a plane, on which a column of unit cubes falls for 100 frames; about 3 at rest
// spheres   the boxes of spheres of diameter 1, 2 and 4; 1
// mixed     box 0 is a ground plane; cubes of log-uniform size 1:100; 4.7
// clusters  100 clusters of unit cubes, far apart in empty space; 0.5
// rods      64 x 1 x 1 along a random axis; 2.7
// line      unit cubes in one line along x; 1
// sparse    unit cubes at a very low density; 0.001
// worlds    64 unit cubes per world, all worlds in one place; 0.5 within a world
// rods-any  the boxes of rods of length 64 in random directions; 39
// rectangles  4 x 2 x 1 in a random one of six axis orders; 1
// nbody     boxes 0 to 3 are static cones, 4 x 4 x 4, one in each quadrant of the floor;
// the others are unit spheres that move above it; 1
const std::vector<std::string>& names();

class Generator;

// Cheap to copy; a Scene may be used by any number of threads at once.
class Scene {
 public:
  // Throws std::invalid_argument, which names the error and the allowed values.
  explicit Scene(const Spec& spec);

  // As given, with `density` resolved.
  const Spec& spec() const noexcept { return spec_; }
  std::size_t size() const noexcept { return spec_.objects; }

  // All boxes of frame f into out[0 .. size()-1]. f may go past spec().frames.
  void frame(std::size_t f, Box* out) const { boxes(f, 0, size(), out); }
  // Boxes begin .. end-1 of frame f into out[0 .. end-begin-1].
  void boxes(std::size_t f, std::size_t begin, std::size_t end, Box* out) const;

  // False: box i is the same in every frame.
  bool moves(std::size_t i) const noexcept;

  bool has_worlds() const noexcept;
  // The world of box i; -1 where the scene has none.
  std::int32_t world(std::size_t i) const noexcept;

  // The longest side of the region that contains the boxes, planes excluded.
  double side() const noexcept;

 private:
  Spec spec_;
  std::shared_ptr<const Generator> generator_;
};

}  // namespace throng::scenes
