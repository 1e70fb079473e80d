// The shortest use: boxes in, pairs out. The test compares the printed lines.
// snippet-begin: whole
#include <throng/throng.hpp>

#include <cstdio>
#include <vector>

int main() {
  std::vector<throng::Box> boxes = {
      {{0, 0, 0}, {2, 2, 2}},  // lower and upper corner
      {{1, 1, 1}, {3, 3, 3}},  // overlaps box 0
      {{3, 1, 1}, {4, 2, 2}},  // touches box 1: that counts
      {{9, 9, 9}, {9, 9, 9}},  // a point, far away
  };
  for (throng::Pair pair : throng::find_pairs(boxes)) {
    std::printf("%u touches %u\n", pair.first, pair.second);
  }
}
// snippet-end: whole
