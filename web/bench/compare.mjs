// Times a search of 100,000 uniform boxes in WebAssembly, in Node and where it is installed in Chromium, beside native code on one
// thread, in turns; and beside other JavaScript packages. node compare.mjs FOLDER PROGRAM: FOLDER has the cases of scripts/web.
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';

const [folder, program] = process.argv.slice(2);
const here = pathToFileURL(`${folder}/`);
const { load } = await import(new URL('../web/index.js', here));
const { readCases } = await import(new URL('support.mjs', here));

const rounds = 7;
const runs = 9;
const { boxes } = (await readCases()).golden.find((one) => one.name === 'uniform 100000');
const count = boxes.length / 6;
const throng = await load();

// Processor time, in ms: other programs on the machine hardly change it.
function timed(run) {
  const start = process.cpuUsage();
  run();
  const { user, system } = process.cpuUsage(start);
  return (user + system) / 1000;
}
const repeated = (run) => Array.from({ length: runs }, () => timed(run));

const work = mkdtempSync(join(tmpdir(), 'throng-web-'));
const file = join(work, 'boxes.f32');
writeFileSync(file, new Uint8Array(boxes.buffer, boxes.byteOffset, boxes.byteLength));
const native = (isa) => () => execFileSync(program, [file, isa, String(runs)], { encoding: 'utf8' }).trim().split('\n').map(Number);

const memory = throng.allocateBoxes(count);
memory.values.set(boxes);
const finders = { wasm: new throng.Finder({ isa: 'wasm' }), scalar: new throng.Finder({ isa: 'scalar' }) };
const methods = {
  'native, SSE4': native('sse4'),
  'native, widest': native('auto'),
  'WebAssembly, SIMD': () => repeated(() => finders.wasm.find(memory)),
  'WebAssembly, SIMD, boxes copied': () => repeated(() => finders.wasm.find(boxes)),
  'native, scalar': native('scalar'),
  'WebAssembly, scalar': () => repeated(() => finders.scalar.find(memory)),
};

const times = Object.fromEntries(Object.keys(methods).map((name) => [name, []]));
for (const finder of Object.values(finders)) for (let i = 0; i < 20; ++i) finder.find(memory); // warms up
for (let round = 0; round < rounds; ++round) {
  for (const [name, run] of Object.entries(methods)) times[name].push(...run());
}
rmSync(work, { recursive: true });

// The same search in Chromium, in one go, by the clock: pages cannot read processor time.
const { openInChromium, program: chromium } = await import(new URL('chromium.mjs', here));
if (spawnSync(chromium, ['--version']).error === undefined) {
  const page = `<!doctype html><script type="module">
    import { load } from '/web/index.js';
    import { readCases } from '/web-tests/support.mjs';
    const throng = await load();
    const { boxes } = (await readCases()).golden.find((one) => one.name === 'uniform 100000');
    const memory = throng.allocateBoxes(boxes.length / 6);
    memory.values.set(boxes);
    const finder = new throng.Finder({ isa: 'wasm' });
    const timed = () => { const start = performance.now(); finder.find(memory); return performance.now() - start; };
    for (let i = 0; i < 20; ++i) timed();
    const times = Array.from({ length: ${rounds * runs} }, timed);
    await fetch('/report', { method: 'POST', body: JSON.stringify({ times, found: finder.result.found }) });
  </script>`;
  const report = await openInChromium(join(folder, '..'), '/time/', { '/time/': page });
  if (report.found !== finders.wasm.result.found) throw new Error(`Chromium found ${report.found} pairs ${report.failed} ${report.log}`);
  times['Chromium, SIMD, by the clock'] = report.times;
}

const median = (list) => [...list].sort((a, b) => a - b)[list.length >> 1];
const least = (list) => Math.min(...list);
const base = times['native, SSE4'];
console.log(`${count} uniform boxes, ${finders.wasm.result.found} pairs; ms of processor time of ${rounds * runs} runs on one thread, in turns`);
console.log('method                              least   median   least/SSE4   median/SSE4');
for (const [name, list] of Object.entries(times)) {
  const cells = [least(list).toFixed(2), median(list).toFixed(2), (least(list) / least(base)).toFixed(2), (median(list) / median(base)).toFixed(2)];
  console.log(name.padEnd(34) + cells.map((cell, i) => cell.padStart([7, 9, 13, 14][i])).join(''));
}

// The other packages, from web/node_modules: npm install --prefix web flatbush rbush box-intersect.
const finder = { flat: new throng.Finder({ dimensions: 2 }), solid: new throng.Finder() };
function report(name, pairs, run) {
  const list = [timed(run), timed(run), timed(run)];
  console.log(`${name.padEnd(34)}${least(list).toFixed(1).padStart(9)}   ${pairs} pairs`);
}
async function other(name, wanted, findPairs) {
  let made;
  try {
    made = await import(name);
  } catch (error) {
    if (error.code !== 'ERR_MODULE_NOT_FOUND') throw error;
    console.log(`${name.padEnd(34)}  skipped: not installed; npm install --prefix web ${name}`);
    return;
  }
  const run = () => findPairs(made.default);
  const found = run();
  if (found !== wanted) throw new Error(`${name} found ${found} pairs, wanted ${wanted}`);
  report(name, found, run);
}
function ours(finder, values) {
  finder.find(values);
  const { found } = finder.result;
  report('throng', found, () => finder.find(values));
  return found;
}
// Its boxes are arrays; to make them is not timed.
async function boxIntersect(values, wanted) {
  const stride = values.length / count;
  const items = Array.from({ length: count }, (_, i) => Array.from(values.subarray(stride * i, stride * (i + 1))));
  await other('box-intersect', wanted, (intersect) => {
    let found = 0;
    intersect(items, () => void ++found);
    return found;
  });
}

console.log(`\n${count} boxes, all pairs, ms of processor time, least of 3 runs`);
await boxIntersect(boxes, ours(finder.solid, boxes));

const flat = Float32Array.from({ length: 4 * count }, (_, k) => boxes[6 * (k >> 2) + [0, 1, 3, 4][k & 3]]);
console.log(`\n${count} rectangles, all pairs, ms of processor time, least of 3 runs; trees are built and queried`);
const wanted = ours(finder.flat, flat);
await boxIntersect(flat, wanted);
await other('flatbush', wanted, (Flatbush) => {
  const index = new Flatbush(count, 16, Float32Array);
  for (let i = 0; i < count; ++i) index.add(flat[4 * i], flat[4 * i + 1], flat[4 * i + 2], flat[4 * i + 3]);
  index.finish();
  let found = 0;
  for (let i = 0; i < count; ++i) {
    found += index.search(flat[4 * i], flat[4 * i + 1], flat[4 * i + 2], flat[4 * i + 3], (j) => j > i).length;
  }
  return found;
});
await other('rbush', wanted, (RBush) => {
  const tree = new RBush();
  const items = Array.from({ length: count }, (_, id) => ({
    minX: flat[4 * id], minY: flat[4 * id + 1], maxX: flat[4 * id + 2], maxY: flat[4 * id + 3], id,
  }));
  tree.load(items);
  let found = 0;
  for (const item of items) for (const hit of tree.search(item)) found += hit.id > item.id ? 1 : 0;
  return found;
});
