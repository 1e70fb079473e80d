// Every pair of overlapping boxes among very many moving objects.
//
// A box is closed: two boxes overlap when on every axis a.lower <= b.upper and b.lower <= a.upper, so touching counts.
// Coordinates are float32, in world units; infinite ones are allowed. The pairs are those of a double loop.
//
// Views: an array that a call returns "in place" lies in the memory of the module. It is valid until the next call of
// this load(); .slice() keeps it.

/**
 * Boxes: all lower, then all upper coordinates of each, in one array; two arrays of corners; or memory of
 * allocateBoxes(). With dimensions 3, six numbers per box: lower x, y, z, upper x, y, z.
 */
export type Boxes = Float32Array | { readonly lower: Float32Array; readonly upper: Float32Array } | BoxMemory;

/** One value per box, or one integer for all. A pair is reported if all given filters allow it; those that are absent do. */
export interface Filters {
  /** (group a & mask b) and (group b & mask a) must both be nonzero; one that is absent counts as all ones. */
  group?: Uint32Array | number;
  mask?: Uint32Array | number;
  /** Equal owners never pair; -1: no owner. */
  owner?: Int32Array | number;
  /** Different worlds never pair; -1: in every world. */
  world?: Int32Array | number;
  /** Two nonzero ones never pair. */
  static?: Uint8Array | Uint8ClampedArray | number | boolean;
}

/** A second set, and its filters: each pair is then a box of the first set and one of `other`. */
export interface Other {
  other?: Boxes;
  otherGroup?: Filters['group'];
  otherMask?: Filters['mask'];
  otherOwner?: Filters['owner'];
  otherWorld?: Filters['world'];
  otherStatic?: Filters['static'];
}

export type SearchOptions = Filters & Other;

export interface Options {
  /**
   * Boxes are compared as lower - margin and upper + margin, rounded outward, so that boxes up to 2 * margin apart are pairs.
   * In world units, 0 or more. Overlap queries, shape casts and ray casts ignore it. Default: 0.
   */
  margin?: number;
  /** A box with a NaN is an error, or inactive: it overlaps nothing. Default: 'refuse'. */
  nan?: 'refuse' | 'inactive';
  /**
   * A box with lower > upper on some axis is an error, or an empty slot that overlaps nothing. Default: 'refuse' for
   * findPairs, 'inactive' for Finder and BroadPhase.
   */
  inverted?: 'refuse' | 'inactive';
  /** The kernels: 128-bit SIMD, or none. The pairs are the same. Default: 'auto'. */
  isa?: 'auto' | 'wasm' | 'scalar';
  /** 2: boxes have x and y only. Default: 3. */
  dimensions?: 2 | 3;
}

export interface FinderOptions extends Options {
  /** 'canonical': sorted by first, then second. Default: 'any', the fastest. */
  order?: 'any' | 'canonical';
  /** The pairs are the same for each. Default: 'auto'. */
  algorithm?: 'auto' | 'all-pairs' | 'grid';
}

/** About the last call. */
export interface Result {
  /** The number of pairs; of objects after a call that adds, moves or removes them. */
  readonly found: number;
  readonly written: number;
  /** Boxes that overlap nothing, since lower > upper or by nan: 'inactive'. */
  readonly inactive: number;
  /** Tests of two boxes. */
  readonly comparisons: number;
  readonly totalMs: number;
  /** Why the pairs were found in this way. */
  readonly plan: string;
  /** 'auto': before the first search or update. */
  readonly algorithm: 'auto' | 'all-pairs' | 'grid';
  readonly isa: 'auto' | 'wasm' | 'scalar';
}

/** Memory for boxes, filled in place: a search that takes it copies nothing. */
export interface BoxMemory {
  /**
   * Its numbers. Take it again after each call: when the memory of the module grows, earlier arrays lose their
   * contents, and their length is 0.
   */
  readonly values: Float32Array;
  free(): void;
}

/** Finds pairs repeatedly and keeps its memory: later calls are faster than findPairs. */
export interface Finder {
  /**
   * All pairs of overlapping boxes, in place: first 0, second 0, first 1, second 1, ... With one set first < second,
   * and each pair once; with two sets each number is an index into its own.
   */
  find(boxes: Boxes, options?: SearchOptions): Uint32Array;
  readonly result: Result;
  readonly memoryBytes: number;
  /**
   * Gives the memory back. An object that nobody uses any more is freed some time later anyway; do not make one per frame.
   */
  free(): void;
}

/** The filter values of one object. */
export interface Filter {
  group: number;
  mask: number;
  owner: number;
  world: number;
  static: boolean;
}

export interface RayHit {
  /** The id of the object. */
  object: number;
  /** In world units; 0 if the ray starts in the box. */
  distance: number;
  /** A point of its box. */
  point: number[];
  /** Of the face that the ray enters, of length 1; the opposite of the direction if the ray starts in the box. */
  normal: number[];
}

export type Ids = Uint32Array | readonly number[] | number;

/**
 * Keeps objects from frame to frame, and reports which pairs began and which ended. A call that throws changes nothing,
 * unless the memory ended.
 */
