// Brute force over pairs of tiles of 64 boxes, one pair of tiles per workgroup. A thread has one
// box of the row's tile, and all go through the boxes of the column's tile together.

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> filters: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> records: array<Record>;
@group(0) @binding(3) var<storage, read_write> pairs: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> report: Report;
@group(0) @binding(5) var<storage, read_write> firsts: array<atomic<u32>>;  // see sort_pairs.wgsl

const tile_side = 64u;
// Of a round.
const columns_at_once = hits_per_round / tile_side;

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
  var compared = 0u;
  for (var first = 0u; first < tile_side; first += columns_at_once) {
    for (var j = max(first, begin); j < min(first + columns_at_once, end); j++) {
      let other = tile[j];
      compared++;
      if overlaps(own, other) { add_hit(own.lower.w, other.lower.w); }
    }
    reserve_hits(lane);
  }
  // A thread without a box has compared nothing that counts.
  if row * tile_side + lane >= count { compared = 0u; }
  finish_output(lane, compared);
}
