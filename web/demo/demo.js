// The page: controls, the loop of frames, and what is shown about them.
import { load } from '../index.js';
import { requestDevice } from '../webgpu.js';
import { GpuWorld } from './gpu.js';
import { Camera } from './camera.js';
import { boxesOfNpy } from './npy.js';
import { fixedScene, moveBoxes, randomScene } from './scene.js';
import { drawFlat } from './flat.js';

const at = (id) => document.getElementById(id);
const dark = matchMedia('(prefers-color-scheme: dark)');
const canvas = at('canvas');
const camera = new Camera();
const whole = new Intl.NumberFormat('en');

let world; // on the GPU; none without WebGPU
let throng;
let finder;
let scene;
let isPaused = matchMedia('(prefers-reduced-motion: reduce)').matches;
let time = 0;
let frames = 0;
let resume = () => {}; // a frame that failed waits for another choice

// What stays on the page until it is loaded again, before what show() adds.
let always = '';
function show(message) {
  const text = `${always} ${message}`.trim();
  at('message').hidden = !text;
  at('message').textContent = text;
}
const chosen = () => at('controls').elements.search.value;
function setPaused(paused) {
  isPaused = paused;
  at('pause').textContent = paused ? 'Continue' : 'Pause';
  at('pause').setAttribute('aria-pressed', String(paused));
}

const mostForBrute = 100_000;
function checkBrute() {
  if (!world || !scene) return;
  const { search } = at('controls').elements;
  const brute = [...search].find(({ value }) => value === 'brute');
  brute.disabled = scene.count > mostForBrute;
  if (!brute.disabled || !brute.checked) return;
  search.value = 'throng';
  showRows();
  show(`Brute force is offered up to ${whole.format(mostForBrute)} boxes: more pairs keep a GPU busy for seconds.`);
}

function setScene(next) {
  if (world) world.setScene(next);
  scene?.onCpu?.memory.free();
  scene = next;
  time = 0;
  scene.onCpu = undefined;
  at('what').textContent = next.name ? `${next.name}: ${next.count === 1 ? 'one box' : `${whole.format(next.count)} boxes`}.` : '';
  if (next.inactive > 0) {
    show(`${whole.format(next.inactive)} of the boxes overlap nothing, as they have lower > upper or a NaN. Six numbers per box: lower x, y, z, upper x, y, z.`);
  }
  checkBrute();
}

/** The pairs of this moment by WebAssembly, with the number of partners of each box. */
async function searchOnCpu() {
  if (!throng) {
    throng = await load();
    finder = new throng.Finder({ nan: 'inactive' });
  }
  const { count } = scene;
  scene.onCpu ??= { memory: throng.allocateBoxes(count), partners: new Uint32Array(count) };
  const { memory, partners } = scene.onCpu;
  const begin = performance.now();
  moveBoxes(scene, time, memory.values);
  const moved = performance.now();
  const pairs = finder.find(memory);
  const found = performance.now();
  partners.fill(0);
  for (const box of pairs) ++partners[box];
  return { boxes: memory.values, partners, pairs: pairs.length / 2, times: { move: moved - begin, search: found - moved } };
}

async function frame() {
  const search = chosen();
  const colour = dark.matches ? [0.043, 0.051, 0.063, 1] : [0.945, 0.953, 0.965, 1];
  const found = search === 'cpu' ? await searchOnCpu() : undefined;
  if (!world) {
    const begin = performance.now();
    drawFlat(canvas, scene, camera, found);
    return { ...found, times: { ...found.times, draw: performance.now() - begin } };
  }
  const perCell = Number(at('perCell').value);
  const begin = performance.now();
  const drawn = await world.frame({ search, time, perCell, camera, background: colour, found });
  const total = performance.now() - begin;
  if (found) return { ...found, times: { ...drawn.times, ...found.times } };
  return { ...drawn, total };
}

function fitCanvas() {
  const ratio = Math.min(devicePixelRatio, 2);
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
  const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
}

const milliseconds = (value) => (value === undefined ? '-' : `${value.toFixed(value < 10 ? 2 : 1)} ms`);
let shownAt = 0;
let countedFrames = 0;
function report(now, { pairs, times, cells, total }) {
  ++frames;
  ++countedFrames;
  document.body.dataset.state = JSON.stringify({ frames, pairs, search: chosen(), boxes: scene.count, time, gpu: Boolean(world) });
  if (now - shownAt < 500) return;
  at('pairs').textContent = whole.format(pairs);
  at('rate').textContent = shownAt === 0 ? '-' : ((1000 * countedFrames) / (now - shownAt)).toFixed(1);
  at('move').textContent = milliseconds(times.move);
  at('grid').textContent = milliseconds(times.grid);
  // Without timestamps only the whole frame is measured.
  const onlyTotal = times.search === undefined && total !== undefined;
  at('searching').textContent = onlyTotal ? `${milliseconds(total)} for all` : milliseconds(times.search);
  at('draw').textContent = milliseconds(times.draw);
  const shape = cells ? ` ${whole.format(cells[0] * cells[1] * cells[2])} cells.` : '';
  if (!scene.name) at('what').textContent = shape.trim();
  shownAt = now;
  countedFrames = 0;
}

