// The answers of the library elsewhere: of its golden table, of its double loop, and of its queries.
import test from 'node:test';
import assert from 'node:assert/strict';
import { load } from '../web/index.js';
import { pairChecksum, readCases, sequenceChecksum, sorted } from './support.mjs';

const throng = await load();
const cases = await readCases();
const filterNames = ['group', 'mask', 'owner', 'world', 'static'];

function optionsOf(one) {
  const options = { inverted: 'inactive', nan: one.nan ?? 'refuse', margin: one.margin ?? 0 };
  for (const name of filterNames) {
    if (one[name]) options[name] = one[name];
    if (one.other?.[name]) options[`other${name[0].toUpperCase()}${name.slice(1)}`] = one.other[name];
  }
  if (one.other) options.other = one.other.boxes;
  return options;
}

for (const one of cases.golden) {
  test(`golden ${one.name}`, () => {
    const pairs = throng.findPairs(one.boxes, optionsOf(one));
    assert.equal(pairs.length / 2, one.pairs);
    assert.equal(pairChecksum(pairs), one.checksum);
    const inOrder = throng.findPairs(one.boxes, { ...optionsOf(one), order: 'canonical' });
    assert.equal(sequenceChecksum(inOrder), one.canonical);
  });
}

test('the cases are many and not empty', () => {
  assert.ok(cases.golden.length >= 20);
  assert.ok(cases.finds.length >= 600);
  assert.ok(cases.finds.filter((one) => one.pairs?.length > 0).length >= 400);
  assert.ok(cases.queries.length >= 30);
  assert.ok(cases.finds.some((one) => one.refused) && cases.finds.some((one) => one.other));
});

// Every algorithm, instruction set and order; and the boxes as separate corners.
for (const isa of ['wasm', 'scalar']) {
  for (const algorithm of ['all-pairs', 'grid']) {
    test(`finds, ${isa}, ${algorithm}`, () => {
      for (const one of cases.finds) {
        const options = { ...optionsOf(one), isa, algorithm };
        if (one.refused) {
          assert.throws(() => throng.findPairs(one.boxes, options), { code: 'nan_box' }, one.name);
          continue;
        }
        const wanted = Array.from(one.pairs);
        assert.deepEqual(Array.from(throng.findPairs(one.boxes, { ...options, order: 'canonical' })), wanted, one.name);
        assert.deepEqual(sorted(throng.findPairs(one.boxes, options)), wanted, one.name);
      }
    });
  }
}

test('finds, one Finder for all cases, separate corners', () => {
  const finder = new throng.Finder({ order: 'canonical', nan: 'inactive' });
  for (const one of cases.finds) {
    if (one.refused || one.margin !== 0) continue;
    const { nan, inverted, margin, ...search } = optionsOf(one);
    const count = one.boxes.length / 6;
    const corner = (from) => Float32Array.from({ length: 3 * count }, (_, k) => one.boxes[6 * Math.floor(k / 3) + from + (k % 3)]);
    const pairs = finder.find({ lower: corner(0), upper: corner(3) }, search);
    assert.deepEqual(Array.from(pairs), Array.from(one.pairs), one.name);
    assert.equal(finder.result.inactive, one.inactive, one.name);
  }
  finder.free();
});

for (const one of cases.queries) {
  test(`queries ${one.name}`, () => {
    const objects = new throng.BroadPhase();
    objects.add(one.boxes);
    const boxes = one.boxes.subarray(0, 240);
    assert.deepEqual(Array.from(objects.findOverlaps(boxes)), Array.from(one.overlaps));
    for (const [which, pairs, times] of [['all', one.hits, one.times], ['first', one.first, one.firstTimes]]) {
      const hits = objects.findHits(boxes, one.by, { which });
      assert.deepEqual(Array.from(hits.pairs), Array.from(pairs));
      assert.deepEqual(Array.from(hits.times), Array.from(times));
    }
    for (let i = 0; i < one.rayObjects.length; ++i) {
      const hit = objects.raycast(one.origins.subarray(3 * i, 3 * i + 3), one.directions.subarray(3 * i, 3 * i + 3));
      assert.equal(hit?.object ?? 0xffffffff, one.rayObjects[i]);
      assert.equal(hit?.distance ?? 0, one.rayDistances[i]);
    }
    objects.free();
  });
}
