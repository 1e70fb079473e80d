// The grid of the paper, section 4: cubic cells over a given environment. Each box is entered into every cell that it
// touches; in each cell runs the brute force, whose threads find their pair by the mapping of pair_index.wgsl.
//
// No pair is lost: per axis one function maps a coordinate to its cell, and it is non-decreasing. Boxes that overlap have
// ranges of cells that overlap, so some cell has both. No pair is reported twice: the cell that is the greater of the two
// lower ends on each axis has both boxes, and it alone reports the pair.
//
// After parameters.wgsl, ordered_keys.wgsl, records.wgsl, read_box.wgsl, pair_index.wgsl and pair_output.wgsl.

struct Grid {
  origin: vec3f,
  scale: f32,  // cells per unit of length
  cells: vec3<u32>,  // at most 1023 per axis
  max_entries: u32,
}
struct Range {
  low: u32,  // a cell, 10 bits per axis
  high: u32,
}
const no_range = 0xffffffffu;

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> boxes: array<u32>;
@group(0) @binding(2) var<uniform> grid: Grid;
@group(0) @binding(3) var<storage, read_write> ranges: array<Range>;
@group(0) @binding(4) var<storage, read_write> starts: array<atomic<u32>>;  // cleared, counted, then summed
@group(0) @binding(5) var<storage, read_write> places: array<atomic<u32>>;  // cleared; per cell, used in fill_entries
@group(0) @binding(6) var<storage, read_write> entries: array<u32>;
// search_cells:
@group(0) @binding(7) var<storage, read> filters: array<vec2<u32>>;
@group(0) @binding(8) var<storage, read_write> pairs: array<vec2<u32>>;
@group(0) @binding(9) var<storage, read_write> report: Report;
@group(0) @binding(10) var<storage, read_write> firsts: array<atomic<u32>>;

fn unpacked(cell: u32) -> vec3<u32> { return vec3(cell, cell >> 10u, cell >> 20u) & vec3(1023u); }
fn packed(cell: vec3<u32>) -> u32 { return cell.x | (cell.y << 10u) | (cell.z << 20u); }
fn index_of(cell: vec3<u32>) -> u32 { return (cell.z * grid.cells.y + cell.y) * grid.cells.x + cell.x; }

fn cell_of(keys: vec3<u32>) -> vec3<u32> {
  var x: vec3f;
  for (var k = 0u; k < 3u; k++) { x[k] = bitcast<f32>(bits_of_key(keys[k])); }
  return vec3<u32>(clamp((x - grid.origin) * grid.scale, vec3(0.0), vec3<f32>(grid.cells - vec3(1u))));
}

@compute @workgroup_size(256)
fn count_entries(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(num_workgroups) workgroups: vec3<u32>,
                 @builtin(local_invocation_index) lane: u32) {
  let i = workgroup_index(workgroup, workgroups) * 256u + lane;
  if i >= parameters.box_count { return; }
  let box = read_box(i);
  if !box.is_active {
    ranges[i] = Range(no_range, 0u);
    return;
  }
  let low = cell_of(box.record.lower.xyz);
  let high = cell_of(box.record.upper.xyz);
  ranges[i] = Range(packed(low), packed(high));
  for (var z = low.z; z <= high.z; z++) {
    for (var y = low.y; y <= high.y; y++) {
      for (var x = low.x; x <= high.x; x++) { atomicAdd(&starts[index_of(vec3(x, y, z))], 1u); }
    }
  }
}

@compute @workgroup_size(256)
fn fill_entries(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(num_workgroups) workgroups: vec3<u32>,
                @builtin(local_invocation_index) lane: u32) {
  let i = workgroup_index(workgroup, workgroups) * 256u + lane;
  if i >= parameters.box_count || ranges[i].low == no_range { return; }
  let low = unpacked(ranges[i].low);
  let high = unpacked(ranges[i].high);
  for (var z = low.z; z <= high.z; z++) {
    for (var y = low.y; y <= high.y; y++) {
      for (var x = low.x; x <= high.x; x++) {
        let cell = index_of(vec3(x, y, z));
        let at = atomicLoad(&starts[cell]) + atomicAdd(&places[cell], 1u);
        if at < grid.max_entries { entries[at] = i; }
      }
    }
  }
}

// One workgroup per cell. Nothing is searched if the entries do not fit: the host then makes the buffer larger.
@compute @workgroup_size(64)
fn search_cells(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(num_workgroups) workgroups: vec3<u32>,
                @builtin(local_invocation_index) lane: u32) {
  let cell = workgroup_index(workgroup, workgroups);
  let cell_count = grid.cells.x * grid.cells.y * grid.cells.z;
  begin_output(lane);
  var begin = 0u;
  var count = 0u;
  if cell < cell_count && atomicLoad(&starts[cell_count]) <= grid.max_entries {
    begin = atomicLoad(&starts[cell]);
    count = atomicLoad(&starts[cell + 1u]) - begin;
  }
  if lane == 0u {
    // More threads than an index has bits for: the host refuses the result.
    let fits = count <= max_column + 1u;
    if !fits { atomicStore(&report.long_rows, 1u); }
    shared_threads = select(0u, tiles_before(max(count, 1u) - 1u), fits);
  }
  let threads = workgroupUniformLoad(&shared_threads);
  for (var first = 0u; first < threads; first += 64u) {
    var hits = 0u;
    var compared = 0u;
    var own = 0u;
    var other = 0u;
    if first + lane < threads {
      // Place (row, column + 1): a pair has two different boxes.
      let column = column_of(first + lane);
      own = entries[begin + first + lane - tiles_before(column)];
      other = entries[begin + column + 1u];
      compared = 1u;
      let reporter = index_of(max(unpacked(ranges[own].low), unpacked(ranges[other].low)));
      if overlaps(read_box(own).record, read_box(other).record) && reporter == cell { hits = 1u; }
    }
    let place = end_round(lane, hits, compared);
    if hits != 0u { write_pair(place, own, other); }
  }
  report_comparisons(lane);
}
var<workgroup> shared_threads: u32;
