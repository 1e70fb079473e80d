// What the host gives to each step, and what the steps report to the host.

struct Parameters {
  box_count: u32,
  box_words: u32,     // 32-bit words from one box to the next
  upper_words: u32,   // from a box to its upper corner
  capacity: u32,      // pairs that fit the buffer of pairs
  table_cells: u32,   // of the grid's table, without its extra row
  has_filters: u32,   // 1: a pair needs (group a & mask b) and (group b & mask a)
  sorted: u32,        // 1: sorted order: nothing is written if the pairs do not fit
  unused: u32,
}

// All zero before the first step. 64-bit counts have two words.
struct Report {
  found_low: atomic<u32>,
  found_high: atomic<u32>,
  claimed: atomic<u32>,           // places of the buffer that are taken, possibly some beyond its end
  comparisons_low: atomic<u32>,
  comparisons_high: atomic<u32>,
  inactive: atomic<u32>,          // boxes with a NaN, or with lower > upper on some axis
  nan_count: atomic<u32>,
  nan_mark: atomic<u32>,          // ~index of the first one
  inverted_count: atomic<u32>,
  inverted_mark: atomic<u32>,
  occupied: atomic<u32>,          // bit c: size class c has boxes
  long_rows: atomic<u32>,         // rows of pairs that a workgroup sorts
}

// The index of a workgroup, of which at most 65,535 fit a dimension.
fn workgroup_index(workgroup: vec3<u32>, workgroups: vec3<u32>) -> u32 {
  return workgroup.y * workgroups.x + workgroup.x;
}
