// Replaces counts by the sums of those before, in two steps: the first works in blocks of 2048
// counts, the second adds the sums of all earlier blocks. The table has whole blocks.

@group(0) @binding(0) var<storage, read_write> table: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read_write> sums: array<u32>;  // per block

var<workgroup> partial: array<u32, 256>;
var<workgroup> before_block: u32;

@compute @workgroup_size(256)
fn scan_blocks(@builtin(workgroup_id) workgroup: vec3<u32>,
               @builtin(num_workgroups) workgroups: vec3<u32>,
               @builtin(local_invocation_index) lane: u32) {
  let block = workgroup_index(workgroup, workgroups);
  let at = block * 512u + lane * 2u;
  let exists = at + 1u < arrayLength(&table);
  var low = vec4(0u);
  var high = vec4(0u);
  if exists {
    low = table[at];
    high = table[at + 1u];
  }
  let low_sum = low.x + low.y + low.z + low.w;
  let all = low_sum + high.x + high.y + high.z + high.w;
  partial[lane] = all;
  workgroupBarrier();
  for (var step = 1u; step < 256u; step *= 2u) {
    var earlier = 0u;
    if lane >= step { earlier = partial[lane - step]; }
    workgroupBarrier();
    partial[lane] += earlier;
    workgroupBarrier();
  }
  if !exists { return; }
  let before = partial[lane] - all;
  table[at] = vec4(before, before + low.x, before + low.x + low.y, before + low_sum - low.w);
  let middle = before + low_sum;
  table[at + 1u] = vec4(middle, middle + high.x, middle + high.x + high.y, middle + high.x + high.y + high.z);
  if lane == 255u { sums[block] = partial[255]; }
}

@compute @workgroup_size(256)
fn add_block_sums(@builtin(workgroup_id) workgroup: vec3<u32>,
                  @builtin(num_workgroups) workgroups: vec3<u32>,
                  @builtin(local_invocation_index) lane: u32) {
  let block = workgroup_index(workgroup, workgroups);
  let at = block * 512u + lane * 2u;
  let exists = at + 1u < arrayLength(&table);
  var sum = 0u;
  for (var k = lane; k < select(0u, block, exists); k += 256u) { sum += sums[k]; }
  partial[lane] = sum;
  workgroupBarrier();
  for (var half = 128u; half > 0u; half /= 2u) {
    if lane < half { partial[lane] += partial[lane + half]; }
    workgroupBarrier();
  }
  if !exists { return; }
  table[at] += vec4(partial[0]);
  table[at + 1u] += vec4(partial[0]);
}
