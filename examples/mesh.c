/* Triangle meshes from C: two tetrahedra in one mesh, one of which sticks out of the other; then this
 * mesh and a plate that is moved. */
#include <throng/throng.h>

#include <stdio.h>
#include <stdlib.h>

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
  // snippet-end: mesh
  if (count != 3) return 1;

  // snippet-begin: two
  const float corners[] = {-9, -9, 0, 9, -9, 0, 0, 9, 0};
  const uint32_t corner_indices[] = {0, 1, 2};
  const double up[12] = {1, 0, 0, 0,    /* three rows of (rotation | translation); */
                         0, 1, 0, 0,    /* they must live as long as the mesh is used */
                         0, 0, 1, 0.5};
  throng_mesh plate = throng_mesh_packed(corners, 3, corner_indices, 1);
  plate.transform = up;

  throng_status status = throng_mesh_finder_find(finder, &mesh, &plate);
  pairs = throng_mesh_finder_pairs(finder, &count);
  throng_intersection* where = malloc(count * sizeof *where);
  if (status == THRONG_OK) {
    status = throng_mesh_finder_describe(finder, &mesh, &plate, pairs, count, where);
  }
  if (status != THRONG_OK) {
    fprintf(stderr, "%s\n", throng_mesh_finder_result(finder)->message);
    return 1;
  }
  for (size_t i = 0; i < count; ++i) {
    if (where[i].kind != THRONG_INTERSECTION_CROSSING) continue; /* a segment */
    const double *p = where[i].points[0], *q = where[i].points[1];
    printf("triangle %u is cut from (%g, %g, %g) to (%g, %g, %g)\n", pairs[i].first, p[0], p[1],
           p[2], q[0], q[1], q[2]);
  }
  free(where);
  throng_mesh_finder_destroy(finder);
  // snippet-end: two
  return count == 6 ? 0 : 1;
}
