// A user's program in C++20: containers as boxes, exceptions, two sets.
#include <throng/throng.hpp>

#include <cstdio>
#include <limits>
#include <span>
#include <vector>

#include "../expect.hpp"

int main() {
  std::vector<throng::Box> boxes(1000);
  for (int i = 0; i < 1000; ++i) {
    const float x = static_cast<float>(i);
    boxes[static_cast<std::size_t>(i)] = {{x, 0, 0}, {x + 1, 1, 1}};  // each touches the next
  }
  const std::vector<throng::Pair> chain =
      throng::find_pairs(boxes, {.order = throng::Order::canonical});
  EXPECT(chain.size() == 999);
  for (std::uint32_t i = 0; i < 999; ++i) EXPECT((chain[i] == throng::Pair{i, i + 1}));

  // The last box of the second set touches the first of the first set; no other pair.
  const std::vector<throng::Box> others = {{{-5, 0, 0}, {-4, 1, 1}}, {{-1, 0, 0}, {0, 1, 1}}};
  const auto across = throng::find_pairs(std::span<const throng::Box>(boxes), others);
  EXPECT(across.size() == 1 && (across[0] == throng::Pair{0, 1}));

  boxes[7].lower.y = std::numeric_limits<float>::quiet_NaN();
  try {
    throng::find_pairs(boxes);
    EXPECT(!"a NaN box must be refused");
  } catch (const throng::Error& error) {
    EXPECT(error.status() == throng::Status::nan_box);
    EXPECT(error.result().first_invalid == 7 && error.result().invalid_count == 1);
    EXPECT(error.what()[0] != '\0');
  }
  std::puts("C++20 consumer: ok");
  return 0;
}
