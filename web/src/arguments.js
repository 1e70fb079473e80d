// Checks of arguments. Each is checked before anything is copied, as a copy can make the memory grow, and views into
// it then lose their contents. What passes is {array, length, inside}: `inside` is the address of an array that lies in
// the memory of the module and is read in place.
import { ThrongError, described } from './errors.js';

const most = 0xffffffff;

/** Whether the buffer of a view was transferred, or replaced when the memory grew. */
function isDetached(array) {
  if (array.buffer.detached !== undefined) return array.buffer.detached;
  if (array.buffer.byteLength !== 0) return false;
  try {
    new Uint8Array(array.buffer);
    return false;
  } catch {
    return true;
  }
}

/** Whether a value is a typed array of this kind, also of another realm, such as that of a frame. */
const isArrayOf = (value, kind) => ArrayBuffer.isView(value) && value[Symbol.toStringTag] === kind;

/** A typed array as an argument. */
function checked(instance, array, name) {
  if (isDetached(array)) {
    throw new TypeError(
      `${name}: its buffer is detached; if it is memory of allocateBoxes(), take its .values again after each call, ` +
        'else pass an array that was not transferred',
    );
  }
  return {
    buffer: array.buffer,
    byteOffset: array.byteOffset,
    byteLength: array.byteLength,
    length: array.length,
    inside: array.buffer === instance.memory.buffer ? array.byteOffset : undefined,
  };
}

function refuse(name, value, wanted) {
  throw new TypeError(`${name}: found ${described(value)}, wanted ${wanted}`);
}

/** A Float32Array. */
export function floats(instance, value, name, wanted = 'a Float32Array') {
  if (isArrayOf(value, 'Float64Array')) {
    refuse(name, value, `${wanted}; convert it with Float32Array.from, which rounds: give lower corners less and upper more`);
  }
  if (Array.isArray(value)) refuse(name, value, `${wanted}; convert numbers with new Float32Array(${name})`);
  if (!isArrayOf(value, 'Float32Array')) refuse(name, value, wanted);
  return checked(instance, value, name);
}

function countOf(array, each, name, what) {
  const count = array.length / each;
  if (Number.isInteger(count)) return count;
  throw new RangeError(`${name}: found ${array.length} numbers, wanted ${each} per ${what}; the length must be a multiple of ${each}`);
}

/** Memory for boxes that the caller fills in place: see load().allocateBoxes. */
export class BoxMemory {
  #instance;
  #at;
  #length;
  #dimensions;

