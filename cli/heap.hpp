// A column of boxes that falls on a plane and becomes a heap: what `demo` moves.
//
// No physics engine: boxes do not turn, and each frame pushes overlapping ones a part of the way
// apart. It is enough to give the broad phase honest work: everything moves, thousands of boxes
// come together and part in each frame, and the pairs found are what moves them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <throng/types.hpp>

namespace throng::cli {

class Heap {
  struct Push {
    std::int32_t by[3];         // sum of the pushes, in 2^-20 of a unit
    std::uint16_t how_many[3];  // pushes along each axis
  };

 public:
  static constexpr std::size_t bytes_an_object = 3 * sizeof(Vec3) + sizeof(Push) + sizeof(Box);

  explicit Heap(std::size_t objects);

  std::size_t objects() const noexcept { return objects_; }
  // The objects, and last the plane: a box without end below z = 0.
  const std::vector<Box>& boxes() const noexcept { return boxes_; }

  // Lets everything fall for one frame.
  void fall();
  // Pushes boxes apart that overlap. The result does not depend on the order of the pairs: pushes
  // are added up as integers.
  void push_apart(const Pair* pairs, std::size_t count);

  // How many other objects each touches, by these pairs; the plane is no object.
  std::vector<float> touches(const Pair* pairs, std::size_t count) const;

 private:
  void push(std::uint32_t a, std::uint32_t b);
  void place(std::size_t i);

  std::size_t objects_;
  std::vector<Vec3> centre_, before_, velocity_;
  std::vector<Push> pushes_;
  std::vector<Box> boxes_;
};

}  // namespace throng::cli
