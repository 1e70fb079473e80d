// A method that finds all overlapping pairs: the library, a baseline or another library.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <throng/types.hpp>

namespace throng::bench {

struct Input {
  const Box* boxes = nullptr;
  std::size_t count = 0;
  const std::int32_t* worlds = nullptr;  // one per box, all >= 0: only equal ones pair
};

class Method {
 public:
  virtual ~Method() = default;
  // Not timed, once per scene: what a user does before the first frame (objects, capacity).
  virtual void prepare(const Input&) {}
  // Not timed, before each run: for libraries that keep bounds in their own objects.
  virtual void place(const Input&) {}
  // Timed: from the caller's boxes, all of which may have moved, to the pairs in memory.
  virtual void run(const Input&) = 0;
  // Not timed: appends the pairs of the last run; exact pairs only, first < second.
  virtual void collect(const Input&, std::vector<Pair>& out) const = 0;
};

enum class Origin { throng, baseline, other_library };

struct MethodInfo {
  std::string name;
  std::string note;  // how it is run, where that affects its time
  std::string
      variant;  // methods that share it are settings of one library: slower ones are dropped
  Origin origin = Origin::other_library;
  bool parallel = false;  // can use more than one thread
  std::function<std::unique_ptr<Method>(unsigned threads)> make;
};

// A growing buffer of pairs that does not initialize new memory and keeps it from run to run.
// Aligned: each thread has one, in an array.
class alignas(128) PairBuffer {
 public:
  // Where to write next, with capacity for `more` pairs.
  Pair* reserve(std::size_t more) {
    if (size_ + more > capacity_) grow(more);
    return data_.get() + size_;
  }
  void advance_to(const Pair* end) { size_ = static_cast<std::size_t>(end - data_.get()); }
  void push(Pair p) {
    *reserve(1) = p;
    ++size_;
  }
  void clear() { size_ = 0; }
  std::size_t size() const { return size_; }
  const Pair* begin() const { return data_.get(); }
  const Pair* end() const { return data_.get() + size_; }

 private:
  void grow(std::size_t more) {
    const std::size_t capacity = (size_ + more) * 2 + 1024;
    std::unique_ptr<Pair[]> bigger(new Pair[capacity]);
    for (std::size_t i = 0; i < size_; ++i) bigger[i] = data_[i];
    data_ = std::move(bigger);
    capacity_ = capacity;
  }
  std::unique_ptr<Pair[]> data_;
  std::size_t size_ = 0, capacity_ = 0;
};

inline bool overlap(const Box& a, const Box& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y &&
         b.lower.y <= a.upper.y && a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}
// Arithmetic: a compiler turns a comparison into a branch, which is mispredicted half of the time.
inline Pair ordered(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t swap = (a ^ b) & (0u - static_cast<std::uint32_t>(b < a));
  return {a ^ swap, b ^ swap};
}

}  // namespace throng::bench
