// For brute force: stores each box at its own index.

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> boxes: array<u32>;
@group(0) @binding(2) var<storage, read_write> records: array<Record>;
@group(0) @binding(3) var<storage, read_write> report: Report;

@compute @workgroup_size(256)
fn load_boxes(@builtin(workgroup_id) workgroup: vec3<u32>,
              @builtin(num_workgroups) workgroups: vec3<u32>,
              @builtin(local_invocation_index) lane: u32) {
  let index = workgroup_index(workgroup, workgroups) * 256u + lane;
  if index >= parameters.box_count { return; }
  let box = read_box(index);
  if box.is_active {
    records[index] = box.record;
  } else {
    records[index] = no_record(index);
    report_inactive(index, box.has_nan);
  }
}
