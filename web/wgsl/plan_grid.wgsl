// Chooses the cells and classes of the grid from a sample of the boxes, in one workgroup: the
// planner of src/device/plan, shorter. Here floats compute, as the choice affects speed alone:
// whatever grid is written, the proof in size_class_grid.wgsl holds. Coordinates are positions:
// multiples of the coarsest unit of fixed_point() of the three axes, or positions among knots. So
// there are no infinities, and no denormals that matter.

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> boxes: array<u32>;
@group(0) @binding(2) var<storage, read_write> grid: SizeClassGrid;

const sample_size = 128u;
const boxes_per_part = 4u;  // for the bounds
// In units of the axis: an extent, or a distance from 0, that counts as infinite.
const unbounded = 1073741824.0;
const max_class_cells = 4194304.0;
const knot_range = 33554432.0;  // positions among knots

// Costs in units of one comparison, as in src/device/plan/size_class_planner.hpp.
const row_cost = 1.5;
const hash_row_cost = 10.0;
const hash_cell_cost = 3.0;
const hash_compare_cost = 1.5;
const class_cost = 1.0;
const unused_cost = 1.25;
const knot_cost_threshold = 128.0;

// 16 sizes of cells for each of three schemes: cubes; cubes that are longer along some axes, for
// rods; cells with the proportions of the typical box.
const sizes = 16u;
const candidates = 48u;
const rods = 1u;
const one_cell = vec4<u32>(22u, 22u, 22u, 1u);

// Values per sampled box: three extents, their maximum, the centre.
const values = 7u;
const longest = 3u;
const centres = 4u;

var<workgroup> lower_keys: array<array<u32, sample_size>, 3>;
var<workgroup> upper_keys: array<array<u32, sample_size>, 3>;
var<workgroup> is_sampled: array<u32, sample_size>;
var<workgroup> value: array<array<f32, sample_size>, values>;
var<workgroup> sorted: array<array<f32, sample_size>, values>;
// By exponent: corners per axis; then, in the first 256, pairs by their distance.
var<workgroup> histogram: array<atomic<u32>, 768>;
var<workgroup> within: array<f32, 256>;  // pairs within 2^(e+1); then neighbours per box
var<workgroup> least_keys: array<atomic<u32>, 3>;
var<workgroup> greatest_keys: array<atomic<u32>, 3>;
var<workgroup> sample_count: u32;
var<workgroup> exponents: array<i32, 3>;
var<workgroup> factors: array<f32, 3>;  // an axis's unit, in the coarsest one
var<workgroup> low: array<f32, 3>;     // the range of nearly all boxes
var<workgroup> length: array<f32, 3>;
var<workgroup> is_unbounded: array<bool, 3>;       // most boxes are, along that axis: one cell
var<workgroup> has_unbounded: array<bool, 3>;      // some boxes are, most are not
var<workgroup> base: atomic<u32>;      // the least exponent that the sample resolves
var<workgroup> unit: f32;              // the distance with one neighbour per box
var<workgroup> costs: array<f32, candidates>;
var<workgroup> best: u32;
var<workgroup> first_cost: f32;
var<workgroup> try_knots: u32;

// ---- the sample ---------------------------------------------------------------------------------

// The box `behind` places after a random one of the k-th of 1024 equal parts of all boxes. Regular
// steps would match a regular order of the boxes.
fn sample_index(k: u32, behind: u32) -> u32 {
  let n = parameters.box_count;
  let begin = multiply_high(k << 22u, n);
  let end = select(multiply_high((k + 1u) << 22u, n), n, k == 1023u);
  let at = begin + multiply_high(end - begin, mix_bits(k ^ n));
  return select(at, at + behind, behind < n - at);
}

