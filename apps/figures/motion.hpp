// Boxes that move between walls, and their pairs as the library reports them. Integers only, so the
// result is the same everywhere; the motion is periodic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <throng/throng.hpp>

namespace throng::figures {

// Pseudo-random numbers that are the same everywhere. Draw one per statement: the evaluation order
// of a call's arguments is unspecified.
class Random {
 public:
  float below(float limit) {
    next();
    return static_cast<float>(state_ >> 40) * 0x1p-24f * limit;
  }
  // low <= it < high.
  int within(int low, int high) {
    next();
    return low + static_cast<int>((state_ >> 33) % static_cast<unsigned>(high - low));
  }

 private:
  void next() { state_ = state_ * 6364136223846793005ull + 1442695040888963407ull; }

  std::uint64_t state_ = 11;
};

inline constexpr int tick_count = 1000;

// From 0 to `length` and back, `laps` times in all ticks; lengths in tenths of a pixel. A lap of
// 1000 / laps ticks must be an even number of them.
struct Oscillation {
  int from, length, laps, phase;

  int half() const { return tick_count / laps / 2; }
  bool turns_at(int tick) const { return (tick + phase) % half() == 0; }
  int at(int tick) const {
    const int into = (tick + phase) % (2 * half());
    const int way = into <= half() ? into : 2 * half() - into;
    return from + (length * way + half() / 2) / half();
  }
};

// One object. Sizes in tenths of a pixel.
struct Mover {
  Oscillation x, y;
  int width, height;

  Box box(int tick) const {
    const float left = static_cast<float>(x.at(tick)), top = static_cast<float>(y.at(tick));
    return {{left, top, 0},
            {left + static_cast<float>(width), top + static_cast<float>(height), 0}};
  }
  // Of its centre, which moves in a straight line between turns.
  std::pair<int, int> middle(int tick) const {
    return {x.at(tick) + width / 2, y.at(tick) + height / 2};
  }
  bool turns_at(int tick) const { return x.turns_at(tick) || y.turns_at(tick); }
};

// A pair, from its begin tick to its end tick. One that spans the last and the first tick counts as
// two.
struct PairInterval {
  std::size_t first, second;
  int began, ended;
};

struct Motion {
  std::vector<Mover> movers;
  std::vector<PairInterval> intervals;  // by end tick
};

// `count` moving boxes in an area of that many pixels, and their pairs per tick from BroadPhase.
// Throws Error.
Motion motion(int count, int area_width, int area_height);

}  // namespace throng::figures
