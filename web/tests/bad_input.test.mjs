// Wrong arguments: each error names the argument, what was found, and what to give. After it the instance still works.
import test from 'node:test';
import assert from 'node:assert/strict';
import { load } from '../web/index.js';

const throng = await load();
const one = Float32Array.of(0, 0, 0, 1, 1, 1);
const two = Float32Array.of(0, 0, 0, 1, 1, 1, 0.5, 0.5, 0.5, 2, 2, 2);

function works() {
  assert.deepEqual(Array.from(throng.findPairs(two)), [0, 1]);
}
// [the call, the error's name, words of its message]
function refused(call, name, ...words) {
  let error;
  try {
    call();
  } catch (caught) {
    error = caught;
  }
  assert.ok(error, `${call}: no error`);
  assert.equal(error.name, name, `${call}: ${error.message}`);
  for (const word of words) assert.ok(error.message.includes(word), `${call}: '${error.message}' lacks '${word}'`);
  works();
}
function detached() {
  const array = new Float32Array(6);
  structuredClone(array, { transfer: [array.buffer] });
  return array;
}

test('boxes', () => {
  const find = (value, options) => () => throng.findPairs(value, options);
  refused(find(), 'TypeError', 'boxes', 'undefined', 'Float32Array');
  refused(find(null), 'TypeError', 'boxes', 'null');
  refused(find('six'), 'TypeError', 'boxes', "'six'");
  refused(find(7), 'TypeError', 'boxes', '7');
  refused(find([0, 0, 0, 1, 1, 1]), 'TypeError', 'boxes', 'an Array', 'new Float32Array');
  refused(find(new Float64Array(6)), 'TypeError', 'boxes', 'Float64Array', 'rounds');
  refused(find(new Uint32Array(6)), 'TypeError', 'boxes', 'Uint32Array');
  refused(find(new DataView(new ArrayBuffer(24))), 'TypeError', 'boxes', 'DataView');
  refused(find(new ArrayBuffer(24)), 'TypeError', 'boxes', 'ArrayBuffer');
  refused(find(new Float32Array(7)), 'RangeError', 'boxes', '7', 'multiple of 6');
  refused(find(new Float32Array(6), { dimensions: 2 }), 'RangeError', 'boxes', '6', 'multiple of 4');
  refused(find({ lower: new Float32Array(3) }), 'TypeError', 'boxes.upper', 'undefined');
  refused(find({ lower: new Float32Array(3), upper: new Float32Array(6) }), 'RangeError', 'boxes', '3', '6');
  refused(find({ lower: new Float32Array(4), upper: new Float32Array(4) }), 'RangeError', 'boxes.lower', 'multiple of 3');
  refused(find({ lower: [0, 0, 0], upper: new Float32Array(3) }), 'TypeError', 'boxes.lower');
  refused(find(detached()), 'TypeError', 'boxes', 'detached');
  refused(find(Float32Array.of(0, NaN, 0, 1, 1, 1)), 'ThrongError', '1 box', 'box 0', "nan: 'inactive'");
  refused(find(Float32Array.of(5, 0, 0, 1, 1, 1)), 'ThrongError', 'lower > upper', "inverted: 'inactive'");
});

test('the second set', () => {
  refused(() => throng.findPairs(one, { other: new Float32Array(5) }), 'RangeError', 'other', '5');
  refused(() => throng.findPairs(one, { other: 'x' }), 'TypeError', 'other', "'x'");
  refused(() => throng.findPairs(one, { otherGroup: 1 }), 'TypeError', 'otherGroup', 'other');
  refused(() => throng.findPairs(one, { other: Float32Array.of(NaN, 0, 0, 1, 1, 1) }), 'ThrongError', 'second set');
});

test('filters', () => {
  const find = (options) => () => throng.findPairs(two, options);
  refused(find({ group: new Int32Array(2) }), 'TypeError', 'group', 'Int32Array', 'Uint32Array');
  refused(find({ group: [1, 2] }), 'TypeError', 'group', 'Array');
  refused(find({ group: new Uint32Array(3) }), 'RangeError', 'group', '3', '2');
  refused(find({ mask: -1 }), 'RangeError', 'mask', '-1');
  refused(find({ mask: 2 ** 32 }), 'RangeError', 'mask', '4294967296');
  refused(find({ owner: 1.5 }), 'RangeError', 'owner', '1.5');
  refused(find({ owner: 'me' }), 'TypeError', 'owner', "'me'");
  refused(find({ world: -2 }), 'RangeError', 'world', '-2');
  refused(find({ world: Int32Array.of(0, -5) }), 'ThrongError', 'world', '-5', 'box 1');
  refused(find({ static: new Float32Array(2) }), 'TypeError', 'static', 'Float32Array');
  refused(find({ static: 256 }), 'RangeError', 'static', '256');
  refused(find({ other: two, otherWorld: new Int32Array(1) }), 'RangeError', 'otherWorld', '1', '2');
});