fn load_sample(lane: u32) {
  var least = vec3(0xffffffffu);
  var greatest = vec3(0u);
  for (var k = lane; k < 1024u * boxes_per_part; k += 256u) {
    let box = read_box(sample_index(k / boxes_per_part, k % boxes_per_part));
    if !box.is_active { continue; }
    least = min(least, box.record.lower.xyz);
    greatest = max(greatest, box.record.upper.xyz);
  }
  for (var axis = 0u; axis < 3u; axis++) {
    atomicMin(&least_keys[axis], least[axis]);
    atomicMax(&greatest_keys[axis], greatest[axis]);
  }
  if lane >= sample_size { return; }
  let box = read_box(sample_index(lane * 8u, 0u));
  is_sampled[lane] = select(0u, 1u, box.is_active);
  for (var axis = 0u; axis < 3u; axis++) {
    lower_keys[axis][lane] = box.record.lower[axis];
    upper_keys[axis][lane] = box.record.upper[axis];
  }
}

// Keeps the active boxes, in order.
fn compact(lane: u32) {
  var to = 0u;
  var all = 0u;
  var lower = vec3(0u);
  var upper = vec3(0u);
  if lane < sample_size {
    for (var k = 0u; k < sample_size; k++) {
      all += is_sampled[k];
      to += select(0u, is_sampled[k], k < lane);
    }
    for (var axis = 0u; axis < 3u; axis++) {
      lower[axis] = lower_keys[axis][lane];
      upper[axis] = upper_keys[axis][lane];
    }
    if lane == 0u { sample_count = all; }
  }
  workgroupBarrier();
  if lane < sample_size && is_sampled[lane] != 0u {
    for (var axis = 0u; axis < 3u; axis++) {
      lower_keys[axis][to] = lower[axis];
      upper_keys[axis][to] = upper[axis];
    }
  }
}

// Counts the finite corners by the exponents of their floats.
fn count_exponents(lane: u32) {
  if lane >= sample_count { return; }
  for (var axis = 0u; axis < 3u; axis++) {
    for (var k = 0u; k < 2u; k++) {
      let key = select(lower_keys[axis][lane], upper_keys[axis][lane], k == 1u);
      let exponent = (bits_of_key(key) >> 23u) & 255u;
      if exponent < 255u { atomicAdd(&histogram[axis * 256u + exponent], 1u); }
    }
  }
}

// The unit of an axis: 95 % of the corners are below 2^28 units, without those beyond 2e31, which stand
// for infinite ones where they are less than half.
fn choose_exponent(axis: u32) {
  var usual = 0u;
  var all = 0u;
  for (var e = 0u; e < 255u; e++) {
    all += atomicLoad(&histogram[axis * 256u + e]);
    if e < 231u { usual = all; }
  }
  if usual * 2u > all { all = usual; }
  var exponent = 0u;
  var seen = 0u;
  while exponent < 254u {
    seen += atomicLoad(&histogram[axis * 256u + exponent]);
    if seen * 20u >= all * 19u { break; }
    exponent++;
  }
  exponents[axis] = max(i32(exponent) - 154, -149);
}

fn choose_factor(axis: u32) {
  let coarsest = max(exponents[0], max(exponents[1], exponents[2]));
  factors[axis] = bitcast<f32>(u32(max(127 + exponents[axis] - coarsest, 27)) << 23u);
}

// ---- positions ----------------------------------------------------------------------------------

fn position_of(axis: u32, key: u32, knots: bool) -> f32 {
  if knots { return f32(position_among_knots(axis, key)); }
  return f32(fixed_point(key, exponents[axis])) * factors[axis];
}

fn place(lane: u32, knots: bool) {
  atomicStore(&histogram[lane], 0u);
  if lane == 0u { atomicStore(&base, 254u); unit = unbounded; }
  if lane >= sample_count { return; }
  var extent = 0.0;
  for (var axis = 0u; axis < 3u; axis++) {
    let lower = position_of(axis, lower_keys[axis][lane], knots);
    let upper = position_of(axis, upper_keys[axis][lane], knots);
    let along = upper - lower;
    value[axis][lane] = along;
    value[centres + axis][lane] = 0.5 * lower + 0.5 * upper;
    // Cells cannot separate unbounded boxes.
    var is_finite = along < unbounded * factors[axis];
    if knots { is_finite = !is_unbounded[axis] && (!has_unbounded[axis] || along < 0.999 * knot_range); }
    extent = max(extent, select(0.0, along, is_finite));
  }
  value[longest][lane] = extent;
}

