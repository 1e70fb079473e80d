// The boxes at a time: each moves with a constant velocity and bounces off the walls of a cube.

struct Scene {
  box_count: u32,
  side: f32,   // of the cube 0 .. side
  time: f32,
  unused: f32,
}
struct Body {
  centre: vec3f,  // at time 0
  half: f32,      // half of the box's side
  velocity: vec3f,
  unused: f32,
}

@group(0) @binding(0) var<uniform> scene: Scene;
@group(0) @binding(1) var<storage, read> bodies: array<Body>;
@group(0) @binding(2) var<storage, read_write> boxes: array<f32>;  // lower, upper: 24 bytes each

@compute @workgroup_size(256)
fn move_boxes(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(num_workgroups) workgroups: vec3<u32>,
              @builtin(local_invocation_index) lane: u32) {
  let i = (workgroup.y * workgroups.x + workgroup.x) * 256u + lane;
  if i >= scene.box_count { return; }
  let body = bodies[i];
  // A path of length 2 side, there and back.
  let path = body.centre + body.velocity * scene.time;
  let along = path - 2.0 * scene.side * floor(path / (2.0 * scene.side));
  let centre = vec3(scene.side) - abs(along - vec3(scene.side));
  for (var k = 0u; k < 3u; k++) {
    boxes[6u * i + k] = centre[k] - body.half;
    boxes[6u * i + 3u + k] = centre[k] + body.half;
  }
}
