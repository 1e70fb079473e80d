// A box of the caller. Requires ordered_keys.wgsl, records.wgsl, and in the step's file:
// parameters, boxes.

struct BoxRead {
  record: Record,
  is_active: bool,  // no NaN, and lower <= upper on each axis
  has_nan: bool,
}

fn read_box(index: u32) -> BoxRead {
  let at = index * parameters.box_words;
  var out: BoxRead;
  out.has_nan = false;
  out.is_active = true;
  for (var k = 0u; k < 3u; k++) {
    let lower = boxes[at + k];
    let upper = boxes[at + parameters.upper_words + k];
    out.has_nan = out.has_nan || is_nan(lower) || is_nan(upper);
    out.record.lower[k] = ordered_key(lower);
    out.record.upper[k] = ordered_key(upper);
    out.is_active = out.is_active && out.record.lower[k] <= out.record.upper[k];
  }
  out.record.lower.w = index;
  out.record.upper.w = 0u;
  out.is_active = out.is_active && !out.has_nan;
  return out;
}
