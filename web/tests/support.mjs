// Shared by the tests: files, checksums, random boxes, and the double loop.
export { random } from '../web/demo/scene.js';

export async function readBytes(name) {
  const url = new URL(name, import.meta.url);
  if (url.protocol !== 'file:') {
    const response = await fetch(url);
    if (!response.ok) throw new Error(`${url}: HTTP ${response.status}`);
    return response.arrayBuffer();
  }
  const files = await import('node:fs/promises');
  const bytes = await files.readFile(url);
  return bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
}

const types = {
  owner: Int32Array,
  world: Int32Array,
  static: Uint8Array,
  boxes: Float32Array,
  by: Float32Array,
  origins: Float32Array,
  directions: Float32Array,
  times: Float64Array,
  firstTimes: Float64Array,
  rayDistances: Float64Array,
};

/** The cases of throng-web-cases; each list of two numbers is replaced by the array that it names. */
export async function readCases() {
  const bytes = await readBytes('cases.bin');
  const text = new TextDecoder().decode(await readBytes('cases.json'));
  return JSON.parse(text, (name, value) => {
    const isPlace = Array.isArray(value) && value.length === 2 && value.every(Number.isInteger);
    return isPlace ? new (types[name] ?? Uint32Array)(bytes, value[0], value[1]) : value;
  });
}

const mask64 = (1n << 64n) - 1n;
function mix64(x) {
  x = (x + 0x9e3779b97f4a7c15n) & mask64;
  x = ((x ^ (x >> 30n)) * 0xbf58476d1ce4e5b9n) & mask64;
  x = ((x ^ (x >> 27n)) * 0x94d049bb133111ebn) & mask64;
  return x ^ (x >> 31n);
}
const hexadecimal = (x) => x.toString(16).padStart(16, '0');
const keys = (pairs) => new BigUint64Array(Uint32Array.from(pairs, (_, i) => pairs[i ^ 1]).buffer);

/** pair_checksum() of the library: the order of the pairs does not matter. */
export function pairChecksum(pairs) {
  let sum = 0n;
  for (const key of keys(pairs)) sum = (sum + mix64(key)) & mask64;
  return hexadecimal(sum);
}
/** sequence_checksum() of the scenes: the order matters. */
export function sequenceChecksum(pairs) {
  let state = BigInt(pairs.length / 2);
  for (const key of keys(pairs)) state = mix64(state ^ key);
  return hexadecimal(state);
}

/** Boxes whose lower corners are in a cube of this side; `next` is that of random(). */
export function randomBoxes(next, count, side, size = 1) {
  const boxes = new Float32Array(6 * count);
  for (let i = 0; i < count; ++i) {
    for (let axis = 0; axis < 3; ++axis) {
      boxes[6 * i + axis] = next() * side;
      boxes[6 * i + 3 + axis] = boxes[6 * i + axis] + next() * size;
    }
  }
  return boxes;
}

/** Whether boxes a of one array and b of another overlap. */
export function overlap(first, a, second, b) {
  for (let axis = 0; axis < 3; ++axis) {
    const [lowerA, upperA] = [first[6 * a + axis], first[6 * a + 3 + axis]];
    const [lowerB, upperB] = [second[6 * b + axis], second[6 * b + 3 + axis]];
    if (!(lowerA <= upperA && lowerB <= upperB && lowerA <= upperB && lowerB <= upperA)) return false;
  }
  return true;
}

/** Whether the filters allow a pair; `of` gives the values of a box: {group, mask, owner, world, static}. */
export function allows(a, b) {
  if (((a.group & b.mask) === 0) || ((b.group & a.mask) === 0)) return false;
  if (a.owner !== -1 && a.owner === b.owner) return false;
  if (a.world !== -1 && b.world !== -1 && a.world !== b.world) return false;
  return !(a.static && b.static);
}

/** All pairs of one set, sorted, as [first, second, first, second, ...]. */
export function doubleLoop(boxes, isAllowed = () => true) {
  const pairs = [];
  for (let i = 0; i < boxes.length / 6; ++i) {
    for (let j = i + 1; j < boxes.length / 6; ++j) {
      if (overlap(boxes, i, boxes, j) && isAllowed(i, j)) pairs.push(i, j);
    }
  }
  return pairs;
}

/** Pairs, sorted by first, then second. */
export function sorted(pairs) {
  const list = Array.from({ length: pairs.length / 2 }, (_, i) => [pairs[2 * i], pairs[2 * i + 1]]);
  return list.sort((a, b) => a[0] - b[0] || a[1] - b[1]).flat();
}