// Each value's place is the number of lesser ones.
fn sort(lane: u32) {
  let n = sample_count;
  for (var item = lane; item < values * sample_size; item += 256u) {
    let which = item / sample_size;
    let j = item % sample_size;
    if j >= n { continue; }
    let own = value[which][j];
    var rank = 0u;
    for (var k = 0u; k < n; k++) {
      let other = value[which][k];
      rank += select(0u, 1u, other < own || (other == own && k < j));
    }
    sorted[which][rank] = own;
  }
}

// Counts pairs by distance, the greatest of the axes: each box is compared with its successors,
// cyclically, up to half of all.
fn count_distances(lane: u32) {
  let n = sample_count;
  let j = lane % sample_size;
  if j >= n { return; }
  for (var after = lane / sample_size + 1u; after <= n / 2u; after += 2u) {
    if 2u * after == n && j >= after { continue; }
    let other = select(j + after - n, j + after, j + after < n);
    var distance = 0.0;
    for (var axis = 0u; axis < 3u; axis++) {
      distance = max(distance, abs(value[centres + axis][j] - value[centres + axis][other]));
    }
    atomicAdd(&histogram[min(bitcast<u32>(distance) >> 23u, 255u)], 1u);
  }
}

fn measure_range(axis: u32, knots: bool) {
  if knots {
    low[axis] = 0.0;
    length[axis] = knot_range;
    return;
  }
  let n = sample_count;
  let least = position_of(axis, atomicLoad(&least_keys[axis]), false);
  let greatest = position_of(axis, atomicLoad(&greatest_keys[axis]), false);
  let most = unbounded * factors[axis];
  is_unbounded[axis] = sorted[axis][n / 2u] >= most;
  has_unbounded[axis] = !is_unbounded[axis] && (least <= -most || greatest >= most);
  // Excludes the few boxes that stretch the range; these are clamped into the outermost cells.
  let inner_low = sorted[centres + axis][n / 20u];
  let inner_high = sorted[centres + axis][n - 1u - n / 20u];
  var large = n - 1u - n / 10u;
  while large > n / 2u && sorted[axis][large] >= most { large--; }
  let slack = 0.5 * (inner_high - inner_low) + sorted[axis][large];
  let begin = clamp(max(least, inner_low - slack), -most, most);
  let end = clamp(min(greatest, inner_high + slack), begin, most);
  // A margin for ends that the sample misses.
  let missed = select(0.0, (end - begin) / 512.0, n < parameters.box_count);
  low[axis] = max(begin - missed, -most);
  length[axis] = max(min(end + missed, most) - low[axis], factors[axis]);
}

fn sum_distances(lane: u32) {
  within[lane] = f32(atomicLoad(&histogram[lane]));
  workgroupBarrier();
  for (var step = 1u; step < 256u; step *= 2u) {
    var earlier = 0.0;
    if lane >= step { earlier = within[lane - step]; }
    workgroupBarrier();
    within[lane] += earlier;
    workgroupBarrier();
  }
  // The least distance within which the sample has some pairs.
  if within[lane] >= 8.0 && lane < 254u { atomicMin(&base, lane); }
}

// The number of other boxes with their centre within 2^(e+1) along every axis, from the pairs of
// the sample. Below the least distance that it resolves, the growth rate is extrapolated.
fn count_neighbours(lane: u32) {
  let n = f32(sample_count);
  let scale = f32(parameters.box_count) / max(0.5 * n * (n - 1.0), 1.0);
  let least = atomicLoad(&base);
  let base_pairs = within[least];
  var growth = 8.0;
  if base_pairs > 0.0 { growth = clamp(within[least + 1u] / base_pairs, 2.0, 8.0); }
  var count = scale * within[lane];
  if lane < least {
    let there = select(1.0, scale * base_pairs, base_pairs > 0.0);
    count = there * exp2(-log2(growth) * f32(min(least - lane, 60u)));
  }
  workgroupBarrier();
  within[lane] = count;
  workgroupBarrier();
  if count >= 1.0 && lane > 0u && within[lane - 1u] < 1.0 {
    unit = bitcast<f32>(min(lane + 1u, 158u) << 23u);
  }
}

