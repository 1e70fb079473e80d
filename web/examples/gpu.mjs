// Pairs on the GPU of the browser: arrays in and out, then buffers that stay on the GPU.
import { GpuFinder } from 'throng-collision/webgpu';

/** The number of pairs, and what the GPU counted. */
export async function search(boxes) {
  // snippet-begin: arrays
  const finder = await GpuFinder.create(); // compiles the shaders; throws where there is no WebGPU
  const pairs = await finder.find(boxes); // Float32Array in, Uint32Array out
  console.log(`${pairs.length / 2} pairs, ${finder.result.comparisons} comparisons`);
  // snippet-end: arrays

  // snippet-begin: buffers
  const { device } = finder;
  const onGpu = device.createBuffer({ size: boxes.byteLength, usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST });
  device.queue.writeBuffer(onGpu, 0, boxes);
  const encoder = device.createCommandEncoder();
  const found = finder.findOnGpu(onGpu, boxes.length / 6, { capacity: 20000, encoder });
  // Passes that read found.pairs and found.counts follow here, in the same encoder.
  device.queue.submit([encoder.finish()]);
  // snippet-end: buffers

  const read = device.createBuffer({ size: 32, usage: GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST });
  const copy = device.createCommandEncoder();
  copy.copyBufferToBuffer(found.counts, 0, read, 0, 32);
  device.queue.submit([copy.finish()]);
  await read.mapAsync(GPUMapMode.READ);
  const counts = new Uint32Array(read.getMappedRange().slice(0));
  finder.free();
  return [pairs.length / 2, counts[0]];
}
