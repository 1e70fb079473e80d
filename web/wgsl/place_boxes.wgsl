// Stores each box at its cell's start plus its rank.

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> boxes: array<u32>;
@group(0) @binding(2) var<storage, read> grid: SizeClassGrid;
@group(0) @binding(3) var<storage, read> table: array<u32>;  // first record of each cell
@group(0) @binding(4) var<storage, read> places: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read_write> records: array<Record>;

@compute @workgroup_size(256)
fn place_boxes(@builtin(workgroup_id) workgroup: vec3<u32>,
               @builtin(num_workgroups) workgroups: vec3<u32>,
               @builtin(local_invocation_index) lane: u32) {
  let index = workgroup_index(workgroup, workgroups) * 256u + lane;
  if index >= parameters.box_count { return; }
  let place = places[index];
  if place.x == 0xffffffffu { return; }
  var record = read_box(index).record;
  if grid.hashed != 0u {
    let span = cells_of(record);
    let size_class = class_of(span);
    let at = span.lower >> grid.classes[size_class].shift.xyz;
    record.upper.w = row_mark(size_class, at.y, at.z);
  }
  records[table[place.x] + place.y] = record;
}
