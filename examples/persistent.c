/* Persistent objects from C: two boxes, one of which moves past the other. */
#include <throng/throng.h>

#include <stdio.h>

int main(void) {
  size_t began = 0, ended = 0, count;
  // snippet-begin: persistent
  throng_broad_phase* broad_phase = throng_broad_phase_create(NULL);
  throng_box boxes[2] = {{{0, 0, 0}, {1, 1, 1}}, {{-2.5f, 0, 0}, {-1.5f, 1, 1}}};
  throng_boxes view = throng_boxes_packed(boxes, 2);
  uint32_t ids[2];
  throng_status status = throng_broad_phase_add(broad_phase, &view, ids);

  for (int frame = 0; frame < 6 && status == THRONG_OK; ++frame) {
    boxes[1].lower[0] += 1;
    boxes[1].upper[0] += 1;
    const throng_boxes mover = throng_boxes_packed(&boxes[1], 1);
    status = throng_broad_phase_move(broad_phase, &ids[1], &mover);
    if (status == THRONG_OK) status = throng_broad_phase_update(broad_phase);

    const throng_live_pair* pairs = throng_broad_phase_begun(broad_phase, &count);
    for (size_t i = 0; i < count; ++i) {
      printf("frame %d: %u and %u begin to overlap\n", frame, pairs[i].first, pairs[i].second);
    }
    began += count;
    pairs = throng_broad_phase_ended(broad_phase, &count);
    for (size_t i = 0; i < count; ++i) {
      printf("frame %d: %u and %u separate\n", frame, pairs[i].first, pairs[i].second);
    }
    ended += count;
  }
  if (status != THRONG_OK) {
    fprintf(stderr, "%s\n", throng_broad_phase_result(broad_phase)->message);
  }
  // snippet-end: persistent

  // snippet-begin: ray
  const float origin[3] = {-9, 0.5f, 0.5f}, direction[3] = {1, 0, 0};
  const uint32_t all_layers = 0xffffffffu;
  throng_ray_hit hit;
  status = throng_broad_phase_raycast(broad_phase, origin, direction, 20, all_layers, &hit);
  if (status == THRONG_OK && hit.object != THRONG_NO_OBJECT) {
    printf("the ray hits %u after %g; normal %g %g %g\n", hit.object, hit.distance, hit.normal[0],
           hit.normal[1], hit.normal[2]);
  }
  throng_broad_phase_destroy(broad_phase);
  // snippet-end: ray
  return status == THRONG_OK && began == 1 && ended == 1 && hit.object == ids[0] ? 0 : 1;
}
