/* Triangle meshes from C: two tetrahedra in one mesh, one of which sticks out of the other. */
#include <throng/throng.h>

#include <stdio.h>

int main(void) {
  // snippet-begin: mesh
  const float vertices[] = {0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, 3,   /* a tetrahedron */
                            1, 1, 1, 2, 1, 1, 1, 2, 1, 1, 1, -1}; /* and one that sticks through */
  const uint32_t triangles[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3,
                                4, 6, 5, 4, 5, 7, 5, 6, 7, 6, 4, 7};
  const throng_mesh mesh = throng_mesh_packed(vertices, 8, triangles, 8);
  throng_options options;
  throng_options_init(&options);
  options.order = THRONG_ORDER_CANONICAL;

  throng_mesh_finder* finder = throng_mesh_finder_create(&options);
  if (throng_mesh_finder_find(finder, &mesh, NULL) != THRONG_OK) {
    fprintf(stderr, "%s\n", throng_mesh_finder_result(finder)->message);
    return 1;
  }
  size_t count;
  const throng_pair* pairs = throng_mesh_finder_pairs(finder, &count);
  for (size_t i = 0; i < count; ++i) {
    printf("triangle %u intersects triangle %u\n", pairs[i].first, pairs[i].second);
  }
  throng_mesh_finder_destroy(finder);
  // snippet-end: mesh
  return count == 3 ? 0 : 1;
}
