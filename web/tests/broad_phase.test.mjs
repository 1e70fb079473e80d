// Persistent objects: random steps against a double loop over the objects.
import test from 'node:test';
import assert from 'node:assert/strict';
import { load } from '../web/index.js';
import { allows, overlap, random, randomBoxes } from './support.mjs';

const throng = await load();
const everything = { group: 0xffffffff, mask: 0xffffffff, owner: -1, world: -1, static: false };

// What a BroadPhase should hold: boxes and filters by id.
class Model {
  objects = new Map();

  pairs() {
    const found = new Map();
    const all = [...this.objects].sort((a, b) => a[0] - b[0]);
    for (const [i, [a, one]] of all.entries()) {
      for (const [b, other] of all.slice(i + 1)) {
        if (overlap(one.box, 0, other.box, 0) && allows(one.filter, other.filter)) found.set(`${a} ${b}`, [a, b]);
      }
    }
    return found;
  }
}

const pairsOf = (triples) => Array.from({ length: triples.length / 3 }, (_, i) => `${triples[3 * i]} ${triples[3 * i + 1]}`);

function randomFilter(next) {
  return {
    group: 1 << Math.floor(next() * 3),
    mask: Math.floor(next() * 8),
    owner: Math.floor(next() * 6) - 1,
    world: Math.floor(next() * 3) - 1,
    static: next() < 0.2,
  };
}
const columns = (filters) => ({
  group: Uint32Array.from(filters, (one) => one.group),
  mask: Uint32Array.from(filters, (one) => one.mask),
  owner: Int32Array.from(filters, (one) => one.owner),
  world: Int32Array.from(filters, (one) => one.world),
  static: Uint8Array.from(filters, (one) => one.static),
});

for (let seed = 1; seed <= 6; ++seed) {
  test(`random steps, seed ${seed}`, () => {
    const next = random(seed);
    const objects = new throng.BroadPhase();
    const model = new Model();
    const withFilters = seed % 2 === 0;
    let before = new Map();
    let seen = 0;
    const slots = new Map();
    const alive = () => [...model.objects.keys()];
    const some = (share) => alive().filter(() => next() < share);

    for (let step = 0; step < 40; ++step) {
      if (step === 0 || next() < 0.4) {
        const count = step === 0 ? 150 : Math.floor(next() * 20);
        const boxes = randomBoxes(next, count, 8);
        const filters = Array.from({ length: count }, () => (withFilters ? randomFilter(next) : everything));
        const ids = objects.add(boxes, withFilters ? columns(filters) : undefined);
        assert.equal(ids.length, count);
        ids.forEach((id, i) => model.objects.set(id, { box: boxes.slice(6 * i, 6 * i + 6), filter: filters[i] }));
      }
      if (next() < 0.3) {
        const ids = some(0.1);
        objects.remove(ids);
        for (const id of ids) model.objects.delete(id);
      }
      if (next() < 0.8) {
        const ids = Uint32Array.from(some(0.3));
        const boxes = randomBoxes(next, ids.length, 8);
        objects.move(ids, boxes);
        ids.forEach((id, i) => (model.objects.get(id).box = boxes.slice(6 * i, 6 * i + 6)));
      }
      if (withFilters && next() < 0.3) {
        const ids = some(0.1);
        const filters = ids.map(() => randomFilter(next));
        objects.setFilters(ids, columns(filters));
        ids.forEach((id, i) => (model.objects.get(id).filter = filters[i]));
      }
      objects.update();

      const now = model.pairs();
      const sortedKeys = (map) => [...map.values()].sort((a, b) => a[0] - b[0] || a[1] - b[1]).map(([a, b]) => `${a} ${b}`);
      assert.deepEqual(pairsOf(objects.pairs), sortedKeys(now));
      const difference = (a, b) => new Map([...a].filter(([key]) => !b.has(key)));
      assert.deepEqual(pairsOf(objects.begun), sortedKeys(difference(now, before)));
      assert.deepEqual(pairsOf(objects.ended), sortedKeys(difference(before, now)));
      // A pair keeps its slot.
      const { ended, begun, pairs } = objects;
      for (let i = 0; i < ended.length; i += 3) {
        assert.equal(slots.get(`${ended[i]} ${ended[i + 1]}`), ended[i + 2]);
        slots.delete(`${ended[i]} ${ended[i + 1]}`);
      }
      for (let i = 0; i < begun.length; i += 3) slots.set(`${begun[i]} ${begun[i + 1]}`, begun[i + 2]);
      for (let i = 0; i < pairs.length; i += 3) assert.equal(slots.get(`${pairs[i]} ${pairs[i + 1]}`), pairs[i + 2]);
      assert.equal(new Set(slots.values()).size, slots.size);

      assert.equal(objects.objectCount, model.objects.size);
      assert.equal(objects.pairCount, now.size);
      assert.equal(objects.result.found, now.size);
      for (const id of some(0.05)) {
        assert.ok(objects.isAlive(id));
        assert.deepEqual(Array.from(objects.box(id)), Array.from(model.objects.get(id).box));
        const { group, mask, owner, world } = model.objects.get(id).filter;
        assert.deepEqual(objects.filter(id), {
          group: group >>> 0, mask: mask >>> 0, owner, world, static: model.objects.get(id).filter.static,
        });
        const own = [...now.values()].filter(([a, b]) => a === id || b === id).length;
        assert.equal(objects.pairsOf(id).length / 3, own);
      }
      before = now;
      seen += now.size;
    }
    assert.ok(seen > 0);
    objects.free();
  });
}

