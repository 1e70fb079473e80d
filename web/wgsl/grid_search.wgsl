// Searches the grid, one box per thread: class by class, and within a class row by row of cells
// along x.

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> grid: SizeClassGrid;
@group(0) @binding(2) var<storage, read> table: array<u32>;  // first record of each cell
@group(0) @binding(3) var<storage, read> records: array<Record>;
@group(0) @binding(4) var<storage, read> filters: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read_write> pairs: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> report: Report;
@group(0) @binding(7) var<storage, read_write> firsts: array<atomic<u32>>;  // see sort_pairs.wgsl

// Of a thread in a round: the hits that it holds, and the comparisons that others wait for.
const max_hits = 8u;
const max_comparisons = 64u;

var<private> own: Record;
var<private> own_index: u32;
var<private> span: CellSpan;
var<private> size_class: u32;  // that is searched
var<private> x_first: u32;
var<private> x_last: u32;
var<private> y_first: u32;
var<private> y_last: u32;
var<private> z_last: u32;
var<private> y: u32;           // of the next row
var<private> z: u32;
var<private> in_own_row: bool;
var<private> at: u32;          // the records of a row that are left
var<private> end: u32;
var<private> mark: u32;        // of that row
var<private> held: array<u32, max_hits>;

fn select_class(c: u32, is_own: bool) {
  let shift = grid.classes[c].shift.xyz;
  let lower = span.lower >> shift;
  let upper = span.upper >> shift;
  let first = lower - min(lower, vec3(1u));
  size_class = c;
  x_first = first.x;
  x_last = upper.x;
  y_first = first.y;
  y_last = upper.y;
  z_last = upper.z;
  in_own_row = is_own;
  y = select(first.y, lower.y, is_own);
  z = select(first.z, lower.z, is_own);
}

fn next_row() {
  let row = row_start(size_class, y, z);
  at = select(table[row + x_first], own_index + 1u, in_own_row);
  end = table[row + x_last + 1u];
  mark = row_mark(size_class, y, z);
  in_own_row = false;
  if y == y_last {
    y = y_first;
    z++;
  } else {
    y++;
  }
}

// Moves on to records to compare; at >= end: there are no more.
fn advance(occupied: u32) {
  loop {
    if at < end || size_class >= grid.class_count { break; }
    if z <= z_last {
      next_row();
    } else {
      let later = (occupied >> size_class) >> 1u;
      size_class = select(size_class + 1u + countTrailingZeros(later), max_size_classes, later == 0u);
      if later != 0u { select_class(size_class, false); }
    }
  }
}

var<workgroup> some_continue: atomic<u32>;
var<workgroup> shared_continue: u32;

@compute @workgroup_size(64)
fn grid_search(@builtin(workgroup_id) workgroup: vec3<u32>,
               @builtin(num_workgroups) workgroups: vec3<u32>,
               @builtin(local_invocation_index) lane: u32) {
  let first = workgroup_index(workgroup, workgroups) * 64u;
  // The last entry of the table: the number of active boxes.
  let count = table[parameters.table_cells + max_row_cells];
  let occupied = atomicLoad(&report.occupied);
  own_index = first + lane;
  if lane == 0u { atomicStore(&some_continue, 0u); }
  begin_output(lane);
  let is_hashed = grid.hashed != 0u;
  size_class = max_size_classes;
  if own_index < count {
    own = records[own_index];
    span = cells_of(own);
    select_class(class_of(span), true);
    advance(occupied);
  }
  loop {
    var hits = 0u;
    var compared = 0u;
    while at < end && hits < max_hits && compared < max_comparisons {
      let other = records[at];
      compared++;
      at++;
      if overlaps(own, other) && (!is_hashed || other.upper.w == mark) &&
         are_allowed(own.lower.w, other.lower.w) {
        held[hits] = other.lower.w;
        hits++;
      }
      advance(occupied);
    }
    if at < end { atomicStore(&some_continue, 1u); }
    let place = end_round(lane, hits, compared);
    for (var k = 0u; k < hits; k++) { write_pair(place + k, own.lower.w, held[k]); }
    if lane == 0u {
      shared_continue = atomicLoad(&some_continue);
      atomicStore(&some_continue, 0u);
    }
    if workgroupUniformLoad(&shared_continue) == 0u { break; }
  }
  report_comparisons(lane);
}