fn neighbours(radius: f32) -> f32 {
  let bits = bitcast<u32>(radius);
  let exponent = bits >> 23u;
  if exponent == 0u || exponent > 255u { return 0.0; }
  let part = bitcast<f32>((bits & 0x7fffffu) | 0x3f800000u) - 1.0;
  return mix(within[exponent - 1u], within[exponent], part);
}

// ---- the candidates -----------------------------------------------------------------------------

// Of a thread's candidate:
var<private> cells: vec3<u32>;  // finest cells
var<private> doublings: u32;    // classes twice as large as the one before
var<private> class_count: u32;
var<private> shifts: array<vec4<u32>, max_size_classes>;
var<private> offsets: array<u32, max_size_classes>;
var<private> is_hashed: bool;

fn power_of_two(exponent: u32) -> f32 { return f32(1u << min(exponent, 31u)); }

// Quantiles of the extents, and multiples of the distance with one neighbour.
fn side_of(candidate: u32, axis: u32) -> f32 {
  let n = sample_count;
  let scheme = candidate / sizes;
  let size = candidate % sizes;
  let short_side = sorted[longest][n / 10u];
  let middle = sorted[longest][n / 2u];
  let long_side = sorted[longest][n - 1u - n / 10u];
  let thin = min(sorted[0][n / 2u], min(sorted[1][n / 2u], sorted[2][n / 2u]));
  var measure = unit;
  var times = 1.0;
  switch size {
    case 0u { measure = short_side; }
    case 1u { measure = middle; }
    case 2u { measure = long_side; }
    case 3u { measure = thin; }
    case 4u { measure = short_side; times = 2.0; }
    case 5u { measure = short_side; times = 4.0; }
    case 6u {
      // For rods just over half: doubling such cells once fits long boxes.
      measure = select(thin, long_side, scheme == rods);
      times = select(2.0, 0.52, scheme == rods);
    }
    case 7u { measure = middle; times = 2.0; }
    case 9u { times = 1.26; }
    case 10u { times = 1.59; }
    case 11u { times = 2.0; }
    case 12u { times = 2.52; }
    case 13u { times = 3.17; }
    case 14u { times = 4.0; }
    case 15u { times = 8.0; }
    default { }
  }
  // A position is truncated, so that an extent may be one more than it is here.
  let side = max(times * measure * 1.0001 + 1.0, 1.0);
  if scheme != 2u { return side; }
  let typical = max(middle, 1.0);
  return max(side * max(sorted[axis][n / 2u], typical * 0.01) / typical, 1.0);
}

fn cells_of_class(finest: u32, shift: u32) -> u32 { return ((finest - 1u) >> shift) + 1u; }
fn class_cells(shift: vec4<u32>) -> vec3<u32> {
  return vec3(cells_of_class(cells.x, shift.x), cells_of_class(cells.y, shift.y), cells_of_class(cells.z, shift.z));
}

// One or two of three axes: x, y, z, yz, zx, xy.
fn some_axes(number: u32) -> u32 { return select(7u ^ (1u << ((number - 3u) & 3u)), 1u << number, number < 3u); }

// Cubes: each class doubles the cells, and beyond the sample's largest boxes multiplies them by
// eight. For rods: a class for each axis, or two, along which boxes are long. The last component: 1
// if c is beyond these.
fn bounded_class(is_rods: bool, c: u32) -> vec4<u32> {
  var shift = vec3(select(doublings + 3u * (c - doublings), c, c <= doublings));
  if is_rods {
    var axes = 7u;
    if c == 0u { axes = 0u; } else if c <= 6u { axes = some_axes(c - 1u); }
    let more = select(0u, 2u * (c - 7u), c > 7u);
    for (var k = 0u; k < 3u; k++) { shift[k] = select(0u, doublings + more, ((axes >> k) & 1u) != 0u); }
  }
  shift = min(shift, vec3(22u));
  let count = class_cells(vec4(shift, 0u));
  var crosses = false;
  for (var k = 0u; k < 3u; k++) { crosses = crosses || (has_unbounded[k] && count[k] <= 2u); }
  // Two cells on that axis fit unbounded boxes, which have a finer class.
  let beyond = all(count == vec3(1u)) || (crosses && shift.x > doublings);
  return vec4(shift, select(0u, 1u, beyond));
}

