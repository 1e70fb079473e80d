// A column of boxes that falls on a plane and becomes a heap, for `demo`.
//
// Not a physics engine: boxes do not rotate, and each frame pushes overlapping ones a part of the
// way apart. It gives the broad phase a realistic load: everything moves, thousands of pairs begin
// and end per frame, and the pairs drive the motion.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <throng/types.hpp>

namespace throng::cli {

class FallingBoxes {
  struct Push {
    std::int32_t by[3];         // sum of the pushes, in 2^-20 of a unit
    std::uint16_t how_many[3];  // number of pushes along each axis
  };

 public:
  static constexpr std::size_t bytes_an_object = 3 * sizeof(Vec3) + sizeof(Push) + sizeof(Box);

  explicit FallingBoxes(std::size_t objects);

  std::size_t objects() const noexcept { return objects_; }
  // The objects, then the plane: an infinite box below z = 0.
  const std::vector<Box>& boxes() const noexcept { return boxes_; }

  // The y coordinate of the middle row of objects at the start.
  float middle_row() const noexcept { return middle_row_; }

  // Advances all objects by one frame.
  void fall();
  // Pushes overlapping boxes apart. The result does not depend on the order of the pairs: pushes
  // are summed as integers.
  void push_apart(const Pair* pairs, std::size_t count);

  // The number of other objects that each touches; the plane does not count.
  std::vector<float> touches(const Pair* pairs, std::size_t count) const;

 private:
  void push(std::uint32_t a, std::uint32_t b);
  void place(std::size_t i);

  std::size_t objects_;
  float middle_row_ = 0;
  std::vector<Vec3> centre_, before_, velocity_;
  std::vector<Push> pushes_;
  std::vector<Box> boxes_;
};

}  // namespace throng::cli
