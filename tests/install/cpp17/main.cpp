// A program like a game engine: C++17, no exceptions, no RTTI; uses Finder and the forms that
// return a status.
#include <throng/throng.hpp>

#include <cstdio>
#include <limits>
#include <vector>

#include "../expect.hpp"

#if __cplusplus >= 202002L || defined(__cpp_exceptions) || defined(__cpp_rtti)
#error "compile this consumer as C++17 without exceptions and RTTI"
#endif

int main() {
  throng::Box boxes[3] = {{{0, 0, 0}, {1, 1, 1}}, {{1, 1, 1}, {2, 2, 2}}, {{3, 3, 3}, {4, 4, 4}}};

  throng::Finder finder;
  throng::Result result = finder.find(throng::Boxes(boxes, 3));
  EXPECT(result.ok() && result.found == 1 && finder.pairs().size() == 1);
  EXPECT((finder.pairs()[0] == throng::Pair{0, 1}));

  throng::Pair out[1] = {{9, 9}};
  result = finder.find(throng::Boxes(boxes, 3), out, 0);
  EXPECT(result.status == throng::Status::buffer_too_small && result.found == 1);
  EXPECT((out[0] == throng::Pair{9, 9}));
  result = finder.find(throng::Boxes(boxes, 3), out, 1);
  EXPECT(result.ok() && (out[0] == throng::Pair{0, 1}));

  std::size_t seen = 0;
  result = finder.consume(throng::Boxes(boxes, 3), [&](const throng::Pair*, std::size_t count) {
    seen += count;
    return true;
  });
  EXPECT(result.ok() && seen == 1);

  boxes[2].upper.x = std::numeric_limits<float>::quiet_NaN();
  std::vector<throng::Pair> pairs;
  result = throng::find_pairs(throng::Boxes(boxes, 3), pairs);
  EXPECT(result.status == throng::Status::nan_box && result.first_invalid == 2);
  EXPECT(result.message[0] != '\0' && throng::to_string(result.status)[0] != '\0');

  throng::Options options;
  options.nan = throng::NanPolicy::inactive;
  result = throng::find_pairs(throng::Boxes(boxes, 3), pairs, options);
  EXPECT(result.ok() && pairs.size() == 1 && result.inactive == 1);
  std::puts("C++17 consumer: ok");
  return 0;
}