// The classes for bounded boxes are followed by one for each axis, or two, along which some boxes
// are unbounded: one cell on these axes. The last component: 1 for the last class, which has one
// cell.
fn class_shift(is_rods: bool, c: u32) -> vec4<u32> {
  var some = 0u;
  for (var k = 0u; k < 3u; k++) { some |= select(0u, 1u << k, has_unbounded[k]); }
  let axis_count = countOneBits(some);
  let more = axis_count * (axis_count + 1u) / 2u;
  // The first class beyond the bounded ones; without unbounded boxes only c matters.
  var bounded = select(0u, c, some == 0u);
  var shift = vec4(0u);
  loop {
    if some != 0u && bounded + more + 1u >= max_size_classes { break; }
    shift = bounded_class(is_rods, bounded);
    if shift.w != 0u || bounded == c { break; }
    bounded++;
  }
  if some != 0u && (shift.w != 0u || bounded != c || bounded + more + 1u >= max_size_classes) {
    var left = c - bounded;
    var axes = 0u;
    for (var number = 0u; number < 6u; number++) {
      let these = some_axes(number);
      if (these & ~some) != 0u { continue; }
      if left == 0u { axes = these; }
      left--;
    }
    for (var k = 0u; k < 3u; k++) { shift[k] = select(doublings, 22u, ((axes >> k) & 1u) != 0u); }
    shift.w = select(0u, 1u, axes == 0u);
  }
  if shift.w != 0u || c + 1u == max_size_classes || all(class_cells(shift) == vec3(1u)) { return one_cell; }
  return shift;
}

// The classes, and whether the table holds all cells.
fn lay_out(is_rods: bool) {
  var sum = 0u;
  var total = 0.0;
  var c = 0u;
  loop {
    let shift = class_shift(is_rods, c);
    let count = select(class_cells(shift), vec3(1u), shift.w != 0u);
    shifts[c] = shift;
    offsets[c] = sum;
    total += f32(count.x) * f32(count.y) * f32(count.z);
    // Wraps only if `total` is too large.
    sum += count.x * count.y * count.z;
    c++;
    if shift.w != 0u { break; }
  }
  class_count = c;
  is_hashed = total > 4.0e9 || sum > parameters.table_cells;
}

fn divide(candidate: u32) {
  let is_rods = candidate / sizes == rods;
  let n = sample_count;
  var first_side = 0.0;
  for (var k = 0u; k < 3u; k++) {
    let side = side_of(candidate, k);
    first_side = select(first_side, side, k == 0u);
    var count = select(length[k] / side, 1.0, is_unbounded[k]);
    // Layers of rods that would all fit in one such cell are divided by a few thin cells.
    let thick = sorted[k][n - 1u - n / 10u];
    if is_rods && count < 2.0 && 4.0 * thick < length[k] { count = min(8.0, length[k] / (2.0 * max(thick, 1.0))); }
    cells[k] = clamp(u32(min(count, min(max_class_cells, length[k] / factors[k]))), 1u, u32(max_class_cells));
  }
  let reach = sorted[longest][select(n - 1u, n - 1u - n / 10u, is_rods)];
  doublings = select(0u, 1u, is_rods);
  while doublings < 20u && first_side * power_of_two(doublings) < reach { doublings++; }
  loop {
    lay_out(is_rods);
    // These indices must fit a row's mark, and a row the end of the table.
    if !is_hashed || all(cells <= vec3(max_row_cells)) { break; }
    cells = min(cells, vec3(max_row_cells));
  }
}

// ---- their costs --------------------------------------------------------------------------------

var<private> share: array<f32, max_size_classes>;              // of the priced boxes
var<private> across: array<vec3<f32>, max_size_classes>;  // mean extents, in finest cells
var<private> side: vec3<f32>;

