// One way to find all overlapping pairs, as the benchmark sees it.
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
  const std::int32_t* worlds = nullptr;  // one a box, all >= 0: only equal ones may pair
};

class Contender {
 public:
  virtual ~Contender() = default;
  // Outside the time, once for a scene: what a user does before the first frame (objects, room).
  virtual void prepare(const Input&) {}
  // Outside the time, before each run: where a rival keeps its bounds in objects of its own.
  virtual void place(const Input&) {}
  // Timed: from the caller's boxes, every one of which may have moved, to the pairs in memory.
  virtual void run(const Input&) = 0;
  // Outside the time: the pairs of the last run, appended; exact ones only, first < second.
  virtual void collect(const Input&, std::vector<Pair>& out) const = 0;
};

enum class Kind { library, plain, rival };

struct Entry {
  std::string name;
  std::string note;     // what the reader must know to judge its time
  std::string variant;  // entries that share it are settings of one thing: the slower are dropped
  Kind kind = Kind::rival;
  bool parallel = false;  // whether it can use more than one thread
  std::function<std::unique_ptr<Contender>(unsigned threads)> make;
};

// Room for pairs that grows without initialising what it gains, and is kept from run to run.
// A cache line of its own: each thread has one, side by side.
class alignas(128) PairBuffer {
 public:
  // Where to write next, with room for `more` pairs.
  Pair* room(std::size_t more) {
    if (size_ + more > capacity_) grow(more);
    return data_.get() + size_;
  }
  void advance_to(const Pair* end) { size_ = static_cast<std::size_t>(end - data_.get()); }
  void push(Pair p) {
    *room(1) = p;
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
// As arithmetic: a compiler makes a branch of a comparison, which half the time is guessed wrongly.
inline Pair ordered(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t swap = (a ^ b) & (0u - static_cast<std::uint32_t>(b < a));
  return {a ^ swap, b ^ swap};
}

}  // namespace throng::bench
