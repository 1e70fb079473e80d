/* The C API: three boxes in a row, and the pairs that touch. */
#include <throng/throng.h>

#include <stdio.h>

int main(void) {
  // snippet-begin: first
  const throng_box boxes[3] = {
      {{0, 0, 0}, {1, 1, 1}}, {{1, 0, 0}, {2, 1, 1}}, {{1.5f, 0.5f, 0}, {3, 2, 1}}};
  const throng_boxes view = throng_boxes_packed(boxes, 3);
  throng_options options;
  throng_options_init(&options);
  options.order = THRONG_ORDER_CANONICAL;
  options.inverted = THRONG_INVERTED_REFUSE; /* lower > upper is an error */

  throng_finder* finder = throng_finder_create(&options);
  if (throng_find(finder, &view, NULL) != THRONG_OK) {
    fprintf(stderr, "%s\n", throng_finder_result(finder)->message);
    return 1;
  }
  size_t count;
  const throng_pair* pairs = throng_finder_pairs(finder, &count);
  for (size_t i = 0; i < count; ++i) printf("%u touches %u\n", pairs[i].first, pairs[i].second);
  throng_finder_destroy(finder);
  // snippet-end: first
  return count == 2 ? 0 : 1;
}
