// The search on a GPU, by WebGPU. Runs the shaders of ../wgsl as steps.json says; python/throng/webgpu.py is the same
// host in Python.
import * as argument from './arguments.js';
import { ThrongError, described } from './errors.js';
import { shaders, steps, frames } from './shaders.js';

export { ThrongError };

const maxWorkgroups = 65535;
// Up to this many boxes brute force runs: 3 steps instead of 7. As in python/throng/webgpu.py.
const bruteForceLimit = 2048;
const largestCount = 2 ** 29 - 1; // boxes, whose words have indices of 32 bits
const mostTiles = 92679; // of brute force: their pairs are no more than workgroups in two dimensions
const tile = 64;
const scanBlock = 2048; // see scan_cells.wgsl
const rowCells = 8192; // see size_class_grid.wgsl
const firstCapacity = 4096;
const bytesOfCounts = 32;
const bytesOfReport = 64;
// Typed arrays that are given lie in no memory of a WebAssembly module.
const noModule = { memory: { buffer: null } };

const over = (count, each) => Math.ceil(count / each);
const tableCells = (count) => Math.floor((count * 9) / 4) + 1024;

/** Workgroups of the steps, and bytes of the buffers, by the names in steps.json. */
export function sizesOf(count, capacity, isSorted) {
  const tiles = over(count, tile);
  const tableBlocks = over(tableCells(count) + rowCells + 1, scanBlock);
  const rowBlocks = over(count + 1, scanBlock);
  return {
    workgroups: {
      one: 1,
      boxes_by_256: over(count, 256),
      boxes_by_64: over(count, 64),
      tiles: (tiles * (tiles + 1)) / 2,
      table_blocks: tableBlocks,
      row_blocks: rowBlocks,
      pairs_by_256: Math.min(over(capacity, 256), 4096),
      long_rows: Math.min(over(count, 64), 256),
    },
    bytes: {
      parameters: 32,
      boxes: 24 * count,
      filters: 8 * count,
      records: 32 * count,
      grid: 2016,
      table: 4 * scanBlock * tableBlocks,
      sums: 4 * Math.max(tableBlocks, rowBlocks),
      places: 8 * count,
      pairs: 8 * capacity,
      found: 8 * capacity,
      firsts: isSorted ? 4 * scanBlock * rowBlocks : 4,
      rows: 4 * count,
      report: bytesOfReport,
      counts: bytesOfCounts,
    },
  };
}

function choice(value, name, wanted) {
  if (wanted.includes(value)) return value;
  const kind = typeof value === 'string' ? RangeError : TypeError;
  throw new kind(`${name}: found ${described(value)}, wanted ${wanted.map((one) => `'${one}'`).join(', ')}`);
}

function whole(value, name, most) {
  if (typeof value !== 'number') throw new TypeError(`${name}: found ${described(value)}, wanted an integer from 0 to ${most}`);
  if (Number.isInteger(value) && value >= 0 && value <= most) return value;
  throw new RangeError(`${name}: found ${value}, wanted an integer from 0 to ${most}`);
}

/** See webgpu.d.ts. */
export async function requestDevice(features = []) {
  const remedy = 'use load() and its Finder, which run on the CPU';
  const gpu = globalThis.navigator?.gpu;
  if (!gpu) {
    throw new ThrongError(
      `there is no WebGPU here: navigator.gpu is missing. Open the page by https: or from localhost, in a browser that has WebGPU, or ${remedy}`,
      'no_device',
    );
  }
  const adapter = await gpu.requestAdapter({ powerPreference: 'high-performance' });
  if (!adapter) {
    throw new ThrongError(`WebGPU found no GPU adapter; update the GPU's driver or allow the browser to use the GPU, or ${remedy}`, 'no_device');
  }
  const requiredLimits = {};
  for (const name of ['maxStorageBufferBindingSize', 'maxBufferSize']) requiredLimits[name] = adapter.limits[name];
  const requiredFeatures = [...features].filter((name) => adapter.features.has(name));
  return adapter.requestDevice({ label: 'throng', requiredLimits, requiredFeatures });
}

const pipelinesOfDevices = new WeakMap();