test('options', () => {
  const find = (options) => () => throng.findPairs(two, options);
  refused(find({ margni: 1 }), 'TypeError', "'margni'", 'margin');
  refused(find('fast'), 'TypeError', 'options', "'fast'");
  refused(find([]), 'TypeError', 'options');
  refused(find(two), 'TypeError', 'options', 'Float32Array');
  refused(find({ margin: -1 }), 'RangeError', 'margin', '-1');
  refused(find({ margin: NaN }), 'RangeError', 'margin', 'NaN');
  refused(find({ margin: Infinity }), 'RangeError', 'margin', 'Infinity');
  refused(find({ margin: '1' }), 'TypeError', 'margin', "'1'");
  refused(find({ order: 'sorted' }), 'RangeError', 'order', "'sorted'", "'canonical'");
  refused(find({ algorithm: 3 }), 'TypeError', 'algorithm', '3', "'grid'");
  refused(find({ nan: 'ignore' }), 'RangeError', 'nan', "'ignore'");
  refused(find({ inverted: true }), 'TypeError', 'inverted', 'true');
  refused(find({ isa: 'avx2' }), 'RangeError', 'isa', "'avx2'", "'wasm'");
  refused(find({ dimensions: 4 }), 'RangeError', 'dimensions', '4');
  refused(() => new throng.Finder({ group: 1 }), 'TypeError', "'group'");
  refused(() => new throng.Finder().find(two, { margin: 1 }), 'TypeError', "'margin'");
  refused(() => new throng.BroadPhase({ order: 'any' }), 'TypeError', "'order'");
  refused(() => throng.allocateBoxes(-1), 'RangeError', 'count', '-1');
  refused(() => throng.allocateBoxes(1.5), 'RangeError', 'count', '1.5');
  refused(() => throng.allocateBoxes('2'), 'TypeError', 'count', "'2'");
});

test('ids', () => {
  const objects = new throng.BroadPhase();
  objects.add(two);
  refused(() => objects.remove(2), 'ThrongError', 'id 2', 'not alive');
  refused(() => objects.remove([1, 1]), 'ThrongError', 'id 1', 'twice');
  refused(() => objects.remove(-1), 'RangeError', 'ids', '-1');
  refused(() => objects.remove([0, 0.5]), 'RangeError', 'ids[1]', '0.5');
  refused(() => objects.remove('0'), 'TypeError', 'ids', "'0'");
  refused(() => objects.remove(new Int32Array(1)), 'TypeError', 'ids', 'Int32Array');
  refused(() => objects.move([0, 1], one), 'RangeError', 'boxes', '1', '2');
  refused(() => objects.move(0, Float32Array.of(NaN, 0, 0, 1, 1, 1)), 'ThrongError', 'NaN', 'id 0');
  refused(() => objects.moveAll(one), 'ThrongError', '1 boxes', 'idLimit');
  refused(() => objects.setFilters([0, 1], { group: new Uint32Array(1) }), 'RangeError', 'group', '1', '2');
  refused(() => objects.setFilters(9, { group: 1 }), 'ThrongError', 'id 9');
  refused(() => objects.box(2), 'ThrongError', 'id 2');
  refused(() => objects.filter(2), 'ThrongError', 'id 2');
  refused(() => objects.box(), 'TypeError', 'id', 'undefined');
  refused(() => objects.isAlive(-1), 'RangeError', '-1');
  refused(() => objects.pairsOf('x'), 'TypeError', "'x'");
  // All or nothing.
  assert.equal(objects.objectCount, 2);
  objects.update();
  assert.deepEqual(Array.from(objects.begun.subarray(0, 2)), [0, 1]);
  objects.free();
});

test('queries', () => {
  const objects = new throng.BroadPhase();
  objects.add(two);
  refused(() => objects.findOverlaps(new Float32Array(5)), 'RangeError', 'boxes', '5');
  refused(() => objects.findOverlaps(one, { which: 'all' }), 'TypeError', "'which'");
  refused(() => objects.findHits(one), 'TypeError', 'by', 'undefined');
  refused(() => objects.findHits(one, new Float32Array(6)), 'RangeError', 'by', '6', '3');
  refused(() => objects.findHits(one, Float32Array.of(0, Infinity, 0)), 'ThrongError', 'sweep 0');
  refused(() => objects.findHits(one, new Float32Array(3), { which: 'last' }), 'RangeError', 'which', "'last'");
  refused(() => objects.raycast([0, 0], [1, 0, 0]), 'RangeError', 'origin', '2', '3');
  refused(() => objects.raycast([0, 0, 0], 1), 'TypeError', 'direction', '1');
  refused(() => objects.raycast([0, 0, 'x'], [1, 0, 0]), 'TypeError', 'origin[2]', "'x'");
  refused(() => objects.raycast([0, 0, NaN], [1, 0, 0]), 'ThrongError', 'origin', 'finite');
  refused(() => objects.raycast([0, 0, 0], [0, 0, 0]), 'ThrongError', 'direction', 'findOverlaps');
  refused(() => objects.raycast([0, 0, 0], [Infinity, 0, 0]), 'ThrongError', 'direction', 'maxDistance');
  refused(() => objects.raycast([0, 0, 0], [1, 0, 0], { maxDistance: -1 }), 'ThrongError', 'maxDistance', '-1');
  refused(() => objects.raycast([0, 0, 0], [1, 0, 0], { maxDistance: NaN }), 'ThrongError', 'maxDistance');
  refused(() => objects.raycast([0, 0, 0], [1, 0, 0], { layerMask: -1 }), 'RangeError', 'layerMask', '-1');
  refused(() => objects.raycast([0, 0, 0], [1, 0, 0], { world: -2 }), 'RangeError', 'world', '-2');
  refused(() => objects.shiftOrigin([1, 2]), 'RangeError', 'by', '2', '3');
  refused(() => objects.shiftOrigin([Infinity, 0, 0]), 'ThrongError', 'finite');
  objects.free();
  refused(() => objects.update(), 'ThrongError', 'freed');
  refused(() => objects.begun, 'ThrongError', 'freed');
});

