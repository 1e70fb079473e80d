// The host of the GPU search in JavaScript, where there is no GPU: its sizes are those of steps.json.
import test from 'node:test';
import assert from 'node:assert/strict';
import { GpuFinder, ThrongError, sizesOf } from '../web/webgpu.js';
import { readBytes } from './support.mjs';

const { workgroups, bytes } = JSON.parse(new TextDecoder().decode(await readBytes('steps.json')));

/** The value of an expression of steps.json: integers, whose quotients are rounded down. */
function evaluate(text, names) {
  const min = (a, b) => (a < b ? a : b);
  const max = (a, b) => (a > b ? a : b);
  const code = text.replaceAll('//', '/').replace(/\b\d+\b/g, '$&n');
  return Function('min', 'max', ...Object.keys(names), `return ${code};`)(min, max, ...Object.values(names));
}

test('workgroups and bytes are those of steps.json', () => {
  for (const count of [0, 1, 63, 64, 65, 255, 256, 257, 2047, 2048, 4096, 4097, 99999, 1000000, 4194304]) {
    for (const capacity of [0, 1, 256, 4096, 1048577, 16777216]) {
      const found = sizesOf(count, capacity, true);
      const names = { n: BigInt(count), m: BigInt(capacity) };
      for (const [name, text] of Object.entries(workgroups)) {
        names[name] = evaluate(text, names);
        assert.equal(found.workgroups[name], Number(names[name]), `${name}, ${count} boxes, ${capacity} pairs`);
      }
      for (const [name, text] of Object.entries(bytes)) {
        assert.equal(found.bytes[name], Number(evaluate(text, names)), `${name}, ${count} boxes, ${capacity} pairs`);
      }
      assert.deepEqual(Object.keys(found.workgroups).sort(), Object.keys(workgroups).sort());
      assert.deepEqual(Object.keys(found.bytes).sort(), Object.keys(bytes).sort());
    }
  }
});

test('without WebGPU an error names the remedy', { skip: globalThis.navigator?.gpu !== undefined }, async () => {
  await assert.rejects(GpuFinder.create(), { name: 'ThrongError', code: 'no_device', message: /navigator\.gpu is missing.*load\(\)/ });
});

test('wrong options are refused before a device is requested', async () => {
  await assert.rejects(GpuFinder.create({ order: 'sorted' }), { name: 'RangeError', message: /order: found 'sorted', wanted 'any', 'canonical'/ });
  await assert.rejects(GpuFinder.create({ nan: 1 }), { name: 'TypeError', message: /nan: found 1/ });
  await assert.rejects(GpuFinder.create({ margin: 1 }), { name: 'TypeError', message: /found 'margin', wanted device/ });
  await assert.rejects(GpuFinder.create({ device: {} }), { name: 'TypeError', message: /device: found an Object, wanted a GPUDevice/ });
  assert.throws(() => new GpuFinder(), { name: 'TypeError', message: /await GpuFinder\.create\(\)/ });
  assert.ok(new ThrongError('', '') instanceof Error);
});