/** The pipelines of these steps, compiled once per device. */
async function compile(device, names) {
  let pipelines = pipelinesOfDevices.get(device);
  if (!pipelines) pipelinesOfDevices.set(device, (pipelines = new Map()));
  for (const name of names) {
    if (pipelines.has(name)) continue;
    const step = steps[name];
    const code = step.files.map((file) => shaders[file]).join('\n');
    const module = device.createShaderModule({ label: name, code });
    const entryPoint = step.entry ?? name;
    pipelines.set(name, device.createComputePipelineAsync({ label: name, layout: 'auto', compute: { module, entryPoint } }));
  }
  const found = {};
  for (const name of names) found[name] = await pipelines.get(name);
  return found;
}

const created = Symbol('create');

/** Finds pairs on a GPU repeatedly, and keeps its memory. */
export class GpuFinder {
  #device;
  #ownsDevice;
  #algorithm;
  #order;
  #nan;
  #inverted;
  #pipelines;
  #maxBytes;
  #buffers = new Map();
  #parameters = new Map();
  #result = { found: 0, written: 0, inactive: 0, nanCount: 0, comparisons: 0, dispatches: 0, algorithm: 'all-pairs' };
  #lost;
  #isReleased = false;
  #isBusy = false;

  static async create(options) {
    const given = argument.object(options, ['device', 'algorithm', 'order', 'nan', 'inverted']);
    const finder = new GpuFinder(created);
    finder.#algorithm = choice(given.algorithm ?? 'auto', 'algorithm', ['auto', 'all-pairs', 'grid']);
    finder.#order = choice(given.order ?? 'any', 'order', ['any', 'canonical']);
    finder.#nan = choice(given.nan ?? 'refuse', 'nan', ['refuse', 'inactive']);
    finder.#inverted = choice(given.inverted ?? 'inactive', 'inverted', ['refuse', 'inactive']);
    const device = given.device ?? (await requestDevice());
    if (typeof device.createComputePipelineAsync !== 'function') {
      throw new TypeError(`device: found ${described(device)}, wanted a GPUDevice, or none`);
    }
    finder.#device = device;
    finder.#ownsDevice = given.device === undefined;
    finder.#maxBytes = Math.min(device.limits.maxStorageBufferBindingSize, device.limits.maxBufferSize);
    finder.#maxBytes -= finder.#maxBytes % 16;
    device.lost.then(({ message }) => (finder.#lost = message || 'no reason was given'));
    const names = new Set();
    for (const [name, frame] of Object.entries(frames)) {
      const [algorithm, order] = name.split(' ');
      if (finder.#algorithm !== 'auto' && finder.#algorithm !== algorithm) continue;
      if ((order === 'sorted') === (finder.#order === 'canonical')) frame.steps.forEach((step) => names.add(step));
    }
    finder.#pipelines = await compile(device, names);
    return finder;
  }
  constructor(by) {
    if (by !== created) throw new TypeError('GpuFinder: found new, wanted await GpuFinder.create(), as a GPU answers later');
  }

  get device() {
    return this.#device;
  }
  get result() {
    return this.#result;
  }
  get maxBoxes() {
    return Math.min(this.#algorithm === 'all-pairs' ? mostTiles * tile : largestCount, Math.floor(this.#maxBytes / 32));
  }
  get maxPairs() {
    return Math.min(2 ** 31, this.#maxBytes / 8);
  }
  get memoryBytes() {
    let sum = 0;
    for (const buffer of this.#buffers.values()) sum += buffer.size;
    return sum;
  }

  async find(boxes, options) {
    const given = argument.object(options, ['group', 'mask']);
    const set = argument.boxes(noModule, boxes, 'boxes', 3);
    const filters = argument.filters(noModule, given, set.count);
    this.#checkCount(set.count);
    if (this.#isBusy) {
      throw new ThrongError('this GpuFinder searches already; await its find() first, or make another GpuFinder', 'busy');
    }
    this.#check();
    if (set.count === 0) {
      this.#result = { found: 0, written: 0, inactive: 0, nanCount: 0, comparisons: 0, dispatches: 0, algorithm: this.#frame(0) };
      return new Uint32Array(0);
    }
    this.#isBusy = true;
    try {
      return await this.#find(set, filters);
    } catch (error) {
      if (!(error instanceof ThrongError)) await new Promise((resolve) => setTimeout(resolve)); // device.lost comes later
      this.#check(error);
      throw error;
    } finally {
      this.#isBusy = false;
    }
  }

  async #find(set, filters) {
    const { count } = set;
    const { queue } = this.#device;
    const hasFilters = filters.group !== undefined || filters.mask !== undefined;
    let given;
    for (let wanted = firstCapacity; ; ) {
      let capacity, dispatches;
      const words = await this.#guarded(() => {
        if (!given) {
          given = { boxes: this.#reserve('boxes', 24 * count) };
          queue.writeBuffer(given.boxes, 0, packed(set));
          if (hasFilters) {
            given.filters = this.#reserve('filters', 8 * count);
            queue.writeBuffer(given.filters, 0, packedFilters(filters, count));
          }
        }
        given.pairs = this.#reserve('pairs', 8 * Math.min(wanted, this.maxPairs));
        given.counts = this.#reserve('counts', bytesOfCounts);
        capacity = Math.min(Math.floor(given.pairs.size / 8), this.maxPairs);
        const encoder = this.#device.createCommandEncoder();
        dispatches = this.#record(encoder, given, count, 24, capacity);
        return this.#read(encoder, this.#buffers.get('report'), bytesOfReport);
      });
      const report = {
        found: words[0] + words[1] * 2 ** 32,
        written: Math.min(words[0] + words[1] * 2 ** 32, capacity),
        inactive: words[5],
        nanCount: words[6],
        comparisons: words[3] + words[4] * 2 ** 32,
        dispatches,
        algorithm: this.#frame(count),
      };
      this.#refuse(words, count);
      if (report.found > this.maxPairs) {
        throw new ThrongError(
          `${report.found} pairs were found, a buffer of this device holds ${this.maxPairs} (limit maxStorageBufferBindingSize of ` +
            `${this.#maxBytes} bytes); filter by group and mask, or search parts of the boxes`,
          'out_of_memory',
        );
      }
      if (report.found > capacity) {
        wanted = report.found;
        continue;
      }
      this.#result = report;
      if (report.found === 0) return new Uint32Array(0);
      return this.#guarded(() => this.#read(this.#device.createCommandEncoder(), given.pairs, 8 * report.found));
    }
  }

  /** The words that `run` reads, or an error if the device had one, such as a lack of memory. */
  async #guarded(run) {
    const scopes = ['validation', 'out-of-memory', 'internal'];
    for (const scope of scopes) this.#device.pushErrorScope(scope);
    let reading;
    try {
      reading = run().catch((error) => error); // thrown below
    } finally {
      for (const at of scopes.keys()) {
        scopes[at] = this.#device.popErrorScope();
        scopes[at].catch(() => {}); // where run() throws nobody waits for it
      }
    }
    const [words, ...errors] = await Promise.all([reading, ...scopes]);
    this.#check();
    const failed = errors.find((error) => error !== null);
    if (failed) {
      this.#forget(); // one of the buffers may be invalid
      const what = failed.message || failed.constructor.name;
      throw new ThrongError(`the GPU search failed: ${what}; search fewer boxes at once`, 'device_error', { cause: failed });
    }
    if (!(words instanceof Uint32Array)) throw words;
    return words;
  }

  findOnGpu(boxes, count, options) {
    const given = argument.object(options, ['capacity', 'stride', 'filters', 'pairs', 'counts', 'encoder', 'timestampWrites']);
    this.#check();
    if (this.#isBusy) {
      throw new ThrongError('this GpuFinder searches; await its find() first, or make another GpuFinder', 'busy');
    }
    whole(count, 'count', largestCount);
    this.#checkCount(count);
    if (given.pairs !== undefined) checkBuffer(given.pairs, 'pairs', 0);
    const fits = given.pairs === undefined ? 4 * count + firstCapacity : Math.floor(given.pairs.size / 8);
    const capacity = whole(given.capacity ?? Math.min(fits, this.maxPairs), 'capacity', this.maxPairs);
    const stride = given.stride ?? 24;
    if (stride !== 24 && stride !== 32) throw new RangeError(`stride: found ${described(stride)}, wanted 24 or 32 bytes`);
    checkBuffer(boxes, 'boxes', stride * count);
    if (given.filters !== undefined) checkBuffer(given.filters, 'filters', 8 * count);
    if (given.pairs !== undefined) checkBuffer(given.pairs, 'pairs', 8 * capacity);
    if (given.counts !== undefined) checkBuffer(given.counts, 'counts', bytesOfCounts);
    if (given.encoder !== undefined && typeof given.encoder.beginComputePass !== 'function') {
      throw new TypeError(`encoder: found ${described(given.encoder)}, wanted a GPUCommandEncoder, or none`);
    }
    if (given.timestampWrites !== undefined && typeof given.timestampWrites?.querySet !== 'object') {
      throw new TypeError(`timestampWrites: found ${described(given.timestampWrites)}, wanted a GPUComputePassTimestampWrites, or none`);
    }
    const pairs = given.pairs ?? this.#reserve('pairs', 8 * Math.max(capacity, 1));
    const counts = given.counts ?? this.#reserve('counts', bytesOfCounts);
    const encoder = given.encoder ?? this.#device.createCommandEncoder();
    this.#record(encoder, { boxes, pairs, counts, filters: given.filters }, count, stride, capacity, given.timestampWrites);
    if (given.encoder === undefined) this.#device.queue.submit([encoder.finish()]);
    return { pairs, counts, capacity };
  }

  free() {
    if (this.#isReleased) return;
    this.#isReleased = true;
    this.#forget();
    if (this.#ownsDevice) this.#device.destroy();
  }

  #forget() {
    for (const buffer of [...this.#buffers.values(), ...this.#parameters.values()]) buffer.destroy();
    this.#buffers.clear();
    this.#parameters.clear();
  }

  #frame(count) {
    if (this.#algorithm !== 'auto') return this.#algorithm;
    return count <= bruteForceLimit ? 'all-pairs' : 'grid';
  }

  /** Records all steps of a frame; returns their number. */
  #record(encoder, given, count, stride, capacity, timestampWrites) {
    const isSorted = this.#order === 'canonical';
    const frame = frames[this.#frame(count) + (isSorted ? ' sorted' : '')];
    const { workgroups, bytes } = sizesOf(count, capacity, isSorted);
    const bound = { ...given };
    // Of the caller's buffers no more is bound: they may be larger than a binding. Nothing is read or written of empty ones.
    const used = { boxes: stride * count, pairs: 8 * capacity, counts: bytesOfCounts };
    if (given.filters) used.filters = 8 * count;
    for (const [name, size] of Object.entries(used)) {
      if (size === 0) [bound[name], used[name]] = [this.#reserve(name, 32), 32];
    }
    if (!isSorted) [bound.found, used.found] = [bound.pairs, used.pairs];
    bound.parameters = this.#uniform([
      count, stride / 4, stride === 24 ? 3 : 4, capacity, tableCells(count), given.filters ? 1 : 0, isSorted ? 1 : 0, 0,
    ]);
    bytes.filters = 8; // unless given; then not read
    // All before any is bound: a buffer that grows is another one.
    for (const name of [...frame.clear, ...frame.steps.flatMap((step) => steps[step].buffers)]) {
      if (name !== null) bound[name] ??= this.#reserve(name, bytes[name]);
    }
    for (const name of frame.clear) encoder.clearBuffer(bound[name], 0, bytes[name]);
    const pass = encoder.beginComputePass({ label: 'throng', ...(timestampWrites && { timestampWrites }) });
    for (const name of frame.steps) {
      const pipeline = this.#pipelines[name];
      const entries = steps[name].buffers
        .map((buffer, binding) => ({ binding, resource: { buffer: bound[buffer], size: used[buffer] } }))
        .filter(({ binding }) => steps[name].buffers[binding] !== null);
      const groups = workgroups[steps[name].workgroups];
      if (groups === 0) continue;
      const width = Math.min(groups, maxWorkgroups);
      pass.setPipeline(pipeline);
      pass.setBindGroup(0, this.#device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries }));
      pass.dispatchWorkgroups(width, over(groups, width));
    }
    pass.end();
    return frame.steps.length;
  }

  /** Submits the encoder, and returns the first bytes of a buffer as words. */
  async #read(encoder, buffer, bytes) {
    const target = this.#device.createBuffer({ size: bytes, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
    encoder.copyBufferToBuffer(buffer, 0, target, 0, bytes);
    this.#device.queue.submit([encoder.finish()]);
    try {
      await target.mapAsync(GPUMapMode.READ);
      return new Uint32Array(target.getMappedRange().slice(0));
    } finally {
      target.destroy();
    }
  }

  /** A buffer with these parameters. Encoders that wait for submission have theirs. */
  #uniform(values) {
    const key = values.join();
    let buffer = this.#parameters.get(key);
    if (!buffer) {
      if (this.#parameters.size >= 64) this.#parameters.clear();
      buffer = this.#device.createBuffer({ size: 32, usage: GPUBufferUsage.UNIFORM, mappedAtCreation: true });
      new Uint32Array(buffer.getMappedRange()).set(values);
      buffer.unmap();
      this.#parameters.set(key, buffer);
    }
    return buffer;
  }

  /** A buffer of at least this size, with space for growth. */
  #reserve(name, size) {
    const kept = this.#buffers.get(name);
    if (kept && kept.size >= size) return kept;
    if (size > this.#maxBytes) {
      throw new ThrongError(
        `the buffer '${name}' needs ${size} bytes, the device allows ${this.#maxBytes} (limits maxStorageBufferBindingSize, ` +
          'maxBufferSize); search fewer boxes',
        'out_of_memory',
      );
    }
    const grown = Math.max(size + Math.floor(size / 4), 256);
    const usage = GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC | GPUBufferUsage.COPY_DST | GPUBufferUsage.INDIRECT;
    const buffer = this.#device.createBuffer({ label: name, size: Math.min(grown + 15 - ((grown + 15) % 16), this.#maxBytes), usage });
    this.#buffers.set(name, buffer);
    return buffer;
  }

  #check(cause) {
    if (this.#isReleased) throw new ThrongError('this GpuFinder was freed; create another', 'released', { cause });
    if (this.#lost !== undefined) {
      throw new ThrongError(
        `the GPU device of this GpuFinder is lost (${this.#lost}): create another GpuFinder, and upload the boxes again`,
        'device_error',
        { cause },
      );
    }
  }
  #checkCount(count) {
    if (count <= this.maxBoxes) return;
    const why =
      this.maxBoxes < Math.floor(this.#maxBytes / 32)
        ? `more are not possible with algorithm: '${this.#algorithm}'`
        : `the device binds at most ${this.#maxBytes} bytes (limits maxStorageBufferBindingSize, maxBufferSize)`;
    throw new ThrongError(`boxes: found ${count} boxes, wanted at most ${this.maxBoxes}: ${why}; split them`, 'too_many_boxes');
  }
  #refuse(words, count) {
    // Marks are the complement of an index, so that the first one is the greatest.
    const [nans, firstNan, invertedOnes, firstInverted] = [words[6], ~words[7] >>> 0, words[8], ~words[9] >>> 0];
    if (nans > 0 && this.#nan === 'refuse') {
      throw new ThrongError(
        `boxes: ${nans} of ${count} boxes have a NaN, the first is box ${firstNan}; fix them, or pass nan: 'inactive'`,
        'nan_box',
        { firstInvalid: firstNan, invalidCount: nans },
      );
    }
    if (invertedOnes > 0 && this.#inverted === 'refuse') {
      throw new ThrongError(
        `boxes: ${invertedOnes} of ${count} boxes have lower > upper, the first is box ${firstInverted}; fix them, or for empty ` +
          "slots pass inverted: 'inactive'",
        'inverted_box',
        { firstInvalid: firstInverted, invalidCount: invertedOnes },
      );
    }
  }
}
if (Symbol.dispose) GpuFinder.prototype[Symbol.dispose] = GpuFinder.prototype.free;

function checkBuffer(buffer, name, size) {
  if (typeof buffer?.mapAsync !== 'function') throw new TypeError(`${name}: found ${described(buffer)}, wanted a GPUBuffer`);
  if (buffer.size < size) throw new RangeError(`${name}: found a buffer of ${buffer.size} bytes, wanted at least ${size}`);
  if (!(buffer.usage & GPUBufferUsage.STORAGE)) {
    throw new RangeError(`${name}: found a buffer without the usage STORAGE; create it with GPUBufferUsage.STORAGE`);
  }
}

const floatsOf = ({ buffer, byteOffset, length }) => new Float32Array(buffer, byteOffset, length);

/** Six numbers per box. */
function packed(set) {
  if (set.packed) return floatsOf(set.packed);
  const [lower, upper] = [floatsOf(set.lower), floatsOf(set.upper)];
  const all = new Float32Array(6 * set.count);
  for (let i = 0; i < set.count; ++i) {
    all.set(lower.subarray(3 * i, 3 * i + 3), 6 * i);
    all.set(upper.subarray(3 * i, 3 * i + 3), 6 * i + 3);
  }
  return all;
}

/** Group and mask of each box. */
function packedFilters({ group, mask }, count) {
  const all = new Uint32Array(2 * count).fill(0xffffffff);
  for (const [at, one] of [group, mask].entries()) {
    if (one === undefined) continue;
    const values = one.buffer && new Uint32Array(one.buffer, one.byteOffset, one.length);
    for (let i = 0; i < count; ++i) all[2 * i + at] = values ? values[i] : one.one;
  }
  return all;
}
