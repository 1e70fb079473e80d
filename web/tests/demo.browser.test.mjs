// The page, in a frame: it draws, and its four searches find the same pairs. Its console is that of the tests, which must be
// empty.
import test from 'node:test';
import assert from 'node:assert/strict';
import { boxesOfNpy } from '../web/demo/npy.js';
import { fixedScene, moveBoxes, paperCells, randomScene } from '../web/demo/scene.js';
import { load } from '../web/index.js';

const page = document.createElement('iframe');
Object.assign(page, { width: 900, height: 700 });

/** Opens the page and waits for frames; returns its last state. */
async function open(query) {
  page.src = new URL(`../web/demo/index.html?paused&${query}`, import.meta.url);
  const loaded = new Promise((resolve) => (page.onload = resolve));
  document.body.append(page);
  await loaded;
  for (;;) {
    await new Promise((resolve) => setTimeout(resolve, 200));
    const { message, state } = read();
    if (message) throw new Error(message);
    if (state?.frames >= 2) return state;
  }
}
function read() {
  const { body } = page.contentDocument;
  const message = page.contentDocument.getElementById('message');
  return { message: message.hidden ? '' : message.textContent, state: body.dataset.state && JSON.parse(body.dataset.state) };
}

const scene = randomScene(1000);
const boxes = new Float32Array(6000);
moveBoxes(scene, 0, boxes);
const wanted = (await load()).findPairs(boxes).length / 2;

for (const search of ['throng', 'paper', 'brute', 'cpu']) {
  test(`the page, ${search}`, async () => {
    const state = await open(`boxes=1000&search=${search}&x=5`);
    assert.equal(state.search, search);
    assert.equal(state.boxes, 1000);
    assert.ok(state.gpu, 'WebGPU is used');
    assert.equal(state.pairs, wanted);
    const canvas = page.contentDocument.getElementById('canvas');
    assert.ok(canvas.width > 300 && canvas.height > 200);
  });
}

test('boxes stay in their cube, and each comes back', () => {
  const later = new Float32Array(6000);
  for (const time of [0.5, 100, 12345]) {
    moveBoxes(scene, time, later);
    assert.ok(later.every((x) => x > -1 && x < scene.side + 1));
  }
});

test('the cells of the paper hold about X boxes', () => {
  for (const perCell of [1, 8, 64]) {
    const { cells } = paperCells(scene, perCell);
    const average = 1000 / (cells[0] * cells[1] * cells[2]);
    assert.ok(average >= perCell * 0.99 && average < 8 * perCell, `${average} for X = ${perCell}`);
  }
});

function npy(header, bytes) {
  const text = new TextEncoder().encode(`${header}\n`);
  return Uint8Array.of(0x93, ...new TextEncoder().encode('NUMPY'), 1, 0, text.length & 255, text.length >> 8, ...text, ...bytes).buffer;
}
test('.npy files, and what is wrong with them', () => {
  const one = Float32Array.of(0, 0, 0, 1, 1, 1);
  const bytes = new Uint8Array(one.buffer);
  const header = (type, order, shape) => `{'descr': '${type}', 'fortran_order': ${order}, 'shape': ${shape}, }`;
  assert.deepEqual(Array.from(boxesOfNpy(npy(header('<f4', 'False', '(1, 6)'), bytes))), Array.from(one));
  assert.deepEqual(Array.from(boxesOfNpy(npy(header('<f4', 'False', '(1, 2, 3)'), bytes))), Array.from(one));
  const wrong = [
    [new ArrayBuffer(4), /no \.npy file/],
    [npy(header('<f8', 'False', '(1, 6)'), bytes), /the type <f8, wanted float32/],
    [npy(header('<f4', 'True', '(1, 6)'), bytes), /Fortran order/],
    [npy(header('<f4', 'False', '(6,)'), bytes), /the shape \(6\), wanted \(n, 6\) or \(n, 2, 3\)/],
    [npy(header('<f4', 'False', '(2, 6)'), bytes), /shorter than its shape says/],
  ];
  for (const [data, message] of wrong) assert.throws(() => boxesOfNpy(data), { message });
  const fixed = fixedScene(Float32Array.of(0, 0, 0, 1, 2, 3, NaN, 0, 0, 9, 9, 9));
  assert.deepEqual(fixed.extent, [1, 2, 3]);
});
