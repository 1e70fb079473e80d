// The GPU search against the answers of the library elsewhere, and against the WebAssembly module. Needs WebGPU: SwiftShader
// is enough.
import test from 'node:test';
import assert from 'node:assert/strict';
import { load } from '../web/index.js';
import { GpuFinder } from '../web/webgpu.js';
import { search } from './examples/gpu.mjs';
import { doubleLoop, pairChecksum, random, randomBoxes, readCases, sequenceChecksum, sorted } from './support.mjs';

const throng = await load();
const cases = await readCases();
const finder = await GpuFinder.create();
const { device } = finder;
const make = (options) => GpuFinder.create({ device, ...options });

// What the GPU search offers: one set, group and mask.
const offered = (one) => !one.other && !one.owner && !one.world && !one.static && !(one.margin > 0);
const filtersOf = ({ group, mask }) => ({ ...(group && { group }), ...(mask && { mask }) });

for (const order of ['any', 'canonical']) {
  test(`golden, ${order}`, async () => {
    const gpu = await make({ order });
    const golden = cases.golden.filter(offered);
    assert.ok(golden.length >= 15);
    for (const one of golden) {
      const pairs = await gpu.find(one.boxes);
      assert.equal(pairs.length / 2, one.pairs, one.name);
      assert.equal(pairChecksum(pairs), one.checksum, one.name);
      if (order === 'canonical') assert.equal(sequenceChecksum(pairs), one.canonical, one.name);
      assert.ok(gpu.result.dispatches <= 12);
    }
    gpu.free();
  });
}

for (const algorithm of ['all-pairs', 'grid']) {
  test(`finds, ${algorithm}`, async () => {
    const finds = cases.finds.filter(offered);
    assert.ok(finds.length >= 100);
    const refusing = await make({ algorithm, order: 'canonical' });
    const lenient = await make({ algorithm, order: 'canonical', nan: 'inactive' });
    for (const one of finds) {
      const gpu = one.nan === 'inactive' ? lenient : refusing;
      if (one.refused) {
        await assert.rejects(gpu.find(one.boxes, filtersOf(one)), { code: 'nan_box' }, one.name);
        continue;
      }
      assert.deepEqual(Array.from(await gpu.find(one.boxes, filtersOf(one))), Array.from(one.pairs), one.name);
      assert.equal(gpu.result.inactive, one.inactive, one.name);
    }
    refusing.free();
    lenient.free();
  });
}

test('random scenes: the pairs of the WebAssembly module', async () => {
  const next = random(7);
  for (let scene = 0; scene < 12; ++scene) {
    const count = 1000 + Math.floor(next() * 8000);
    const boxes = randomBoxes(next, count, 20 + 60 * next());
    for (let i = 0; i < count; i += 17) boxes[6 * i + 3] += 10 ** (2 * next());
    const pairs = await finder.find(boxes);
    assert.equal(finder.result.algorithm, count <= 2048 ? 'all-pairs' : 'grid');
    assert.equal(pairChecksum(pairs), pairChecksum(throng.findPairs(boxes)));
    assert.equal(pairs.length / 2, finder.result.found);
  }
});

test('separate corners, no boxes, one box, zeros of both signs', async () => {
  assert.equal((await finder.find(new Float32Array(0))).length, 0);
  assert.equal((await finder.find(new Float32Array(6))).length, 0);
  const lower = Float32Array.of(-1, 0, 0, 0, 1, 1);
  const upper = Float32Array.of(-0, 1, 1, 1, 2, 2);
  assert.deepEqual(Array.from(await finder.find({ lower, upper })), [0, 1]);
});

test('group and mask, one value or one each', async () => {
  const boxes = randomBoxes(random(3), 600, 5);
  const group = Uint32Array.from({ length: 600 }, (_, i) => 1 << (i % 3));
  const pairs = sorted(await finder.find(boxes, { group, mask: 3 }));
  assert.deepEqual(pairs, doubleLoop(boxes, (i, j) => i % 3 < 2 && j % 3 < 2));
  assert.ok(pairs.length > 100);
});