test('load', async () => {
  const refuses = (options, name, ...words) =>
    load(options).then(
      () => assert.ok(false, 'no error'),
      (error) => {
        assert.equal(error.name, name, error.message);
        for (const word of words) assert.ok(error.message.includes(word), error.message);
      },
    );
  await refuses({ module: 5 }, 'TypeError', 'module', '5', 'URL');
  await refuses({ file: 'x' }, 'TypeError', "'file'", 'module');
  await refuses({ module: new Uint8Array(8) }, 'ThrongError', 'compile', 'not throng.wasm');
  const empty = Uint8Array.of(0, 0x61, 0x73, 0x6d, 1, 0, 0, 0);
  await refuses({ module: empty }, 'TypeError', 'module', 'another WebAssembly module', 'throng.wasm');
  await refuses({ module: new Response('', { status: 404 }) }, 'ThrongError', '404');
});

test('a relative address counts from the page, in Node from the working folder', async () => {
  const file = new URL('../web/throng.wasm', import.meta.url);
  let address = '../../web/throng.wasm'; // the page of the tests is web-tests/browser/
  if (file.protocol === 'file:') {
    const [{ relative }, { fileURLToPath }] = await Promise.all([import('node:path'), import('node:url')]);
    address = relative('.', fileURLToPath(file));
  }
  const made = await load({ module: address });
  assert.deepEqual(Array.from(made.findPairs(two)), [0, 1]);
});

test('options with getters that free', () => {
  for (const name of ['group', 'mask', 'other']) {
    const finder = new throng.Finder();
    const options = Object.defineProperty({}, name, { enumerable: true, get: () => finder.free() });
    refused(() => finder.find(two, options), 'ThrongError', 'freed');
  }
});

test('an earlier result as a filter', () => {
  const finder = new throng.Finder();
  const boxes = new Float32Array(6 * 300).fill(1);
  const earlier = finder.find(boxes).subarray(0, 600);
  const copy = earlier.slice();
  const more = new Float32Array(6 * 600).fill(1);
  const found = finder.find(more, { group: earlier }).slice().sort();
  assert.deepEqual(found, throng.findPairs(more, { group: copy }).sort());
  finder.free();
});

test('arrays of another realm', async () => {
  let other;
  if (typeof document === 'undefined') {
    const { runInNewContext } = await import('node:vm');
    other = runInNewContext('({ Float32Array, Uint32Array })');
  } else {
    const frame = document.createElement('iframe');
    document.body.append(frame);
    other = frame.contentWindow;
  }
  assert.notEqual(other.Float32Array, Float32Array);
  const boxes = other.Float32Array.from(two);
  assert.deepEqual(Array.from(throng.findPairs(boxes, { group: other.Uint32Array.of(1, 1) })), [0, 1]);
  refused(() => throng.findPairs(boxes, { group: boxes }), 'TypeError', 'group', 'Float32Array', 'Uint32Array');
});

test('memory of other dimensions', () => {
  const flat = throng.allocateBoxes(6, { dimensions: 2 });
  refused(() => throng.findPairs(flat), 'RangeError', 'boxes', '2 dimensions', 'wanted 3', 'allocateBoxes');
  assert.equal(throng.findPairs(flat, { dimensions: 2 }).length, 2 * 15);
  flat.free();
  refused(() => throng.allocateBoxes(1, { dimension: 2 }), 'TypeError', "'dimension'", 'dimensions');
  refused(() => throng.allocateBoxes(1, null), 'TypeError', 'options', 'null');
});

test('load takes the bytes, a module, or a response', async () => {
  const { readBytes } = await import('./support.mjs');
  const bytes = await readBytes('../web/throng.wasm');
  const module = await WebAssembly.compile(bytes);
  const typed = new Response(bytes, { headers: { 'content-type': 'application/wasm' } });
  for (const source of [bytes, new Uint8Array(bytes), module, new Response(bytes), typed]) {
    const made = await load({ module: source });
    assert.deepEqual(Array.from(made.findPairs(two)), [0, 1]);
  }
});
