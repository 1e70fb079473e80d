// Offsets in the structs of throng.h on wasm32, in bytes. web/src/module.cpp asserts them.

export const boxes = {
  bytes: 72,
  count: 0,
  corner: 4,
  stride: 28,
  group: 32,
  mask: 40,
  owner: 48,
  world: 56,
  static: 64,
};

export const options = {
  bytes: 68,
  algorithm: 4,
  order: 8,
  nan: 16,
  margin: 20,
  isa: 56,
  inverted: 64,
};

export const result = {
  found: 8,
  written: 16,
  inactive: 24,
  comparisons: 32,
  firstInvalid: 40,
  invalidCount: 48,
  bytesNeeded: 56,
  totalMs: 64,
  plan: 104,
  message: 108,
  algorithm: 116,
  isa: 120,
};

export const pair = { bytes: 8 };
export const livePair = { bytes: 12 };
export const sweep = { bytes: 36, words: 9 };
export const sweepHit = { bytes: 16, words: 4 };
export const rayHit = { bytes: 40, distance: 8, point: 16, normal: 28 };
export const filter = { bytes: 20, mask: 4, owner: 8, world: 12, static: 16 };
export const box = { bytes: 24 };