let last = 0;
async function loop(now) {
  try {
    fitCanvas();
    if (!isPaused) time += Math.min(0.1, (now - last) / 1000);
    last = now;
    report(now, await frame());
  } catch (error) {
    show(error.message);
    console.info(error);
    setPaused(true);
    if (error.code === 'out_of_memory') throng = scene.onCpu = undefined; // the instance may have ended
    await new Promise((resolve) => (resume = resolve));
  }
  requestAnimationFrame(loop);
}

// Only the paper's search has a grid of its own, with X.
function showRows() {
  at('cells').hidden = at('gridRow').hidden = chosen() !== 'paper';
}
at('controls').addEventListener('submit', (event) => event.preventDefault());
at('controls').addEventListener('change', (event) => {
  showRows();
  show('');
  checkBrute();
  resume();
  if (event.target === at('count')) choose(() => randomScene(Number(at('count').value)));
});
at('perCell').addEventListener('input', () => (at('perCellValue').textContent = at('perCell').value));
at('pause').addEventListener('click', () => {
  show('');
  setPaused(!isPaused);
  resume();
});

function choose(make) {
  resume();
  show('');
  try {
    setScene(make());
  } catch (error) {
    show(error.message);
  }
}
async function openFile(file) {
  if (!file) return;
  at('count').selectedIndex = -1; // so that each choice is a change
  at('file').value = '';
  let data;
  try {
    data = await file.arrayBuffer();
  } catch (error) {
    show(`${file.name}: ${error.message}`); // a folder
    return;
  }
  choose(() => {
    const boxes = boxesOfNpy(data);
    if (boxes.length === 0) throw new Error(`${file.name}: it has no boxes`);
    return { ...fixedScene(boxes), name: file.name };
  });
}
at('file').addEventListener('change', () => openFile(at('file').files[0]));
addEventListener('dragover', (event) => event.preventDefault());
addEventListener('drop', (event) => {
  event.preventDefault();
  openFile(event.dataTransfer.files[0]);
});

const keys = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
canvas.addEventListener('keydown', (event) => {
  if (keys[event.key]) camera.turn(...keys[event.key]);
  else if (event.key === '+' || event.key === '=') camera.zoom(1 / 1.15);
  else if (event.key === '-') camera.zoom(1.15);
  else return;
  event.preventDefault();
});
canvas.addEventListener('pointermove', (event) => {
  if (event.buttons & 1) camera.turn(-event.movementX / 150, event.movementY / 150);
});
canvas.addEventListener('pointerdown', (event) => canvas.setPointerCapture(event.pointerId));
canvas.addEventListener(
  'wheel',
  (event) => {
    event.preventDefault();
    camera.zoom(Math.exp(event.deltaY / 800));
  },
  { passive: false },
);

// ?boxes=100000&search=paper&x=8&paused: a link to these settings.
function followLink() {
  const given = new URLSearchParams(location.search);
  if ([...at('count').options].some(({ value }) => value === given.get('boxes'))) at('count').value = given.get('boxes');
  for (const input of at('controls').elements.search) input.checked ||= input.value === given.get('search');
  if (given.has('x')) at('perCell').value = given.get('x');
  at('perCellValue').textContent = at('perCell').value;
  showRows();
  setPaused(isPaused || given.has('paused'));
}

// Browsers give little away; SwiftShader is a CPU.
function nameOf({ adapterInfo: info }) {
  const name = info && (info.description || `${info.vendor} ${info.architecture}`.trim());
  return name || 'yes';
}

// The page is painted before this work begins.
const painted = () => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));

async function start() {
  followLink();
  at('what').textContent = 'Preparing the GPU. The first time takes some seconds.';
  await painted();
  try {
    const device = await requestDevice(['timestamp-query']);
    world = await GpuWorld.create(device, canvas);
    at('device').textContent = nameOf(device);
    device.lost.then(({ message }) => {
      if (document.hidden) return;
      show(`The GPU device is lost (${message}). Load the page again.`);
      setPaused(true);
    });
  } catch (error) {
    world = undefined;
    at('device').textContent = 'none';
    const why = error.code !== 'no_device' ? error.message
      : navigator.gpu ? 'WebGPU finds no GPU on this machine.'
      : 'This browser has no WebGPU, or the page is not opened by https: or from localhost.';
    always = `${why} The page runs on the CPU, in WebAssembly.`;
    show('');
    for (const input of at('controls').elements.search) {
      input.disabled = input.value !== 'cpu';
      input.checked = input.value === 'cpu';
    }
  }
  setScene(scene ?? randomScene(Number(at('count').value))); // a file may have come meanwhile
  requestAnimationFrame(loop);
}
start();
