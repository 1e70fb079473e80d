// Searches: forms of boxes, memory filled in place, filters, and how long results live.
import test from 'node:test';
import assert from 'node:assert/strict';
import { ThrongError, load } from '../web/index.js';
import { allows, doubleLoop, random, randomBoxes, sorted } from './support.mjs';

const throng = await load();
const boxes = randomBoxes(random(1), 500, 10);
const wanted = doubleLoop(boxes);

test('the double loop finds enough', () => assert.ok(wanted.length > 200));

test('findPairs returns an array of its own', () => {
  const pairs = throng.findPairs(boxes, { order: 'canonical' });
  assert.deepEqual(Array.from(pairs), wanted);
  assert.equal(pairs.byteLength, pairs.buffer.byteLength);
  const before = Array.from(pairs);
  throng.findPairs(randomBoxes(random(2), 100000, 60));
  assert.deepEqual(Array.from(pairs), before);
});

test('no boxes, one box, no pairs', () => {
  assert.equal(throng.findPairs(new Float32Array(0)).length, 0);
  assert.equal(throng.findPairs(new Float32Array(6)).length, 0);
  assert.equal(throng.findPairs(Float32Array.of(0, 0, 0, 1, 1, 1, 2, 0, 0, 3, 1, 1)).length, 0);
});

test('touching boxes overlap; zeros of both signs are equal', () => {
  const touching = Float32Array.of(-1, 0, 0, -0, 1, 1, 0, 1, 1, 1, 2, 2);
  assert.deepEqual(Array.from(throng.findPairs(touching)), [0, 1]);
});

test('boxes are found in place, in memory of allocateBoxes', () => {
  const memory = throng.allocateBoxes(500);
  assert.equal(memory.values.length, 3000);
  assert.ok(memory.values.every((value) => value === 0));
  memory.values.set(boxes);
  const finder = new throng.Finder({ order: 'canonical' });
  const kept = throng.memoryBytes;
  for (let frame = 0; frame < 3; ++frame) assert.deepEqual(Array.from(finder.find(memory)), wanted);
  assert.deepEqual(Array.from(finder.find(memory.values)), wanted, 'its values, too, are read in place');
  assert.deepEqual(Array.from(finder.find(memory.values.subarray(0, 600))), doubleLoop(boxes.subarray(0, 600)));
  assert.ok(throng.memoryBytes - kept < 4 << 20);
  memory.free();
  memory.free();
  assert.throws(() => finder.find(memory), { name: 'ThrongError', code: 'released' });
  finder.free();
});

test('values that memory growth detached are refused, and given again', () => {
  const memory = throng.allocateBoxes(2);
  const { values } = memory;
  values.set([0, 0, 0, 1, 1, 1, 0.5, 0.5, 0.5, 2, 2, 2]);
  while (values.length !== 0) throng.allocateBoxes(1 << 20);
  assert.throws(() => throng.findPairs(values), { name: 'TypeError', message: /detached/ });
  assert.deepEqual(Array.from(throng.findPairs(memory.values)), [0, 1]);
  memory.free();
});

test('two sets, with filters of each', () => {
  const next = random(5);
  const left = randomBoxes(next, 200, 6);
  const right = randomBoxes(next, 300, 6);
  const filtersOf = (count) => ({
    group: Uint32Array.from({ length: count }, () => 1 << Math.floor(next() * 3)),
    mask: Uint32Array.from({ length: count }, () => Math.floor(next() * 8)),
    owner: Int32Array.from({ length: count }, () => Math.floor(next() * 5) - 1),
    world: Int32Array.from({ length: count }, () => Math.floor(next() * 3) - 1),
    static: Uint8Array.from({ length: count }, () => Math.floor(next() * 2)),
  });
  const [a, b] = [filtersOf(200), filtersOf(300)];
  const of = (filters, i) => Object.fromEntries(Object.entries(filters).map(([name, values]) => [name, values[i]]));
  const expected = [];
  for (let i = 0; i < 200; ++i) {
    for (let j = 0; j < 300; ++j) {
      const both = doubleLoop(Float32Array.of(...left.subarray(6 * i, 6 * i + 6), ...right.subarray(6 * j, 6 * j + 6)));
      if (both.length > 0 && allows(of(a, i), of(b, j))) expected.push(i, j);
    }
  }
  assert.ok(expected.length > 20);
  const options = { other: right, ...a };
  for (const [name, values] of Object.entries(b)) options[`other${name[0].toUpperCase()}${name.slice(1)}`] = values;
  assert.deepEqual(sorted(throng.findPairs(left, options)), expected);
});

test('a filter is one number for all boxes, or one each', () => {
  assert.equal(throng.findPairs(boxes, { static: true }).length, 0);
  assert.equal(throng.findPairs(boxes, { owner: 3 }).length, 0);
  assert.equal(throng.findPairs(boxes, { group: 1, mask: 2 }).length, 0);
  assert.equal(throng.findPairs(boxes, { world: 2, owner: -1 }).length, wanted.length);
});