test('moveAll detects what changed; shiftOrigin moves all', () => {
  const next = random(9);
  const boxes = randomBoxes(next, 100, 6);
  const objects = new throng.BroadPhase();
  objects.add(boxes);
  objects.update();
  const before = pairsOf(objects.pairs);
  boxes.set([0, 0, 0, 9, 9, 9]);
  objects.moveAll(boxes);
  objects.update();
  assert.ok(objects.begun.length > 0);
  assert.ok(pairsOf(objects.begun).every((pair) => pair.startsWith('0 ')));
  objects.shiftOrigin([16, 0, -16]);
  objects.update();
  assert.deepEqual(Array.from(objects.box(0)), [16, 0, -16, 25, 9, -7]);
  assert.ok(pairsOf(objects.pairs).length > before.length);
  objects.free();
});

test('a copy has the same ids, pairs and events, and is independent', () => {
  const objects = new throng.BroadPhase();
  objects.add(randomBoxes(random(4), 80, 4));
  objects.update();
  const copy = objects.copy();
  assert.ok(copy instanceof throng.BroadPhase);
  assert.ok(objects.pairCount > 0);
  assert.deepEqual(copy.begun, objects.begun);
  copy.remove(0);
  copy.update();
  assert.ok(objects.isAlive(0) && !copy.isAlive(0));
  objects.free();
  assert.equal(copy.objectCount, 79);
  copy.free();
});

test('raycast considers layers, worlds and distance', () => {
  const objects = new throng.BroadPhase();
  const boxes = Float32Array.of(1, -1, -1, 2, 1, 1, 4, -1, -1, 5, 1, 1, 7, -1, -1, 8, 1, 1);
  objects.add(boxes, { group: Uint32Array.of(1, 2, 4), world: Int32Array.of(0, 1, -1) });
  const along = [2, 0, 0];
  assert.deepEqual(objects.raycast([0, 0, 0], along), { object: 0, distance: 1, point: [1, 0, 0], normal: [-1, 0, 0] });
  assert.equal(objects.raycast([0, 0, 0], along, { layerMask: 6 }).object, 1);
  assert.equal(objects.raycast([0, 0, 0], along, { layerMask: 4 }).distance, 7);
  assert.equal(objects.raycast([0, 0, 0], along, { world: 1 }).object, 1);
  assert.equal(objects.raycast([0, 0, 0], along, { maxDistance: 0.5 }), null);
  assert.equal(objects.raycast([0, 0, 0], along, { maxDistance: 1 }).object, 0);
  assert.equal(objects.raycast([0, 9, 0], along), null);
  objects.free();
});

test('2-D objects', () => {
  const objects = new throng.BroadPhase({ dimensions: 2 });
  objects.add(Float32Array.of(0, 0, 2, 2, 1, 1, 3, 3, 5, 5, 6, 6));
  objects.update();
  assert.deepEqual(pairsOf(objects.begun), ['0 1']);
  assert.deepEqual(Array.from(objects.box(1)), [1, 1, 3, 3]);
  assert.deepEqual(objects.raycast([4, 5.5], [1, 0]), { object: 2, distance: 1, point: [5, 5.5], normal: [-1, 0] });
  const { pairs, times } = objects.findHits(Float32Array.of(4, 5.5, 4, 5.5), Float32Array.of(2, 0));
  assert.deepEqual([Array.from(pairs), Array.from(times)], [[0, 2], [0.5]]);
  objects.free();
});
