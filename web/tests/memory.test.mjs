// What happens when there is no memory.
import test from 'node:test';
import assert from 'node:assert/strict';
import { load } from '../web/index.js';
import { Instance } from '../web/wasm.js';
import { Finder } from '../web/finder.js';

const two = Float32Array.of(0, 0, 0, 1, 1, 1, 0.5, 0.5, 0.5, 2, 2, 2);

test('more pairs than memory holds: an error with the bytes, and the instance still works', async () => {
  const throng = await load();
  const count = 40000;
  const finder = new throng.Finder();
  assert.throws(() => finder.find(new Float32Array(6 * count)), {
    name: 'ThrongError',
    code: 'out_of_memory',
    bytesNeeded: ((count * (count - 1)) / 2) * 8,
    message: /6399840000 bytes/,
  });
  assert.deepEqual(Array.from(finder.find(two)), [0, 1]);
  assert.throws(() => throng.allocateBoxes(2 ** 28), { code: 'out_of_memory', bytesNeeded: 24 * 2 ** 28 });
  assert.deepEqual(Array.from(throng.findPairs(two)), [0, 1]);
});

test('no memory for the search itself ends the instance, and each later call says so', async () => {
  const instance = await Instance.load(new URL('../web/throng.wasm', import.meta.url));
  const finder = new Finder(instance, {});
  const boxes = new Float32Array(6 * 100000);
  for (let i = 0; i < 100000; ++i) boxes.set([2 * i, 0, 0, 2 * i + 1, 1, 1], 6 * i);
  // There is room for the boxes and for the list of pairs, not for the search. What nobody writes takes no memory of
  // the machine.
  instance.scratch('boxes.packed', boxes.byteLength);
  finder.find(two);
  const room = instance.allocate(3.3e6);
  for (let size = 2 ** 31; size >= 2 ** 16; size /= 2) {
    while (instance.call('malloc', size) !== 0);
  }
  instance.release(room);
  assert.throws(() => finder.find(boxes), { name: 'ThrongError', code: 'out_of_memory', message: /load\(\) makes another/ });
  assert.ok(instance.hasEnded);
  assert.throws(() => finder.find(two), { code: 'out_of_memory', message: /ended the instance/ });
  finder.free();
  const throng = await load();
  assert.deepEqual(Array.from(throng.findPairs(two)), [0, 1]);
});
