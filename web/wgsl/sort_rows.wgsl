// Sorts the pairs of each row by their second index (sort_pairs.wgsl).

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> counts: array<u32>;   // see write_counts.wgsl
@group(0) @binding(2) var<storage, read> firsts: array<u32>;   // the end of each row
@group(0) @binding(3) var<storage, read_write> pairs: array<vec2<u32>>;
@group(0) @binding(4) var<storage, read_write> rows: array<u32>;  // those that a workgroup sorts
@group(0) @binding(5) var<storage, read_write> report: Report;

const short_row = 32u;

fn row_begin(row: u32) -> u32 {
  if row == 0u { return 0u; }
  return firsts[row - 1u];
}

// One row per thread: by insertion, or left to a workgroup.
@compute @workgroup_size(256)
fn sort_rows(@builtin(workgroup_id) workgroup: vec3<u32>,
             @builtin(num_workgroups) workgroups: vec3<u32>,
             @builtin(local_invocation_index) lane: u32) {
  let row = workgroup_index(workgroup, workgroups) * 256u + lane;
  if row >= parameters.box_count || counts[0] == 0u { return; }
  let begin = row_begin(row);
  let end = firsts[row];
  if end - begin > short_row {
    rows[atomicAdd(&report.long_rows, 1u)] = row;
    return;
  }
  for (var k = begin + 1u; k < end; k++) {
    let own = pairs[k];
    var to = k;
    while to > begin {
      let other = pairs[to - 1u];
      if other.y < own.y { break; }
      pairs[to] = other;
      to--;
    }
    pairs[to] = own;
  }
}

var<workgroup> shared_begin: u32;
var<workgroup> shared_end: u32;
var<workgroup> shared_rows: u32;

// The lesser of two goes to the lower place. Places beyond the end hold a number that is greater
// than any.
fn exchange(low: u32, high: u32, end: u32) {
  if high >= end { return; }
  let a = pairs[low];
  let b = pairs[high];
  if a.y > b.y {
    pairs[low] = b;
    pairs[high] = a;
  }
}

// One row per workgroup at a time: a bitonic sort whose exchanges all go one way, so that the row
// may have any length. Sorted runs of half the size are merged: the first exchanges mirror one run,
// the others halve the distance.
@compute @workgroup_size(256)
fn sort_long_rows(@builtin(workgroup_id) workgroup: vec3<u32>,
                  @builtin(num_workgroups) workgroups: vec3<u32>,
                  @builtin(local_invocation_index) lane: u32) {
  if lane == 0u { shared_rows = atomicLoad(&report.long_rows); }
  let count = workgroupUniformLoad(&shared_rows);
  for (var k = workgroup.x; k < count; k += workgroups.x) {
    if lane == 0u {
      shared_begin = row_begin(rows[k]);
      shared_end = firsts[rows[k]];
    }
    let begin = workgroupUniformLoad(&shared_begin);
    let end = workgroupUniformLoad(&shared_end);
    for (var half = 1u; half < end - begin; half *= 2u) {
      for (var distance = half; distance > 0u; distance /= 2u) {
        // Exchange number j is of place `offset` of a run of 2 * distance places.
        for (var j = lane; begin + j / distance * 2u * distance < end; j += 256u) {
          let run = begin + j / distance * 2u * distance;
          let offset = j % distance;
          let high = select(run + distance + offset, run + 2u * distance - 1u - offset, distance == half);
          exchange(run + offset, high, end);
        }
        storageBarrier();
      }
    }
  }
}
