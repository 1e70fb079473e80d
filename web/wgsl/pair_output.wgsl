// The output of a workgroup of 64 threads. Each thread holds the hits of a round; the workgroup
// takes places for all of them with one addition to the global counter. Requires in the step's
// file: parameters, filters, pairs, report, firsts.

var<workgroup> round_hits: atomic<u32>;
var<workgroup> round_comparisons: atomic<u32>;
var<workgroup> shared_place: u32;
// Comparisons of all rounds, in the first thread.
var<private> compared_low: u32;
var<private> compared_high: u32;

// Called first, by all threads. WGSL has zeros there, but lavapipe of Mesa 22 has not.
fn begin_output(lane: u32) {
  if lane == 0u {
    atomicStore(&round_hits, 0u);
    atomicStore(&round_comparisons, 0u);
  }
  compared_low = 0u;
  compared_high = 0u;
  workgroupBarrier();
}

fn are_allowed(a: u32, b: u32) -> bool {
  if parameters.has_filters == 0u { return true; }
  let p = filters[a];
  let q = filters[b];
  return (p.x & q.y) != 0u && (q.x & p.y) != 0u;
}

// Counts all pairs in 64 bits: the sum wraps exactly if it is less than a summand. Places are taken
// only while some are left, so this counter exceeds the capacity at most by the hits of one round
// of each workgroup that runs, and does not wrap.
fn take_places(count: u32) -> u32 {
  let before = atomicAdd(&report.found_low, count);
  if before + count < count { atomicAdd(&report.found_high, 1u); }
  if atomicLoad(&report.claimed) >= parameters.capacity { return parameters.capacity; }
  return atomicAdd(&report.claimed, count);
}

// Called by all threads at the end of a round, with their hits and comparisons, together fewer than
// 2^32. Returns the place of this thread's first hit.
fn end_round(lane: u32, hits: u32, compared: u32) -> u32 {
  let offset = atomicAdd(&round_hits, hits);
  atomicAdd(&round_comparisons, compared);
  workgroupBarrier();
  if lane == 0u {
    let count = atomicLoad(&round_hits);
    let more = atomicLoad(&round_comparisons);
    atomicStore(&round_hits, 0u);
    atomicStore(&round_comparisons, 0u);
    compared_low += more;
    compared_high += select(0u, 1u, compared_low < more);
    shared_place = 0u;
    if count != 0u { shared_place = take_places(count); }
  }
  return workgroupUniformLoad(&shared_place) + offset;
}

fn write_pair(place: u32, a: u32, b: u32) {
  if place >= parameters.capacity { return; }
  let first = min(a, b);
  pairs[place] = vec2(first, max(a, b));
  if parameters.sorted != 0u { atomicAdd(&firsts[first], 1u); }
}

// After the last round.
fn report_comparisons(lane: u32) {
  if lane != 0u { return; }
  let before = atomicAdd(&report.comparisons_low, compared_low);
  let carry = select(0u, 1u, before + compared_low < compared_low);
  if compared_high + carry != 0u { atomicAdd(&report.comparisons_high, compared_high + carry); }
}
