// Boxes that go to and fro between walls, and their pairs as the library tells them. All of it is
// in whole numbers, so it is the same everywhere; after the last tick all is as it was at the
// first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <throng/throng.hpp>

namespace throng::figures {

// Numbers that look random and are the same everywhere. Draw one a statement: the order in which
// arguments of a call are worked out is the compiler's.
class Chance {
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
struct Swing {
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
  Swing x, y;
  int width, height;

  Box box(int tick) const {
    const float left = static_cast<float>(x.at(tick)), top = static_cast<float>(y.at(tick));
    return {{left, top, 0},
            {left + static_cast<float>(width), top + static_cast<float>(height), 0}};
  }
  // Of its middle, which moves straight between turns.
  std::pair<int, int> middle(int tick) const {
    return {x.at(tick) + width / 2, y.at(tick) + height / 2};
  }
  bool turns_at(int tick) const { return x.turns_at(tick) || y.turns_at(tick); }
};

// A pair, from the tick when it began to the tick when it ended. One that lives at the last tick
// and at the first is two.
struct Life {
  std::size_t first, second;
  int began, ended;
};

struct Motion {
  std::vector<Mover> movers;
  std::vector<Life> lives;  // by when they end
};

// `count` movers in a room of that many pixels, and what BroadPhase says of their pairs at each
// tick. Throws Error.
Motion motion(int count, int room_width, int room_height);

}  // namespace throng::figures