  constructor(instance, at, count, dimensions) {
    this.#instance = instance;
    this.#at = at;
    this.#length = 2 * dimensions * count;
    this.#dimensions = dimensions;
  }
  static alive(memory) {
    if (memory.#at === 0) throw new ThrongError('boxes: this memory was freed; allocate other', 'released');
    return memory.#at;
  }
  /** {count, packed} */
  static of(memory, instance, name, dimensions) {
    const at = BoxMemory.alive(memory);
    if (memory.#dimensions !== dimensions) {
      throw new RangeError(
        `${name}: found memory for boxes of ${memory.#dimensions} dimensions, wanted ${dimensions}; allocate it with ` +
          `allocateBoxes(count, { dimensions: ${dimensions} })`,
      );
    }
    if (memory.#instance !== instance) {
      throw new TypeError(`${name}: found memory of another load(); allocate it with the same one`);
    }
    return { count: memory.#length / (2 * dimensions), packed: { inside: at, length: memory.#length } };
  }
  /** A Float32Array; take it again after each call, as memory that grows gives it another buffer. */
  get values() {
    return this.#instance.f32(BoxMemory.alive(this), this.#length);
  }
  free() {
    if (this.#at === 0) return;
    this.#instance.release(this.#at);
    this.#at = 0;
  }
}
if (Symbol.dispose) BoxMemory.prototype[Symbol.dispose] = BoxMemory.prototype.free;

const boxesWanted = (dimensions) =>
  `a Float32Array with ${2 * dimensions} numbers per box (all lower, then all upper coordinates), ` +
  '{ lower, upper }, or what allocateBoxes() returned';

/** Boxes: {count, packed} or {count, lower, upper}. */
export function boxes(instance, value, name, dimensions) {
  const wanted = boxesWanted(dimensions);
  if (value instanceof BoxMemory) return BoxMemory.of(value, instance, name, dimensions);
  const isSplit = value !== null && typeof value === 'object' && !ArrayBuffer.isView(value) && ('lower' in value || 'upper' in value);
  if (!isSplit) {
    const packed = floats(instance, value, name, wanted);
    return { count: countOf(packed, 2 * dimensions, name, 'box'), packed };
  }
  const corner = `a Float32Array with ${dimensions} numbers per box`;
  const lower = floats(instance, value.lower, `${name}.lower`, corner);
  const upper = floats(instance, value.upper, `${name}.upper`, corner);
  if (lower.length !== upper.length) {
    throw new RangeError(`${name}: found ${lower.length} numbers in lower and ${upper.length} in upper, wanted as many`);
  }
  return { count: countOf(lower, dimensions, `${name}.lower`, 'box'), lower, upper };
}

export const filterNames = ['group', 'mask', 'owner', 'world', 'static'];
const filterTypes = {
  group: { types: [Uint32Array], least: 0, most },
  mask: { types: [Uint32Array], least: 0, most },
  owner: { types: [Int32Array], least: -1, most: 0x7fffffff },
  world: { types: [Int32Array], least: -1, most: 0x7fffffff },
  static: { types: [Uint8Array, Uint8ClampedArray], least: 0, most: 255 },
};

function filter(instance, value, which, name, count) {
  const { types, least, most: largest } = filterTypes[which];
  if (which === 'static' && typeof value === 'boolean') value = value ? 1 : 0;
  if (typeof value === 'number') {
    if (Number.isInteger(value) && value >= least && value <= largest) return { one: value, type: types[0], count };
    throw new RangeError(`${name}: found ${value}, wanted an integer from ${least} to ${largest}`);
  }
  if (!types.some((type) => isArrayOf(value, type.name))) {
    refuse(name, value, `a ${types.map((type) => type.name).join(' or ')} with one value per box, or one integer for all`);
  }
  const array = checked(instance, value, name);
  if (array.length !== count) {
    throw new RangeError(`${name}: found ${array.length} values, wanted ${count}, one per box, or one integer for all`);
  }
  return array;
}

/** Filters from options; `prefix`: 'other' for those of the second set. */
export function filters(instance, options, count, prefix = '') {
  const found = {};
  for (const which of filterNames) {
    const name = prefix ? prefix + which[0].toUpperCase() + which.slice(1) : which;
    if (options[name] === undefined) continue;
    found[which] = filter(instance, options[name], which, name, count);
  }
  return found;
}

/** One id. */
export function id(value, name = 'id') {
  if (typeof value !== 'number') refuse(name, value, 'an id that add() returned');
  if (Number.isInteger(value) && value >= 0 && value <= most) return value;
  throw new RangeError(`${name}: found ${value}, wanted an id that add() returned`);
}

/** Ids: a Uint32Array, an array of integers, or one integer. */
export function ids(instance, value) {
  if (typeof value === 'number') return checked(instance, Uint32Array.of(id(value, 'ids')), 'ids');
  if (Array.isArray(value)) {
    return checked(instance, Uint32Array.from(value, (one, at) => id(one, `ids[${at}]`)), 'ids');
  }
  if (!isArrayOf(value, 'Uint32Array')) refuse('ids', value, 'a Uint32Array, an array of ids, or one id');
  return checked(instance, value, 'ids');
}

export function oneEach(found, wanted, name) {
  if (found === wanted) return;
  throw new RangeError(`${name}: found ${found}, wanted ${wanted}, one for each id`);
}

/** Two or three numbers, as three. */
export function vector(value, name, dimensions) {
  const isList = Array.isArray(value) || (ArrayBuffer.isView(value) && !(value instanceof DataView));
  if (!isList) refuse(name, value, `${dimensions} numbers`);
  if (value.length !== dimensions) {
    throw new RangeError(`${name}: found ${value.length} numbers, wanted ${dimensions}`);
  }
  const numbers = Array.from(value, (one, at) => number(one, `${name}[${at}]`));
  return dimensions === 2 ? [...numbers, 0] : numbers;
}

export function number(value, name) {
  if (typeof value !== 'number') refuse(name, value, 'a number');
  return value;
}

export function integer(value, name, least, largest) {
  number(value, name);
  if (Number.isInteger(value) && value >= least && value <= largest) return value;
  throw new RangeError(`${name}: found ${value}, wanted an integer from ${least} to ${largest}`);
}

/** The position of a word in a list. */
export function choice(value, name, list) {
  const at = list.indexOf(value);
  if (at >= 0) return at;
  const allowed = list.filter((word) => word !== null).map((word) => `'${word}'`);
  throw (typeof value === 'string' ? RangeError : TypeError)(`${name}: found ${described(value)}, wanted ${allowed.join(', ')}`);
}

/** Options are an object without misspelled names. */
export function object(value, allowed) {
  if (value === undefined) return {};
  if (value === null || typeof value !== 'object' || Array.isArray(value) || ArrayBuffer.isView(value)) {
    refuse('options', value, 'an object');
  }
  for (const name of Object.keys(value)) {
    if (!allowed.includes(name)) throw new TypeError(`options: found '${name}', wanted ${allowed.join(', ')}`);
  }
  return value;
}
