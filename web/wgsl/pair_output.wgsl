// The output of a workgroup of 64 threads: hits are collected in its memory, and some hundred are
// written with one addition to the global counter. Requires in the step's file: parameters,
// filters, pairs, report, firsts.

// All threads together add at most this many hits between two calls of write_hits().
const hits_per_round = 512u;
const max_hits = 1024u;

var<workgroup> hits: array<vec2<u32>, max_hits>;
var<workgroup> hit_count: atomic<u32>;
var<workgroup> comparisons: array<u32, 64>;
var<workgroup> shared_count: u32;
var<workgroup> shared_place: u32;

// Called first, by all threads. WGSL has zeros there, but lavapipe of Mesa 22 has not.
fn begin_output(lane: u32) {
  if lane == 0u { atomicStore(&hit_count, 0u); }
  workgroupBarrier();
}

fn are_allowed(a: u32, b: u32) -> bool {
  if parameters.has_filters == 0u { return true; }
  let p = filters[a];
  let q = filters[b];
  return (p.x & q.y) != 0u && (q.x & p.y) != 0u;
}

fn add_hit(a: u32, b: u32) {
  if !are_allowed(a, b) { return; }
  let at = atomicAdd(&hit_count, 1u);
  hits[at] = vec2(min(a, b), max(a, b));
}

// Counts all pairs in 64 bits: the sum wraps exactly if it is less than a summand. Places are
// claimed only while some are left, so this counter exceeds the capacity at most by the hits of one
// round per workgroup, and does not wrap.
fn claim(count: u32) -> u32 {
  let before = atomicAdd(&report.found_low, count);
  if before + count < count { atomicAdd(&report.found_high, 1u); }
  if atomicLoad(&report.claimed) >= parameters.capacity { return parameters.capacity; }
  return atomicAdd(&report.claimed, count);
}

// Writes the hits if they are at least this many. Called by all threads of the workgroup.
fn write_hits(lane: u32, at_least: u32) {
  workgroupBarrier();
  if lane == 0u { shared_count = atomicLoad(&hit_count); }
  let count = workgroupUniformLoad(&shared_count);
  if count < at_least { return; }
  if lane == 0u {
    shared_place = claim(count);
    atomicStore(&hit_count, 0u);
  }
  let place = workgroupUniformLoad(&shared_place);
  if place < parameters.capacity {
    for (var k = lane; k < min(count, parameters.capacity - place); k += 64u) {
      pairs[place + k] = hits[k];
      if parameters.sorted != 0u { atomicAdd(&firsts[hits[k].x], 1u); }
    }
  }
  workgroupBarrier();
}

// Before the next round: makes space for its hits.
fn reserve_hits(lane: u32) { write_hits(lane, max_hits - hits_per_round + 1u); }

// At the end, called by all threads: writes the rest, and reports each thread's comparisons.
fn finish_output(lane: u32, compared: u32) {
  comparisons[lane] = compared;
  write_hits(lane, 1u);
  if lane != 0u { return; }
  for (var k = 0u; k < 64u; k += 8u) {
    // Eight threads together have fewer than 2^32, as long as each has fewer than 2^29.
    var sum = 0u;
    for (var j = 0u; j < 8u; j++) { sum += comparisons[k + j]; }
    if sum == 0u { continue; }
    let before = atomicAdd(&report.comparisons_low, sum);
    if before + sum < sum { atomicAdd(&report.comparisons_high, 1u); }
  }
}