// Expected cost per box of one class that searches another, or its own: rows and comparisons.
fn price(from_class: u32, to_class: u32, per_box: f32) -> f32 {
  let n = f32(parameters.box_count);
  let shift = shifts[to_class];
  let there = select(class_cells(shift), vec3(1u), shift.w != 0u);
  var width = vec3(0.0);
  var narrow = 0.0;
  var rows = 1.0;
  var visited = 1.0;
  for (var k = 0u; k < 3u; k++) {
    let cell = power_of_two(shift[k]);
    let extent = across[from_class][k];
    let over = min(extent / cell + 2.0, f32(there[k]));
    if k > 0u { rows *= over; }
    visited *= over;
    // Unbounded boxes share one place along that axis.
    width[k] = select(min(side[k] * (extent + 2.0 * cell), length[k]), 0.0, is_unbounded[k]);
    if width[k] > 0.0 && (narrow == 0.0 || width[k] < narrow) { narrow = width[k]; }
  }
  var compared = n;
  if narrow > 0.0 {
    compared = neighbours(0.5 * narrow);
    for (var k = 0u; k < 3u; k++) {
      if width[k] > 0.0 { compared *= width[k] / narrow; }
    }
  }
  compared = 1.0 + min(compared, n) * share[to_class] * per_box;
  var cost = compared + rows * row_cost;
  if is_hashed {
    cost = compared * hash_compare_cost + rows * hash_row_cost +
           visited * hash_cell_cost * n / f32(parameters.table_cells);
  }
  return select(1.0, 0.5, from_class == to_class) * (cost + class_cost) * share[from_class] * per_box;
}

fn cost_of(candidate: u32) -> f32 {
  divide(candidate);
  side = vec3(length[0], length[1], length[2]) / vec3<f32>(cells);
  for (var c = 0u; c < max_size_classes; c++) {
    share[c] = 0.0;
    across[c] = vec3(0.0);
  }
  // 32 to 63 boxes.
  let step = max(sample_count / 32u, 1u);
  var count = 0.0;
  for (var j = 0u; j < sample_count; j += step) {
    count += 1.0;
    let extent = vec3(value[0][j], value[1][j], value[2][j]);
    var c = 0u;
    while c + 1u < class_count {
      let shift = shifts[c];
      let there = class_cells(shift);
      // One cell fits any box.
      let bound = side * vec3(power_of_two(shift.x), power_of_two(shift.y), power_of_two(shift.z));
      if all((extent <= bound) | (there == vec3(1u))) { break; }
      c++;
    }
    share[c] += 1.0;
    across[c] += min(extent, vec3(length[0], length[1], length[2]));
  }
  for (var c = 0u; c < class_count; c++) {
    if share[c] > 0.0 { across[c] = across[c] / (share[c] * side); }
  }
  var sum = 0.0;
  for (var from_class = 0u; from_class < class_count; from_class++) {
    if share[from_class] == 0.0 { continue; }
    for (var to_class = from_class; to_class < class_count; to_class++) {
      if share[to_class] > 0.0 { sum += price(from_class, to_class, 1.0 / count); }
    }
  }
  // If no sampled box is of the finest class (for rods, of the finest seven), every search still
  // visits it.
  var in_finest = 0.0;
  let finest = min(class_count, select(1u, 7u, candidate / sizes == rods));
  for (var c = 0u; c < finest; c++) { in_finest += share[c]; }
  return select(sum, sum * unused_cost, in_finest == 0.0);
}

fn choose() {
  best = 0u;
  for (var k = 1u; k < candidates; k++) {
    if costs[k] < costs[best] { best = k; }
  }
}

// ---- the grid -----------------------------------------------------------------------------------

fn write_grid(knots: bool) {
  grid.class_count = class_count;
  grid.table_cells = parameters.table_cells;
  grid.hashed = select(0u, 1u, is_hashed);
  grid.uses_knots = select(0u, 1u, knots);
  for (var k = 0u; k < 3u; k++) {
    let begin = i32(clamp(low[k] / factors[k], -unbounded, unbounded));
    let end = max(i32(clamp((low[k] + length[k]) / factors[k], -unbounded, unbounded)), begin);
    grid.exponent[k] = exponents[k];
    grid.low[k] = begin;
    grid.high[k] = end;
    let positions = select(f32(end) - f32(begin) + 1.0, knot_range, knots);
    grid.scale[k] = u32(min(f32(cells[k]) / positions * 4294967296.0, 4294967040.0));
    grid.last[k] = cells[k] - 1u;
  }
  for (var c = 0u; c < class_count; c++) {
    let shift = shifts[c];
    let count = select(class_cells(shift), vec3(1u), shift.w != 0u);
    grid.classes[c].shift = shift;
    grid.classes[c].cells = vec4(count, offsets[c]);
  }
}

