// Compiled by tsc, never run: the types accept what the documentation says, and refuse what it does not.
import { load, ThrongError, type Boxes, type Throng } from '../web/index.js';
import { GpuFinder, requestDevice, type GpuPairs } from '../web/webgpu.js';

// As @webgpu/types declares them.
declare global {
  interface GPUBuffer {
    readonly size: number;
  }
  var GPUBuffer: { prototype: GPUBuffer };
  interface GPUDevice {
    createBuffer(descriptor: object): GPUBuffer;
  }
  var GPUDevice: { prototype: GPUDevice };
}

export async function uses(): Promise<void> {
  const throng: Throng = await load({ module: new URL('https://example.com/throng.wasm') });
  const packed = new Float32Array(12);
  const split: Boxes = { lower: new Float32Array(6), upper: new Float32Array(6) };
  const pairs: Uint32Array = throng.findPairs(packed, { margin: 0.1, order: 'canonical', group: 1, other: split });
  const finder = new throng.Finder({ algorithm: 'grid' });
  const memory = throng.allocateBoxes(2);
  memory.values[0] = 1;
  finder.find(memory, { static: new Uint8Array(2) });
  const objects = new throng.BroadPhase({ dimensions: 2, nan: 'inactive' });
  objects.move(objects.add(packed), packed);
  objects.remove([0, 1]);
  const hit = objects.raycast([0, 0, 0], new Float32Array(3), { maxDistance: 5 });
  const distance: number = hit === null ? Infinity : hit.distance;
  const times: Float64Array = objects.findHits(packed, new Float32Array(6), { which: 'first' }).times;
  const error: number | undefined = new ThrongError('', '').firstInvalid;
  console.log(pairs, distance, times, error);

  // @ts-expect-error: float64 is refused
  throng.findPairs(new Float64Array(6));
  // @ts-expect-error: a word that does not exist
  throng.findPairs(packed, { order: 'sorted' });
  // @ts-expect-error: a misspelled option
  throng.findPairs(packed, { margni: 1 });
  // @ts-expect-error: a Finder takes the order once, when it is made
  finder.find(packed, { order: 'any' });
  // @ts-expect-error: no such property of a hit that may be null
  objects.raycast([0, 0, 0], [1, 0, 0]).distance;
}

export async function usesGpu(): Promise<void> {
  const finder = await GpuFinder.create({ order: 'canonical', device: await requestDevice(['timestamp-query']) });
  const pairs: Uint32Array = await finder.find(new Float32Array(12), { group: 1, mask: new Uint32Array(2) });
  const onGpu: GpuPairs = finder.findOnGpu(finder.device.createBuffer({}), 2, { stride: 32, capacity: pairs.length });
  const ofPairs: GPUBuffer = onGpu.pairs;
  console.log(ofPairs.size, onGpu.capacity, finder.result.comparisons);
  finder.free();

  // @ts-expect-error: boxes are in a GPUBuffer
  finder.findOnGpu(new Float32Array(6), 1);
  // @ts-expect-error: made by create()
  new GpuFinder();
  // @ts-expect-error: the GPU search has no owners
  await finder.find(new Float32Array(12), { owner: 1 });
}
