// The examples of the documentation do what it says.
import test from 'node:test';
import assert from 'node:assert/strict';
import { pairs } from './examples/pairs.mjs';
import { errors, events, pairsPerFrame } from './examples/frames.mjs';

test('pairs', () => assert.deepEqual(Array.from(pairs), [0, 1, 1, 2]));
test('frames', () => {
  const found = pairsPerFrame(5);
  assert.equal(found.length, 5);
  assert.ok(found.every((count) => count > 100) && new Set(found).size > 1);
});
test('events and queries', () => {
  assert.deepEqual(events(), ['0 and 1 began', '0 and 1 ended', true, 2, 2, 0.5]);
});
test('errors', () => {
  assert.equal(errors(Float32Array.of(0, NaN, 0, 1, 1, 1)), 'box 0 has a NaN');
  assert.equal(errors(new Float32Array(12)).length, 2);
});
