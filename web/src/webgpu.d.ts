// The search on a GPU, by WebGPU. The pairs are those of load() and its Finder on every device, as the shaders decide by
// integers alone.

/** The type of a global name, as lib.dom or @webgpu/types declare it; without them any object. */
type Global<Name extends string> = typeof globalThis extends { [name in Name]: { prototype: infer Type } } ? Type : object;
type Device = Global<'GPUDevice'>;
type Buffer = Global<'GPUBuffer'>;
type Encoder = Global<'GPUCommandEncoder'>;

export { ThrongError } from './index.js';

/**
 * A GPUDevice of the fastest adapter, with the adapter's limits for buffers, and with those of the features that it has, such
 * as 'timestamp-query'. Rejects with a ThrongError of code 'no_device' where there is none.
 */
export function requestDevice(features?: Iterable<string>): Promise<Device>;

export interface GpuFinderOptions {
  /** A GPUDevice. Default: that of requestDevice(). */
  device?: Device;
  /** The pairs are the same for each. Default: 'auto', which is 'all-pairs' up to 2,048 boxes. */
  algorithm?: 'auto' | 'all-pairs' | 'grid';
  /** 'canonical': sorted by first, then second. Default: 'any', the fastest. */
  order?: 'any' | 'canonical';
  /** find: a box with a NaN is an error, or inactive: it overlaps nothing. Default: 'refuse'. */
  nan?: 'refuse' | 'inactive';
  /** find: a box with lower > upper on some axis is an error, or an empty slot. Default: 'inactive'. */
  inverted?: 'refuse' | 'inactive';
}

/** About the last find(). */
export interface GpuResult {
  readonly found: number;
  readonly written: number;
  /** Boxes that overlap nothing: lower > upper on some axis, or a NaN. */
  readonly inactive: number;
  readonly nanCount: number;
  /** Tests of two boxes. */
  readonly comparisons: number;
  /** Steps that ran on the GPU. */
  readonly dispatches: number;
  readonly algorithm: 'all-pairs' | 'grid';
}

/** Pairs in the memory of the GPU; those of the finder's own buffers are overwritten by its next search. */
export interface GpuPairs {
  /** A GPUBuffer of first 0, second 0, first 1, second 1, ..., as u32. */
  readonly pairs: Buffer;
  /**
   * A GPUBuffer of eight u32: the pairs in the buffer; all pairs found, low and high word; boxes with a NaN; at byte 16
   * the arguments x, y, z of an indirect dispatch of workgroups of 64 threads, one thread per pair; inactive boxes.
   */
  readonly counts: Buffer;
  /** Pairs that fit the buffer. */
  readonly capacity: number;
}

export interface FindOnGpuOptions {
  /**
   * Pairs that fit. If more are found, the first `capacity` are there in no order; in canonical order none is. Default: those
   * that fit `pairs`, or 4 per box and 4,096 more.
   */
  capacity?: number;
  /** Bytes from one box to the next: 24, or 32 for a WGSL struct of two vec3f. Default: 24. */
  stride?: 24 | 32;
  /** A GPUBuffer of two u32 per box: group, mask. This and the next two need the usage GPUBufferUsage.STORAGE. */
  filters?: Buffer;
  /** A GPUBuffer for the pairs, 8 bytes each. Default: one of the finder. */
  pairs?: Buffer;
  /** A GPUBuffer of 32 bytes for the counts. Default: one of the finder. */
  counts?: Buffer;
  /** A GPUCommandEncoder to which the search is added. Default: the search is submitted. */
  encoder?: Encoder;
  /** A GPUComputePassTimestampWrites for the search; the device needs the feature timestamp-query. */
  timestampWrites?: object;
}

/** Finds pairs on a GPU repeatedly, and keeps its memory. */
export class GpuFinder {
  private constructor();
  /**
   * Compiles the shaders. Rejects with a ThrongError of code 'no_device' where there is no WebGPU or no adapter.
   */
  static create(options?: GpuFinderOptions): Promise<GpuFinder>;
  /**
   * All pairs of overlapping boxes, as an array of its own: first 0, second 0, first 1, second 1, ... with first <
   * second, each pair once. Boxes have six numbers: lower x, y, z, upper x, y, z. A pair needs (group a & mask b) and
   * (group b & mask a) nonzero; one that is absent counts as all ones. One call at a time.
   */
  find(
    boxes: Float32Array | { readonly lower: Float32Array; readonly upper: Float32Array },
    options?: { group?: Uint32Array | number; mask?: Uint32Array | number },
  ): Promise<Uint32Array>;
  /**
   * The pairs of `count` boxes that are in a GPUBuffer of the finder's device, with the usage STORAGE. Nothing is read back. A NaN is no error: its box is inactive, and
   * `counts` has the number.
   */
  findOnGpu(boxes: Buffer, count: number, options?: FindOnGpuOptions): GpuPairs;
  /** The GPUDevice. */
  readonly device: Device;
  readonly result: GpuResult;
  /** The most boxes, and pairs in one buffer, that the device's limits allow. */
  readonly maxBoxes: number;
  readonly maxPairs: number;
  readonly memoryBytes: number;
  /** Destroys the finder's buffers, and the device if create() made it. */
  free(): void;
}
