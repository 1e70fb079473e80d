// Counts the boxes per cell.

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> boxes: array<u32>;
@group(0) @binding(2) var<storage, read> grid: SizeClassGrid;
@group(0) @binding(3) var<storage, read_write> table: array<atomic<u32>>;  // cleared
// Per box its cell and its rank among the boxes of that cell.
@group(0) @binding(4) var<storage, read_write> places: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read_write> report: Report;

@compute @workgroup_size(256)
fn count_boxes(@builtin(workgroup_id) workgroup: vec3<u32>,
               @builtin(num_workgroups) workgroups: vec3<u32>,
               @builtin(local_invocation_index) lane: u32) {
  let index = workgroup_index(workgroup, workgroups) * 256u + lane;
  if index >= parameters.box_count { return; }
  let box = read_box(index);
  if !box.is_active {
    places[index] = vec2(0xffffffffu, 0u);
    report_inactive(index, box.has_nan);
    return;
  }
  let span = cells_of(box.record);
  let size_class = class_of(span);
  let at = span.lower >> grid.classes[size_class].shift.xyz;
  let cell = row_start(size_class, at.y, at.z) + at.x;
  places[index] = vec2(cell, atomicAdd(&table[cell], 1u));
  // Nearly always set: a load costs less than an addition that all boxes contend for.
  if ((atomicLoad(&report.occupied) >> size_class) & 1u) == 0u {
    atomicOr(&report.occupied, 1u << size_class);
  }
}