export interface BroadPhase {
  /** Adds an object for each box. Returns their ids: 0, 1, 2, ... if none was removed. */
  add(boxes: Boxes, filters?: Filters): Uint32Array;
  /** The id of a removed object is reused only after an update. */
  remove(ids: Ids): void;
  /** Gives objects new boxes, one per id; of several calls before an update the last one counts. */
  move(ids: Ids, boxes: Boxes): void;
  /** The same for all objects: the box of each id below idLimit; those that did not change are skipped. */
  moveAll(boxes: Boxes): void;
  /** Filters that are not given stay as they are. */
  setFilters(ids: Ids, filters: Filters): void;
  /** Adds x, y, z (x, y in 2-D) to all corners, rounded to the nearest float32. */
  shiftOrigin(by: ArrayLike<number>): void;

  /** Finds the pairs that began and ended since the last update. */
  update(): void;
  /**
   * In place, sorted, three numbers per pair: the ids first < second, and the pair's slot: a small number that stays
   * the same while the pair exists, an index for data of the pair.
   */
  readonly begun: Uint32Array;
  readonly ended: Uint32Array;
  /** All pairs as of the last update. */
  readonly pairs: Uint32Array;
  /** The pairs of one object, as an array of its own. */
  pairsOf(id: number): Uint32Array;

  /** In place, sorted, two numbers per overlap: the index of a box, and the id of an object that it overlaps. */
  findOverlaps(boxes: Boxes, filters?: Filters): Uint32Array;
  /**
   * Shape casts: the objects that boxes hit when they move by `by` (three numbers per box, two in 2-D) from time 0 to
   * 1. `which`: all objects on the way, or the first. Pairs are the index of a box and the id of an object, sorted;
   * a time is that of first contact, 0 if they overlap at the start. Both are arrays of their own. Default: 'all'. Queries see
   * the boxes as last given, also before update().
   */
  findHits(
    boxes: Boxes,
    by: Float32Array,
    options?: Filters & { which?: 'all' | 'first' },
  ): { pairs: Uint32Array; times: Float64Array };
  /**
   * The closest object that a ray hits within maxDistance (default: Infinity), or null. layerMask: only objects whose group has
   * one of these bits (default: all). An object whose mask is 0 is found by no query. world: only objects of this world, and
   * those of every world (default: objects of all worlds). A ray that starts in a box hits it: to leave out its caster, start
   * outside of it, or give the caster a layer of its own.
   */
  raycast(
    origin: ArrayLike<number>,
    direction: ArrayLike<number>,
    options?: { maxDistance?: number; layerMask?: number; world?: number },
  ): RayHit | null;

  isAlive(id: number): boolean;
  /** The current box of an object. */
  box(id: number): Float32Array;
  filter(id: number): Filter;
  readonly objectCount: number;
  readonly pairCount: number;
  /** All ids are below idLimit, all slots below slotLimit. */
  readonly idLimit: number;
  readonly slotLimit: number;
  readonly memoryBytes: number;
  readonly result: Result;
  /** A snapshot with the same ids, slots and events. */
  copy(): BroadPhase;
  free(): void;
}

export interface Throng {
  readonly version: string;
  readonly Finder: new (options?: FinderOptions) => Finder;
  readonly BroadPhase: new (options?: Options) => BroadPhase;
  /** As Finder.find, for one search; returns an array of its own. */
  findPairs(boxes: Boxes, options?: FinderOptions & SearchOptions): Uint32Array;
  /** Memory for `count` boxes, all zeros. A search of other dimensions refuses it. */
  allocateBoxes(count: number, options?: { dimensions?: 2 | 3 }): BoxMemory;
  /** The size of the module's memory, at most 4 GiB; it never shrinks. */
  readonly memoryBytes: number;
}

/** The type of a global name, as lib.dom or @types/node declare it; without them any object. */
type Global<Name extends string> = typeof globalThis extends { [name in Name]: { prototype: infer Type } } ? Type : object;
type WasmModule = typeof globalThis extends { WebAssembly: { Module: { prototype: infer Type } } } ? Type : object;

/**
 * Loads the WebAssembly module, by default the throng.wasm beside this file. An address that is relative counts from the page, in
 * Node from the working folder. Each call makes an instance with memory of
 * its own. Running out of that memory ends the instance: each later call throws, and load() makes another.
 */
export function load(options?: {
  module?: string | Global<'URL'> | Global<'Response'> | ArrayBuffer | ArrayBufferView | WasmModule;
}): Promise<Throng>;

/**
 * What the library reports. Wrong arguments are a TypeError or a RangeError otherwise. Every message names the argument,
 * the value found, and the remedy.
 */
export class ThrongError extends Error {
  constructor(message: string, code: string, details?: object);
  /** Such as 'nan_box', 'inverted_box', 'bad_id', 'out_of_memory', 'released'. */
  readonly code: string;
  /** The index of the first invalid box, sweep or id, and how many there are. */
  readonly firstInvalid?: number;
  readonly invalidCount?: number;
  /** What could not be allocated. */
  readonly bytesNeeded?: number;
}
