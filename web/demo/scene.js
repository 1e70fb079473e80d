// The boxes that move: the same on the GPU (move_boxes.wgsl) and here.

/** Numbers in [0, 1), the same in every run. */
export function random(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}

/** Eight numbers per box: its centre at time 0 and half its side; its velocity, and nothing. */
export function randomScene(count) {
  const next = random(2012);
  const side = 1.6 * Math.cbrt(count); // then a box touches 2 others, about
  const bodies = new Float32Array(8 * count);
  for (let i = 0; i < bodies.length; i += 8) {
    for (let k = 0; k < 3; ++k) {
      bodies[i + k] = side * next();
      bodies[i + 4 + k] = 2 * next() - 1;
    }
    bodies[i + 3] = 0.25 + 0.5 * next();
  }
  return { count, side, bodies, low: [0, 0, 0], extent: [side, side, side] };
}

/** Boxes of a file, which stay where they are. `inactive` of them overlap nothing: lower > upper, or a NaN. */
export function fixedScene(boxes) {
  let inactive = 0;
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < boxes.length; i += 6) {
    const [from, to] = [boxes.subarray(i, i + 3), boxes.subarray(i + 3, i + 6)];
    if (!from.every((x, k) => x <= to[k])) ++inactive;
    if (!from.every((x, k) => x <= to[k] && Number.isFinite(x) && Number.isFinite(to[k]))) continue;
    for (let k = 0; k < 3; ++k) {
      low[k] = Math.min(low[k], from[k]);
      high[k] = Math.max(high[k], to[k]);
    }
  }
  const extent = low.map((from, k) => (high[k] > from ? high[k] - from : 1));
  return { count: boxes.length / 6, inactive, boxes, low: low.map((from) => (Number.isFinite(from) ? from : 0)), extent };
}

/** Writes the boxes of a time: lower x, y, z, upper x, y, z. */
export function moveBoxes(scene, time, boxes) {
  if (scene.boxes) {
    boxes.set(scene.boxes);
    return;
  }
  const { bodies, side, count } = scene;
  for (let i = 0; i < count; ++i) {
    const half = bodies[8 * i + 3];
    for (let k = 0; k < 3; ++k) {
      const path = bodies[8 * i + k] + bodies[8 * i + 4 + k] * time;
      const along = path - 2 * side * Math.floor(path / (2 * side));
      const centre = side - Math.abs(along - side);
      boxes[6 * i + k] = centre - half;
      boxes[6 * i + 3 + k] = centre + half;
    }
  }
}

/** The paper's cells for these boxes: about `perCell` boxes per cell, a whole number of cells along each axis. */
export function paperCells(scene, perCell) {
  const volume = scene.extent[0] * scene.extent[1] * scene.extent[2];
  const side = Math.cbrt((volume * perCell) / scene.count);
  const scale = 1 / side;
  const cells = scene.extent.map((length) => Math.min(1023, Math.max(1, Math.floor(length * scale))));
  return { origin: scene.low, scale, cells };
}
