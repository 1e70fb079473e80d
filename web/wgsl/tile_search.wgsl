// Brute force over pairs of tiles of 64 boxes, one pair of tiles per workgroup. A thread has one
// box of the row's tile, and all go through the boxes of the column's tile together. As in the
// paper a pair is one bit; the bits stay in registers.

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> filters: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> records: array<Record>;
@group(0) @binding(3) var<storage, read_write> pairs: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> report: Report;
@group(0) @binding(5) var<storage, read_write> firsts: array<atomic<u32>>;  // see sort_pairs.wgsl

const tile_side = 64u;
var<workgroup> tile: array<Record, tile_side>;

@compute @workgroup_size(64)
fn tile_search(@builtin(workgroup_id) workgroup: vec3<u32>,
               @builtin(num_workgroups) workgroups: vec3<u32>,
               @builtin(local_invocation_index) lane: u32) {
  let count = parameters.box_count;
  let k = workgroup_index(workgroup, workgroups);
  if k >= tiles_before((count + tile_side - 1u) / tile_side) { return; }
  let column = column_of(k);
  let row = k - tiles_before(column);

  var own = no_record(0u);
  if row * tile_side + lane < count { own = records[row * tile_side + lane]; }
  tile[lane] = no_record(0u);
  if column * tile_side + lane < count { tile[lane] = records[column * tile_side + lane]; }
  begin_output(lane);

  // On the diagonal only boxes after the own one.
  let begin = select(0u, lane + 1u, row == column);
  let end = min(tile_side, count - column * tile_side);
  var bits = vec2(0u);
  for (var j = begin; j < end; j++) {
    let other = tile[j];
    if overlaps(own, other) && are_allowed(own.lower.w, other.lower.w) { bits[j / 32u] |= 1u << (j % 32u); }
  }
  let has_box = row * tile_side + lane < count;
  let compared = select(0u, max(end, begin) - begin, has_box);
  let hits = countOneBits(bits.x) + countOneBits(bits.y);
  var place = end_round(lane, hits, compared);
  for (var half = 0u; half < 2u; half++) {
    for (var left = bits[half]; left != 0u; left &= left - 1u) {
      write_pair(place, own.lower.w, tile[half * 32u + countTrailingZeros(left)].lower.w);
      place++;
    }
  }
  report_comparisons(lane);
}
