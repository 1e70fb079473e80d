// Boxes as they are stored and compared.

// The keys of the corners. 32 bytes.
struct Record {
  lower: vec4<u32>,  // with the index of the box
  upper: vec4<u32>,  // with the row of its cell (size_class_grid.wgsl)
}

// Closed boxes: touching counts.
fn overlaps(a: Record, b: Record) -> bool {
  return all(a.lower.xyz <= b.upper.xyz) && all(b.lower.xyz <= a.upper.xyz);
}

// Overlaps nothing: the lower end is above every key, and the upper end below.
fn no_record(index: u32) -> Record {
  return Record(vec4(0xffffffffu, 0xffffffffu, 0xffffffffu, index), vec4(0u));
}
