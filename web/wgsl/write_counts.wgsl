// What later passes of the caller read without the host: the number of pairs, and the arguments of
// an indirect dispatch with one thread per pair.

struct Counts {
  written: u32,     // pairs in the buffer
  found_low: u32,   // all pairs, 64 bits
  found_high: u32,
  nan_count: u32,   // boxes with a NaN; they overlap nothing
  groups_x: u32,    // workgroups of 64 threads, at byte 16
  groups_y: u32,
  groups_z: u32,
  inactive: u32,    // boxes with a NaN, or with lower > upper on some axis
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> report: Report;
@group(0) @binding(2) var<storage, read_write> counts: Counts;

@compute @workgroup_size(1)
fn write_counts() {
  let low = atomicLoad(&report.found_low);
  let high = atomicLoad(&report.found_high);
  let fits = high == 0u && low <= parameters.capacity;
  var written = min(low, parameters.capacity);
  if high != 0u { written = parameters.capacity; }
  if parameters.sorted != 0u && !fits { written = 0u; }
  let groups = (written + 63u) / 64u;
  let rows = (groups + 65534u) / 65535u;
  counts.written = written;
  counts.found_low = low;
  counts.found_high = high;
  counts.nan_count = atomicLoad(&report.nan_count);
  counts.groups_x = min(groups, 65535u);
  counts.groups_y = rows;
  counts.groups_z = 1u;
  counts.inactive = atomicLoad(&report.inactive);
}