// Without a sample: one cell.
fn write_one_cell() {
  grid.class_count = 1u;
  grid.table_cells = parameters.table_cells;
  grid.hashed = 0u;
  grid.uses_knots = 0u;
  for (var k = 0u; k < 3u; k++) {
    grid.exponent[k] = 0;
    grid.low[k] = 0;
    grid.high[k] = 0;
    grid.scale[k] = 0u;
    grid.last[k] = 0u;
  }
  grid.classes[0].shift = one_cell;
  grid.classes[0].cells = vec4(1u, 1u, 1u, 0u);
}

// Knots at quantiles of the lower corners, so that each span has about as many of them.
fn place_knots(lane: u32) {
  if lane >= 3u * max_knots { return; }
  let axis = lane / max_knots;
  let k = lane % max_knots;
  let n = sample_count;
  var ends = vec2(0u, 0xffffffffu);
  // The key at each of two ranks, by counting lesser ones.
  for (var j = 0u; j < n; j++) {
    let own = lower_keys[axis][j];
    var rank = 0u;
    for (var i = 0u; i < n; i++) {
      let other = lower_keys[axis][i];
      rank += select(0u, 1u, other < own || (other == own && i < j));
    }
    if k > 0u && rank == k * (n - 1u) / max_knots { ends.x = own; }
    if k + 1u < max_knots && rank == (k + 1u) * (n - 1u) / max_knots { ends.y = own; }
  }
  let distance = max(ends.y - ends.x, 1u);
  let shift = countLeadingZeros(distance);
  let scale = u32(min(4503599627370496.0 / f32(distance << shift), 4294967040.0));
  grid.knots[lane] = Knot(ends.x, shift, scale, 0u);
}

@compute @workgroup_size(256)
fn plan_grid(@builtin(local_invocation_index) lane: u32) {
  for (var k = lane; k < 768u; k += 256u) { atomicStore(&histogram[k], 0u); }
  if lane < 3u {
    atomicStore(&least_keys[lane], 0xffffffffu);
    atomicStore(&greatest_keys[lane], 0u);
  }
  workgroupBarrier();
  load_sample(lane);
  workgroupBarrier();
  compact(lane);
  workgroupBarrier();
  if workgroupUniformLoad(&sample_count) == 0u {
    if lane == 0u { write_one_cell(); }
    return;
  }
  count_exponents(lane);
  workgroupBarrier();
  if lane < 3u { choose_exponent(lane); }
  workgroupBarrier();
  if lane < 3u { choose_factor(lane); }
  workgroupBarrier();
  for (var attempt = 0u; attempt < 2u; attempt++) {
    let knots = attempt == 1u;
    if knots && lane < 3u { factors[lane] = 1.0; }
    place(lane, knots);
    workgroupBarrier();
    sort(lane);
    count_distances(lane);
    workgroupBarrier();
    if lane < 3u { measure_range(lane, knots); }
    sum_distances(lane);
    workgroupBarrier();
    count_neighbours(lane);
    workgroupBarrier();
    if lane < candidates { costs[lane] = cost_of(lane); }
    workgroupBarrier();
    if lane == 0u {
      choose();
      let cost = costs[best];
      try_knots = select(0u, 1u, !knots && cost > knot_cost_threshold);
      // Knots pay if they halve the cost.
      if knots && cost > 0.5 * first_cost { best = 0xffffffffu; }
      first_cost = cost;
    }
    workgroupBarrier();
    // This thread still has the layout of its candidate.
    if lane == best { write_grid(knots); }
    if workgroupUniformLoad(&try_knots) == 0u { break; }
    place_knots(lane);
    storageBarrier();
    workgroupBarrier();
  }
}
