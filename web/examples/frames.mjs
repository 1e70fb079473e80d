// Each frame: boxes written in place, and objects with events.
import { load } from 'throng-collision';

const throng = await load();

/** The numbers of pairs of some frames. */
export function pairsPerFrame(frames) {
  const found = [];
  // snippet-begin: in-place
  const finder = new throng.Finder();
  const memory = throng.allocateBoxes(1000);

  function frame(time) {
    const { values } = memory; // again in each frame: see below
    for (let i = 0; i < 1000; ++i) {
      const x = Math.sin(i + time) * 50;
      values.set([x, i % 10, 0, x + 1, (i % 10) + 1, 1], 6 * i);
    }
    const pairs = finder.find(memory); // nothing is copied, neither in nor out
    return pairs.length / 2;
  }
  // snippet-end: in-place
  for (let time = 0; time < frames; ++time) found.push(frame(time));
  finder.free();
  memory.free();
  return found;
}

/** What happened to two objects, as text. */
export function events() {
  const log = [];
  const began = (a, b) => log.push(`${a} and ${b} began`);
  const ended = (a, b) => log.push(`${a} and ${b} ended`);
  // snippet-begin: events
  const objects = new throng.BroadPhase();
  const [car, wall] = objects.add(
    Float32Array.of(0, 0, 0, 2, 1, 1, /* the wall: */ 4, 0, 0, 5, 9, 9),
    { group: Uint32Array.of(1, 2), mask: Uint32Array.of(2, 1) }, // cars meet walls only
  );
  for (const x of [1, 2, 3, 6]) {
    objects.move(car, Float32Array.of(x, 0, 0, x + 2, 1, 1));
    objects.update();
    const pairs = objects.begun; // ids and a slot: three numbers per pair
    for (let i = 0; i < pairs.length; i += 3) began(pairs[i], pairs[i + 1]);
    const over = objects.ended;
    for (let i = 0; i < over.length; i += 3) ended(over[i], over[i + 1]);
  }
  // snippet-end: events
  // snippet-begin: queries
  const hit = objects.raycast([0, 0.5, 0.5], [1, 0, 0], { layerMask: 2 }); // walls only
  if (hit) console.log(`object ${hit.object}, ${hit.distance} away`);
  const near = objects.findOverlaps(Float32Array.of(3, 0, 0, 7, 1, 1)); // [0, id, 0, id, ...]
  const { pairs, times } = objects.findHits(
    Float32Array.of(0, 0, 0, 1, 1, 1), // a box
    Float32Array.of(10, 0, 0), // that moves by this
  );
  // snippet-end: queries
  log.push(hit.object === wall && hit.distance === 4, near.length / 2, pairs.length / 2, times[0]);
  objects.free();
  return log;
}

/** How an error is told apart. */
export function errors(boxes) {
  // snippet-begin: errors
  try {
    return throng.findPairs(boxes);
  } catch (error) {
    if (error.code === 'nan_box') return `box ${error.firstInvalid} has a NaN`;
    throw error; // its message names the argument, the value and the remedy
  }
  // snippet-end: errors
}