const storage = GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC;
function upload(array, usage = storage) {
  const buffer = device.createBuffer({ size: Math.max(4, array.byteLength), usage, mappedAtCreation: true });
  new array.constructor(buffer.getMappedRange(0, array.byteLength)).set(array);
  buffer.unmap();
  return buffer;
}
async function download(buffer, bytes) {
  const target = device.createBuffer({ size: bytes, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
  const encoder = device.createCommandEncoder();
  encoder.copyBufferToBuffer(buffer, 0, target, 0, bytes);
  device.queue.submit([encoder.finish()]);
  await target.mapAsync(GPUMapMode.READ);
  return new Uint32Array(target.getMappedRange());
}

test('buffers of the GPU: counts beyond the capacity, strides, filters, an encoder', async () => {
  const boxes = randomBoxes(random(5), 5000, 12);
  const wanted = throng.findPairs(boxes, { order: 'canonical' });
  const total = wanted.length / 2;
  const wide = new Float32Array(8 * 5000);
  for (let i = 0; i < 5000; ++i) {
    wide.set(boxes.subarray(6 * i, 6 * i + 3), 8 * i);
    wide.set(boxes.subarray(6 * i + 3, 6 * i + 6), 8 * i + 4);
  }
  const exact = await make({ order: 'canonical' });
  for (const [array, stride] of [[boxes, 24], [wide, 32]]) {
    const encoder = device.createCommandEncoder();
    const found = exact.findOnGpu(upload(array), 5000, { capacity: total, stride, encoder });
    device.queue.submit([encoder.finish()]);
    assert.deepEqual(Array.from(await download(found.pairs, 8 * total)), Array.from(wanted));
    assert.deepEqual(Array.from(await download(found.counts, 32)), [total, total, 0, 0, Math.ceil(total / 64), 1, 1, 0]);
  }
  const few = finder.findOnGpu(upload(boxes), 5000, { capacity: 100 });
  const counts = await download(few.counts, 32);
  assert.deepEqual(Array.from(counts.subarray(0, 3)), [100, total, 0]);
  const known = new Set(Array.from({ length: total }, (_, k) => `${wanted[2 * k]} ${wanted[2 * k + 1]}`));
  const pairs = await download(few.pairs, 800);
  const texts = Array.from({ length: 100 }, (_, k) => `${pairs[2 * k]} ${pairs[2 * k + 1]}`);
  assert.ok(texts.every((text) => known.has(text)) && new Set(texts).size === 100);
  const none = finder.findOnGpu(upload(boxes), 5000, { filters: upload(new Uint32Array(10000)) });
  assert.equal((await download(none.counts, 32))[1], 0);
  exact.free();
});

test('wrong arguments are named', async () => {
  const boxes = new Float32Array(12);
  const cases = [
    [[[1, 2]], 'TypeError', /boxes: found an Array/],
    [[new Float64Array(6)], 'TypeError', /boxes: found a Float64Array/],
    [[new Float32Array(7)], 'RangeError', /boxes: found 7 numbers, wanted 6 per box/],
    [[boxes, { owner: 1 }], 'TypeError', /found 'owner', wanted group, mask/],
    [[boxes, { group: new Uint32Array(3) }], 'RangeError', /group: found 3 values, wanted 2/],
    [[boxes, { mask: -1 }], 'RangeError', /mask: found -1/],
    [[Float32Array.of(0, NaN, 0, 1, 1, 1)], 'ThrongError', /1 of 1 boxes have a NaN, the first is box 0/],
  ];
  for (const [given, name, message] of cases) await assert.rejects(finder.find(...given), { name, message });
  const moved = new Float32Array(6);
  structuredClone(moved.buffer, { transfer: [moved.buffer] });
  await assert.rejects(finder.find(moved), { name: 'TypeError', message: /detached/ });
  const strict = await make({ inverted: 'refuse' });
  const inverted = Float32Array.of(0, 0, 0, 1, 1, 1, 2, 0, 0, 1, 1, 1);
  await assert.rejects(strict.find(inverted), { code: 'inverted_box', firstInvalid: 1, message: /the first is box 1/ });

  const small = upload(boxes);
  const onGpu = [
    [[boxes, 2], 'TypeError', /boxes: found a Float32Array, wanted a GPUBuffer/],
    [[small, 3], 'RangeError', /boxes: found a buffer of 48 bytes, wanted at least 72/],
    [[small, -1], 'RangeError', /count: found -1/],
    [[small, 2, { stride: 16 }], 'RangeError', /stride: found 16, wanted 24 or 32/],
    [[small, 2, { capacity: 1e12 }], 'RangeError', /capacity: found 1000000000000/],
    [[small, 2, { pairs: small, capacity: 7 }], 'RangeError', /pairs: found a buffer of 48 bytes, wanted at least 56/],
    [[small, 2, { encoder: 1 }], 'TypeError', /encoder: found 1/],
    [[upload(boxes, GPUBufferUsage.COPY_DST), 2], 'RangeError', /boxes: found a buffer without the usage STORAGE/],
    [[small, finder.maxBoxes + 1], 'ThrongError', /wanted at most \d+: the device binds at most/],
  ];
  for (const [given, name, message] of onGpu) assert.throws(() => finder.findOnGpu(...given), { name, message });
});

test('one search at a time; a freed finder and a lost device are reported', async () => {
  const boxes = randomBoxes(random(9), 100, 3);
  const first = finder.find(boxes);
  await assert.rejects(finder.find(boxes), { code: 'busy' });
  assert.deepEqual(sorted(await first), doubleLoop(boxes));
  const other = await GpuFinder.create();
  other.device.destroy();
  await other.device.lost;
  await assert.rejects(other.find(boxes), { code: 'device_error', message: /is lost.*create another/ });
  other.free();
  await assert.rejects(other.find(boxes), { code: 'released' });
});

test('the example finds the same pairs in arrays and in buffers', async () => {
  const boxes = randomBoxes(random(5), 3000, 15);
  const wanted = throng.findPairs(boxes).length / 2;
  assert.ok(wanted > 100 && wanted < 20000);
  assert.deepEqual(await search(boxes), [wanted, wanted]);
});

test('the capacity is that of the buffer for pairs', () => {
  const usage = GPUBufferUsage.STORAGE;
  const pairs = device.createBuffer({ size: 96, usage });
  const boxes = device.createBuffer({ size: 24, usage });
  assert.equal(finder.findOnGpu(boxes, 1, { pairs }).capacity, 12);
  assert.equal(finder.findOnGpu(boxes, 1).capacity, 4100);
  assert.throws(() => finder.findOnGpu(boxes, 1, { timestampWrites: {} }), { name: 'TypeError', message: /^timestampWrites: found an Object/ });
});

test('calls during a search', async () => {
  const gpu = await make();
  const boxes = randomBoxes(random(6), 2000, 10);
  const buffer = device.createBuffer({ size: 24, usage: GPUBufferUsage.STORAGE });
  const searching = gpu.find(boxes);
  assert.throws(() => gpu.findOnGpu(buffer, 1), { name: 'ThrongError', code: 'busy' });
  await assert.rejects(gpu.find(boxes), { name: 'ThrongError', code: 'busy' });
  assert.equal((await searching).length, throng.findPairs(boxes).length);
  const cut = gpu.find(boxes);
  gpu.free();
  await assert.rejects(cut, { name: 'ThrongError', code: 'released' });
  assert.equal(gpu.memoryBytes, 0);
});

test('buffers that are empty or larger than needed', async () => {
  const usage = GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC | GPUBufferUsage.COPY_DST;
  const [empty, large] = [0, 1000].map((size) => device.createBuffer({ size, usage }));
  device.queue.writeBuffer(large, 0, Float32Array.of(0, 0, 0, 1, 1, 1, 1, 1, 1, 2, 2, 2));
  const counts = device.createBuffer({ size: 32, usage });
  const read = device.createBuffer({ size: 32, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
  for (const [boxes, count, pairs, capacity, found] of [
    [large, 2, empty, 0, 1],
    [empty, 0, empty, 0, 0],
    [large, 2, large, 100, 1],
  ]) {
    const given = pairs === large ? device.createBuffer({ size: 1004, usage }) : pairs;
    device.pushErrorScope('validation');
    finder.findOnGpu(boxes, count, { pairs: given, counts, capacity });
    const encoder = device.createCommandEncoder();
    encoder.copyBufferToBuffer(counts, 0, read, 0, 32);
    device.queue.submit([encoder.finish()]);
    assert.equal(await device.popErrorScope(), null);
    await read.mapAsync(GPUMapMode.READ);
    assert.equal(new Uint32Array(read.getMappedRange())[1], found);
    read.unmap();
  }
});

test('an error of the device is the error of the search', async () => {
  const gpu = await make();
  const { createBuffer } = device;
  const failing = (descriptor) => createBuffer.call(device, descriptor.label === 'records' ? { ...descriptor, usage: 0xffff } : descriptor);
  Object.defineProperty(device, 'createBuffer', { value: failing, configurable: true });
  try {
    await assert.rejects(gpu.find(randomBoxes(random(7), 100, 5)), { name: 'ThrongError', code: 'device_error' });
  } finally {
    delete device.createBuffer;
  }
  const boxes = randomBoxes(random(7), 100, 5);
  assert.equal((await gpu.find(boxes)).length, throng.findPairs(boxes).length);
  gpu.free();
});
