// The pairs of one set of boxes.
// snippet-begin: whole
import { load } from 'throng-collision';

const throng = await load();
const boxes = new Float32Array([
  0, 0, 0, 2, 2, 2, // lower x, y, z, upper x, y, z
  1, 1, 1, 3, 3, 3, // overlaps box 0
  3, 1, 1, 4, 2, 2, // touches box 1: that counts
  9, 9, 9, 9, 9, 9, // a point, far away
]);
const pairs = throng.findPairs(boxes, { order: 'canonical' });
for (let i = 0; i < pairs.length; i += 2) console.log(`${pairs[i]} touches ${pairs[i + 1]}`);
// snippet-end: whole

export { pairs };
