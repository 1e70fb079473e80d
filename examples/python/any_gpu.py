"""Pairs on any GPU through wgpu, and a pass of the caller that reads them there."""

# snippet-begin: numpy
import numpy
import throng.webgpu

finder = throng.webgpu.GpuFinder()
lower = numpy.random.default_rng(1).random((10_000, 3), dtype=numpy.float32)
pairs = finder.find((lower, lower + numpy.float32(0.03)))  # (m, 2) uint32, on the host
print(len(pairs), "pairs,", finder.result.comparisons, "comparisons")
# snippet-end: numpy
assert len(pairs) == finder.result.found > 0

boxes = numpy.concatenate([lower, lower + numpy.float32(0.03)], axis=1)

# snippet-begin: buffers
import wgpu

device = finder.device
buffer = device.create_buffer_with_data(data=boxes, usage=wgpu.BufferUsage.STORAGE)
encoder = device.create_command_encoder()
found = finder.find_on_gpu(buffer, len(boxes), capacity=20_000, encoder=encoder)
# snippet-end: buffers

# snippet-begin: pass
# Counts the partners of each box: one thread per pair.
code = """
@group(0) @binding(0) var<storage, read> counts: array<u32>;
@group(0) @binding(1) var<storage, read> pairs: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read_write> partners: array<atomic<u32>>;

@compute @workgroup_size(64)
fn count_partners(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
  let k = id.y * groups.x * 64u + id.x;
  if k >= counts[0] { return; }
  atomicAdd(&partners[pairs[k].x], 1u);
  atomicAdd(&partners[pairs[k].y], 1u);
}
"""
module = device.create_shader_module(code=code)
pipeline = device.create_compute_pipeline(
    layout="auto", compute={"module": module, "entry_point": "count_partners"}
)
usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
partners = device.create_buffer(size=4 * len(boxes), usage=usage)
arguments = device.create_buffer(size=12, usage=wgpu.BufferUsage.INDIRECT | wgpu.BufferUsage.COPY_DST)
encoder.copy_buffer_to_buffer(found.counts, 16, arguments, 0, 12)
bound = [found.counts, found.pairs, partners]
step = encoder.begin_compute_pass()
step.set_pipeline(pipeline)
step.set_bind_group(
    0,
    device.create_bind_group(
        layout=pipeline.get_bind_group_layout(0),
        entries=[{"binding": k, "resource": {"buffer": b}} for k, b in enumerate(bound)],
    ),
)
step.dispatch_workgroups_indirect(arguments, 0)
step.end()
device.queue.submit([encoder.finish()])
# snippet-end: pass
counted = numpy.frombuffer(device.queue.read_buffer(partners), numpy.uint32)
assert numpy.array_equal(counted, numpy.bincount(pairs.ravel(), minlength=len(boxes)))
