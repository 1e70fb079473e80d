// Sorted order: by first, then by second. A row is the pairs with one first index. While the search
// writes its pairs, it counts those of each row; scan_cells.wgsl makes these counts places. Then
// each pair goes to its row, and each row is sorted: by a thread if it is short, else by a
// workgroup.

@group(0) @binding(0) var<storage, read> counts: array<u32>;  // see write_counts.wgsl
@group(0) @binding(1) var<storage, read> found: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read_write> pairs: array<vec2<u32>>;
// The place of the next pair of each row; after the last one, the end of the row.
@group(0) @binding(3) var<storage, read_write> firsts: array<atomic<u32>>;

@compute @workgroup_size(256)
fn place_pairs(@builtin(workgroup_id) workgroup: vec3<u32>,
               @builtin(num_workgroups) workgroups: vec3<u32>,
               @builtin(local_invocation_index) lane: u32) {
  let all_threads = workgroups.x * workgroups.y * 256u;
  for (var k = workgroup_index(workgroup, workgroups) * 256u + lane; k < counts[0]; k += all_threads) {
    pairs[atomicAdd(&firsts[found[k].x], 1u)] = found[k];
  }
}
