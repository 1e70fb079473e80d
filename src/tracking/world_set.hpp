// The set of worlds (environments) in use, if they are few: a search for an object of world -1,
// which may pair with any world, visits each of them.
#pragma once

#include <cstddef>
#include <cstdint>

namespace throng::tracking {

class WorldSet {
 public:
  static constexpr std::size_t most = 32;

  // Counts an object of this world, which is not -1.
  void add(std::int32_t world) noexcept {
    ++objects_;
    const std::size_t k = find(world);
    if (k < size_) {
      ++count_[k];
    } else if (unlisted_ == 0 && size_ < most) {
      world_[size_] = world;
      count_[size_++] = 1;
    } else {
      ++unlisted_;
    }
  }
  // All objects of a listed world are counted there, because it was listed with its first object.
  void remove(std::int32_t world) noexcept {
    --objects_;
    const std::size_t k = find(world);
    if (k == size_) {
      --unlisted_;
    } else if (--count_[k] == 0) {
      world_[k] = world_[--size_];
      count_[k] = count_[size_];
    }
  }

  std::size_t objects() const noexcept { return objects_; }
  bool all_listed() const noexcept { return unlisted_ == 0; }
  const std::int32_t* begin() const noexcept { return world_; }
  const std::int32_t* end() const noexcept { return world_ + size_; }

 private:
  std::size_t find(std::int32_t world) const noexcept {
    std::size_t k = 0;
    while (k < size_ && world_[k] != world) ++k;
    return k;
  }

  std::int32_t world_[most] = {};
  std::size_t count_[most] = {};
  std::size_t size_ = 0, objects_ = 0, unlisted_ = 0;
};

}  // namespace throng::tracking