test('2-D boxes', () => {
  const flat = Float32Array.of(0, 0, 2, 2, 1, 1, 3, 3, 2, 2, 4, 4);
  assert.deepEqual(sorted(throng.findPairs(flat, { dimensions: 2 })), [0, 1, 0, 2, 1, 2]);
  const corners = { lower: Float32Array.of(0, 0, 1, 1), upper: Float32Array.of(2, 2, 3, 3) };
  assert.deepEqual(Array.from(throng.findPairs(corners, { dimensions: 2 })), [0, 1]);
});

test('a margin is rounded outward', () => {
  const apart = Float32Array.of(0, 0, 0, 1, 1, 1, 1.5, 0, 0, 2, 1, 1);
  assert.equal(throng.findPairs(apart, { margin: 0.24 }).length, 0);
  assert.equal(throng.findPairs(apart, { margin: 0.25 }).length, 2);
  // Not a float32: rounded up.
  const near = Float32Array.of(0, 0, 0, 1, 1, 1, 1.2, 0, 0, 2, 1, 1);
  assert.equal(throng.findPairs(near, { margin: 0.1 }).length, 2);
});

test('inverted boxes: refused by findPairs, empty slots of a Finder', () => {
  const inverted = Float32Array.of(0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 1, 1);
  assert.throws(() => throng.findPairs(inverted), { code: 'inverted_box', firstInvalid: 1, invalidCount: 1 });
  assert.equal(throng.findPairs(inverted, { inverted: 'inactive' }).length, 0);
  const finder = new throng.Finder();
  finder.find(inverted);
  assert.equal(finder.result.inactive, 1);
  finder.free();
});

test('boxes with a NaN: refused, or inactive', () => {
  const some = Float32Array.from(boxes);
  some[6 * 17 + 4] = NaN;
  some[6 * 30] = NaN;
  assert.throws(() => throng.findPairs(some), { code: 'nan_box', firstInvalid: 17, invalidCount: 2 });
  const without = wanted.filter((_, k) => ![17, 30].includes(wanted[k]) && ![17, 30].includes(wanted[k ^ 1]));
  assert.deepEqual(Array.from(throng.findPairs(some, { nan: 'inactive', order: 'canonical' })), without);
});

test('many pairs: the memory for them grows, and none is lost', () => {
  const same = new Float32Array(6 * 3000).fill(1);
  const finder = new throng.Finder({ order: 'canonical' });
  const pairs = finder.find(same);
  assert.equal(pairs.length / 2, (3000 * 2999) / 2);
  assert.deepEqual(Array.from(pairs.subarray(pairs.length - 4)), [2997, 2999, 2998, 2999]);
  assert.equal(finder.result.found, (3000 * 2999) / 2);
  finder.free();
});

test('result tells how the pairs were found', () => {
  const finder = new throng.Finder({ algorithm: 'grid' });
  finder.find(boxes);
  const { result } = finder;
  assert.equal(result.found, wanted.length / 2);
  assert.equal(result.written, result.found);
  assert.equal(result.algorithm, 'grid');
  assert.equal(result.isa, 'wasm');
  assert.ok(result.comparisons > 0 && result.totalMs >= 0 && result.plan.length > 0);
  assert.ok(finder.memoryBytes > 0);
  finder.free();
});

test('memory does not grow from frame to frame', () => {
  const finder = new throng.Finder();
  const next = random(3);
  const frames = Array.from({ length: 3 }, () => randomBoxes(next, 5000, 30));
  for (const frame of frames) finder.find(frame);
  const before = throng.memoryBytes;
  for (let i = 0; i < 60; ++i) finder.find(frames[i % 3]);
  for (let i = 0; i < 60; ++i) throng.findPairs(frames[i % 3]);
  assert.ok(throng.memoryBytes - before <= 2 << 20);
  finder.free();
});

test('a freed object says so; freeing twice is allowed', () => {
  for (const made of [new throng.Finder(), new throng.BroadPhase()]) {
    made.free();
    made.free();
    assert.throws(() => made.result, { name: 'ThrongError', code: 'released', message: /was freed/ });
  }
  if (Symbol.dispose) assert.equal(throng.Finder.prototype[Symbol.dispose], throng.Finder.prototype.free);
});

test('objects of several instances are independent', async () => {
  const other = await load();
  const a = new throng.Finder({ order: 'canonical' });
  const b = new other.Finder({ order: 'canonical' });
  const first = a.find(boxes);
  const second = b.find(boxes);
  assert.notEqual(first.buffer, second.buffer);
  assert.deepEqual(Array.from(first), Array.from(second));
  const memory = other.allocateBoxes(1);
  assert.throws(() => a.find(memory), { name: 'TypeError', message: /another load/ });
  a.free();
  b.free();
});

test('errors are of the exported class', () => {
  assert.throws(() => throng.findPairs(Float32Array.of(NaN, 0, 0, 0, 0, 0)), ThrongError);
  assert.ok(new ThrongError('x', 'y') instanceof Error);
});

test('the version is that of the library', () => assert.match(throng.version, /^\d+\.\d+\.\d+$/));
