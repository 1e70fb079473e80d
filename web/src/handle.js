// What Finder and BroadPhase have in common: options, memory that is freed, and boxes as a struct.
import * as layout from './layout.js';
import * as argument from './arguments.js';
import { ThrongError, described } from './errors.js';

export const optionNames = ['margin', 'nan', 'inverted', 'isa', 'dimensions'];
const nan = ['refuse', 'inactive'];
const inverted = [null, 'refuse', 'inactive'];
const isa = ['auto', 'scalar', null, null, null, null, 'wasm'];
const order = ['any', 'canonical'];
const algorithm = ['auto', 'all-pairs', 'grid'];

/** Writes a throng_options and returns its address. */
function writeOptions(instance, given, defaultInverted) {
  const chosen = {
    nan: argument.choice(given.nan ?? 'refuse', 'nan', nan),
    inverted: argument.choice(given.inverted ?? defaultInverted, 'inverted', inverted),
    isa: argument.choice(given.isa ?? 'auto', 'isa', isa),
    order: argument.choice(given.order ?? 'any', 'order', order),
    algorithm: argument.choice(given.algorithm ?? 'auto', 'algorithm', algorithm),
  };
  const margin = argument.number(given.margin ?? 0, 'margin');
  if (!(margin >= 0 && margin <= 3.4028234663852886e38)) {
    throw new RangeError(`margin: found ${margin}, wanted a finite number of 0 or more`);
  }
  const at = instance.scratch('options', layout.options.bytes);
  instance.call('throng_options_init_sized', at, layout.options.bytes);
  const { data } = instance;
  for (const [name, value] of Object.entries(chosen)) data.setInt32(at + layout.options[name], value, true);
  // A margin that is not a float32 is rounded up.
  let rounded = Math.fround(margin);
  if (rounded < margin) {
    const bits = new Uint32Array(1);
    const float = new Float32Array(bits.buffer);
    float[0] = rounded;
    bits[0] += 1;
    [rounded] = float;
  }
  data.setFloat32(at + layout.options.margin, rounded, true);
  return at;
}

// Objects that nobody uses any more are freed some time later.
const registry = new FinalizationRegistry((free) => free());
// An array in the memory of an object keeps it alive.
const owners = new WeakMap();

export class Handle {
  #kind;
  #free;
  #state;
  #instance;
  #dimensions;

  /** `prefix` of the C functions: throng_finder or throng_broad_phase. */
  constructor(kind, prefix, instance, options, defaultInverted) {
    this.#kind = kind;
    this.#instance = instance;
    this.#dimensions = options.dimensions ?? 3;
    if (this.#dimensions !== 2 && this.#dimensions !== 3) {
      throw new RangeError(`dimensions: found ${described(this.#dimensions)}, wanted 2 or 3`);
    }
    const at = instance.call(`${prefix}_create`, writeOptions(instance, options, defaultInverted));
    if (at === 0) throw new ThrongError(`out of memory: there is none for a ${kind}`, 'out_of_memory');
    // Must not refer to this object, which then would never be collected.
    const state = { at, more: new Map() };
    this.#state = state;
    this.#free = () => {
      if (state.at === 0 || instance.hasEnded) return;
      for (const [name, memory] of state.more) {
        if (name === 'query') instance.call('throng_query_destroy', memory);
        else instance.release(memory);
      }
      instance.call(`${prefix}_destroy`, state.at);
      state.at = 0;
    };
    registry.register(this, this.#free, this);
  }

  get instance() {
    return this.#instance;
  }
  get dimensions() {
    return this.#dimensions;
  }
  /** The address of the C handle. */
  get at() {
    if (this.#state.at !== 0) return this.#state.at;
    throw new ThrongError(`this ${this.#kind} was freed; make another`, 'released');
  }
  /** Addresses that free() frees, too, by name. */
  get more() {
    return this.#state.more;
  }
  /** An array in this object's memory. */
  view(first, count) {
    const array = this.#instance.u32(first, count);
    owners.set(array, this);
    return array;
  }
  free() {
    registry.unregister(this);
    this.#free();
  }
}

/** A throng_boxes in memory: the boxes, or none, and the filters that were checked. */
export function writeBoxes(instance, name, boxes, filters, dimensions) {
  const addresses = {};
  for (const part of ['packed', 'lower', 'upper']) {
    if (boxes[part]) addresses[part] = instance.address(`${name}.${part}`, boxes[part]);
  }
  const given = {};
  for (const [which, filter] of Object.entries(filters)) {
    const place = `${name}.${which}`;
    if (filter.type) {
      const bytes = filter.count * filter.type.BYTES_PER_ELEMENT;
      given[which] = instance.scratch(place, bytes);
      new filter.type(instance.memory.buffer, given[which], filter.count).fill(filter.one);
    } else {
      given[which] = instance.address(place, filter);
    }
  }
  const at = instance.scratch(name, layout.boxes.bytes);
  const { data } = instance;
  instance.bytes.fill(0, at, at + layout.boxes.bytes);
  data.setUint32(at + layout.boxes.count, boxes.count, true);
  const corner = (axis, upper, address) =>
    data.setUint32(at + layout.boxes.corner + 4 * (axis + (upper ? 3 : 0)), address + 4 * axis, true);
  for (let axis = 0; axis < dimensions; ++axis) {
    if (addresses.packed !== undefined) {
      corner(axis, false, addresses.packed);
      corner(axis, true, addresses.packed + 4 * dimensions);
    } else if (addresses.lower !== undefined) {
      corner(axis, false, addresses.lower);
      corner(axis, true, addresses.upper);
    }
  }
  const stride = 4 * dimensions * (addresses.packed === undefined ? 1 : 2);
  data.setUint32(at + layout.boxes.stride, stride, true);
  for (const [which, address] of Object.entries(given)) data.setUint32(at + layout.boxes[which], address, true);
  return at;
}

/** The fields of a result that callers see. */
export function publicResult(instance, at) {
  const result = instance.result(at);
  return {
    found: result.found,
    written: result.written,
    inactive: result.inactive,
    comparisons: result.comparisons,
    totalMs: result.totalMs,
    plan: result.plan,
    algorithm: algorithm[result.algorithm],
    isa: isa[result.isa],
  };
}
