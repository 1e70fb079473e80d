// Floats as integers. WGSL allows a device to flush denormals, to fuse operations and to assume
// that no NaN or infinity occurs, so no float is ever compared: boxes are read as bits.
//
// The key of x. For floats x and y that are no NaN, key(x) <= key(y) exactly if x <= y:
// - Both have sign 0: their magnitudes are the bits, and IEEE 754 orders floats of one sign, infinity
//   and denormals included, as their bits. Setting bit 31 keeps that order.
// - Both have sign 1: the greater magnitude is the lesser number, and ~bits reverses the order.
// - One has sign 1 and is not zero: its ~bits has bit 31 clear, and the other's key has it set.
// - The bits of -0 count as those of +0, so both have one key.
fn ordered_key(bits: u32) -> u32 {
  if (bits << 1u) == 0u { return 0x80000000u; }
  return select(bits | 0x80000000u, ~bits, bits >> 31u != 0u);
}

// Of the bits of a float.
fn is_nan(bits: u32) -> bool { return (bits & 0x7fffffffu) > 0x7f800000u; }

// The bits of a float with this key; of both zeros those of +0.
fn bits_of_key(key: u32) -> u32 { return select(~key, key ^ 0x80000000u, key >> 31u != 0u); }
