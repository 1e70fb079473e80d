// The number of boxes that each box touches: one thread per pair, dispatched indirectly.

@group(0) @binding(0) var<storage, read> counts: array<u32>;
@group(0) @binding(1) var<storage, read> pairs: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read_write> partners: array<atomic<u32>>;

@compute @workgroup_size(64)
fn count_partners(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
  let k = id.y * groups.x * 64u + id.x;
  if k >= counts[0] { return; }
  atomicAdd(&partners[pairs[k].x], 1u);
  atomicAdd(&partners[pairs[k].y], 1u);
}
