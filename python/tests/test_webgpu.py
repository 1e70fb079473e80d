"""throng.webgpu compared with a double loop and with throng.find_pairs; skipped without wgpu or an adapter. With
lavapipe (Debian's mesa-vulkan-drivers) a CPU runs it.
"""

import gc
import json
import os
import re
import sys
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy
import pytest
from numpy.typing import NDArray
from reference import INF, NAN

import throng
import throng.webgpu
from throng.webgpu import GpuFinder

wgpu = pytest.importorskip("wgpu", reason="wgpu is not installed: pip install wgpu")

BoxArray = NDArray[numpy.float32]
ROOT = Path(__file__).resolve().parents[2]
WGSL = throng.webgpu._folder()
ALGORITHMS = ["all-pairs", "grid"]


@pytest.fixture(scope="module")
def device() -> Any:
    try:
        return GpuFinder().device
    except RuntimeError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module", params=ALGORITHMS)
def finder(request: Any, device: Any) -> GpuFinder:
    return GpuFinder(device, algorithm=request.param)


@pytest.fixture(scope="module", params=ALGORITHMS)
def sorting_finder(request: Any, device: Any) -> GpuFinder:
    return GpuFinder(device, algorithm=request.param, order="canonical")


def keys_of(pairs: NDArray[Any]) -> NDArray[numpy.uint64]:
    return pairs[:, 0].astype(numpy.uint64) << numpy.uint64(32) | pairs[:, 1].astype(numpy.uint64)


def double_loop(boxes: BoxArray) -> NDArray[numpy.uint64]:
    """The keys of all pairs, in order."""
    lower, upper = boxes[:, :3], boxes[:, 3:]
    active = (lower <= upper).all(axis=1)
    rows = []
    for i in range(len(boxes)):
        met = (lower[i] <= upper[i + 1 :]) & (lower[i + 1 :] <= upper[i])
        j = numpy.nonzero(met.all(axis=1) & active[i + 1 :] & active[i])[0] + i + 1
        rows.append(numpy.uint64(i << 32) | j.astype(numpy.uint64))
    return numpy.concatenate(rows) if rows else numpy.empty(0, numpy.uint64)


def check(finder: GpuFinder, boxes: BoxArray) -> None:
    found = finder.find(boxes)
    assert found.dtype == numpy.uint32 and found.shape == (len(found), 2)
    own = keys_of(found)
    if finder._order == "any":
        own = numpy.sort(own)
    assert numpy.array_equal(own, double_loop(boxes))
    result = finder.result
    assert result.found == result.written == len(found)
    assert result.comparisons >= result.found
    assert result.inactive == int((~(boxes[:, :3] <= boxes[:, 3:]).all(axis=1)).sum())


def cubes(lower: NDArray[Any], size: Any) -> BoxArray:
    low = lower.astype(numpy.float32)
    return numpy.concatenate([low, low + numpy.asarray(size, numpy.float32).reshape(-1, 1)], 1)


def uniform(n: int, r: Any) -> BoxArray:
    return cubes(r.random((n, 3)) * (2 * n) ** (1 / 3), [1])


def decades(n: int, r: Any) -> BoxArray:
    """Sizes over six decades."""
    return cubes(r.random((n, 3)) * 100, 10.0 ** r.uniform(-5, 1, n))


def scattered_decades(n: int, r: Any) -> BoxArray:
    """Coordinates and sizes over 20 decades, on both sides of 0."""
    at = 10.0 ** r.uniform(-10, 10, (n, 3)) * r.choice([-1, 1], (n, 3))
    half = abs(at) * 10.0 ** r.uniform(-6, 0.5, (n, 1))
    return numpy.concatenate([at - half, at + half], 1).astype(numpy.float32)


def clusters(n: int, r: Any) -> BoxArray:
    """Some clusters far from one another, in each of which many overlap, and far ones."""
    centre = r.random((20, 3)) * 1e5
    return cubes(centre[r.integers(0, 20, n)] + r.normal(0, 2, (n, 3)), [1])


def one_cell(n: int, r: Any) -> BoxArray:
    """A few far boxes make cells large for the rest."""
    lower = r.random((n, 3)) * 0.01
    lower[:: n // 4 + 1] = r.random((len(lower[:: n // 4 + 1]), 3)) * 1e6
    return cubes(lower, [0.0005])


def touching(n: int, r: Any) -> BoxArray:
    """A lattice of cubes that share faces, edges and corners."""
    side = int(numpy.ceil(n ** (1 / 3)))
    at = numpy.stack(numpy.meshgrid(*[numpy.arange(side)] * 3), -1).reshape(-1, 3)[:n] * 0.1
    low = (at - 1).astype(numpy.float32)
    # The same float on both sides of each face.
    high = (at - 1 + 0.1).astype(numpy.float32)
    grid = numpy.unique(numpy.concatenate([low, high]))
    return numpy.concatenate([low, grid[numpy.searchsorted(grid, high)]], 1)


def zeros(n: int, r: Any) -> BoxArray:
    """-0 and +0 are equal."""
    return r.choice(numpy.array([-0.0, 0.0, 1e-45, -1e-45], numpy.float32), (n, 6))


def denormals(n: int, r: Any) -> BoxArray:
    lower = r.integers(-4000, 4000, (n, 3)) * 2.0**-149
    return numpy.concatenate([lower, lower + r.integers(0, 900, (n, 3)) * 2.0**-149], 1).astype(numpy.float32)


def infinite(n: int, r: Any) -> BoxArray:
    """Some boxes have no end on some sides."""
    boxes = uniform(n, r)
    boxes[:, :3][r.random((n, 3)) < 0.02] = -INF
    boxes[:, 3:][r.random((n, 3)) < 0.02] = INF
    boxes[: n // 16, 3:] = -INF
    boxes[: n // 16, :3] = -INF
    return boxes


def huge(n: int, r: Any) -> BoxArray:
    lower = r.uniform(-3.4e38, 3e38, (n, 3))
    return numpy.concatenate([lower, lower + r.uniform(0, 4e37, (n, 3))], 1).astype(numpy.float32)


def plane(n: int, r: Any) -> BoxArray:
    boxes = uniform(n, r)
    boxes[:, 2] = boxes[:, 5] = 7
    return boxes


def line(n: int, r: Any) -> BoxArray:
    lower = r.random((n, 3)) * [n, 0, 1e-6]
    return cubes(lower, [1])


def rods(n: int, r: Any) -> BoxArray:
    boxes = uniform(n, r)
    boxes[numpy.arange(n), r.integers(3, 6, n)] += 30
    return boxes


def small_integers(n: int, r: Any) -> BoxArray:
    """Touching, equal, inverted and flat ones."""
    lower = r.integers(0, 24, (n, 3))
    return numpy.concatenate([lower, lower + r.integers(-1, 3, (n, 3))], 1).astype(numpy.float32)


def any_bits(n: int, r: Any) -> BoxArray:
    """Every float but NaN."""
    bits = r.integers(0, 2**32, (n, 6), numpy.uint32)
    boxes = bits.view(numpy.float32)
    boxes[numpy.isnan(boxes)] = 1
    swap = numpy.sort(boxes.reshape(n, 2, 3), axis=1).reshape(n, 6)
    return numpy.where(r.random((n, 1)) < 0.9, swap, boxes).astype(numpy.float32)


SHAPES: list[Callable[[int, Any], BoxArray]] = [
    uniform, decades, scattered_decades, clusters, one_cell, touching, zeros, denormals, infinite, huge, plane, line,
    rods, small_integers, any_bits,
]  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.__name__)
def test_shapes(finder: GpuFinder, shape: Callable[[int, Any], BoxArray]) -> None:
    n = 300 if shape is zeros else 1500
    check(finder, shape(n, numpy.random.default_rng(n)))


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.__name__)
def test_shapes_of_5000_in_the_grid(device: Any, shape: Callable[[int, Any], BoxArray]) -> None:
    check(GpuFinder(device), shape(500 if shape is zeros else 5000, numpy.random.default_rng(1)))


@pytest.mark.parametrize("n", [0, 1, 2, 63, 64, 65, 127, 128, 129, 255, 256, 257])
def test_sizes(finder: GpuFinder, n: int) -> None:
    check(finder, uniform(n, numpy.random.default_rng(n)))


def test_sorted_order(sorting_finder: GpuFinder) -> None:
    """Rows of no pair, of some, which a thread sorts, and of many, which a workgroup sorts."""
    r = numpy.random.default_rng(3)
    boxes = uniform(1100, r)
    boxes[[0, 70, 900]] = [-1, -1, -1, 99, 99, 99]
    check(sorting_finder, boxes)
    for n in (0, 1, 2, 65):
        check(sorting_finder, uniform(n, r))
    check(sorting_finder, numpy.tile(numpy.array([0, 0, 0, 1, 1, 1], numpy.float32), (300, 1)))


def test_all_equal(finder: GpuFinder) -> None:
    check(finder, numpy.tile(numpy.array([0, 0, 0, 1, 1, 1], numpy.float32), (700, 1)))
    check(finder, numpy.zeros((500, 6), numpy.float32))


def test_random_calls(finder: GpuFinder) -> None:
    """The workspace of one call serves the next, of any size."""
    seed = int(os.environ.get("THRONG_SEED", "1"))
    r = numpy.random.default_rng(seed)
    for _ in range(int(os.environ.get("THRONG_EXAMPLES", "60"))):
        shape = SHAPES[r.integers(len(SHAPES))]
        check(finder, shape(int(r.integers(1, 120 if shape is zeros else 400)), r))


@pytest.mark.parametrize("name", throng.scene_names)
def test_golden_checksums(device: Any, name: str) -> None:
    """The pairs of a scene, and their sorted order."""
    table = ROOT / "apps" / "scenes" / "golden.cpp"
    if not table.is_file():
        pytest.skip("the sources are not here")
    rows = re.findall(rf'{{"{name}", (\d+), (\d+), (\d+), (0x\w+), (0x\w+)}}', table.read_text())
    assert len(rows) == 4
    if throng.scene_worlds(name, 10) is not None:
        pytest.skip("worlds are not among the filters of GpuFinder")
    for frame, objects, pairs, checksum, ordered in rows[:2]:
        boxes = throng.scene(name, int(objects), int(frame) + 1)[int(frame)]
        found = GpuFinder(device, algorithm="grid", order="canonical").find(boxes)
        keys = keys_of(found)
        assert len(keys) == int(pairs)
        assert int(mix64(keys).sum()) == int(checksum, 16)
        if len(keys) <= 20000:
            state = numpy.uint64(len(keys))
            for key in keys:
                state = mix64(state ^ key)
            assert int(state) == int(ordered, 16)


def test_cases_of_the_library(device: Any) -> None:
    """Hard cases with the answers of the double loop, which scripts/web writes."""
    folder = Path(os.environ.get("THRONG_CASES", ROOT / "build" / "web-tests"))
    if not (folder / "cases.json").is_file():
        pytest.skip("there are no cases; scripts/web --test writes them")
    data = (folder / "cases.bin").read_bytes()

    def array(place: list[int], kind: Any) -> NDArray[Any]:
        return numpy.frombuffer(data, kind, place[1], place[0])

    compared = 0
    for one in json.loads((folder / "cases.json").read_text())["finds"]:
        if one.get("other") or one.get("margin") or any(name in one for name in ("owner", "world", "static")):
            continue
        boxes = array(one["boxes"], numpy.float32).reshape(-1, 6)
        filters = {name: array(one[name], numpy.uint32) for name in ("group", "mask") if name in one}
        for algorithm in ALGORITHMS:
            finder = GpuFinder(device, algorithm=algorithm, order="canonical", nan=one.get("nan", "refuse"))
            if one.get("refused"):
                with pytest.raises(ValueError, match="have a NaN"):
                    finder.find(boxes, **filters)
            else:
                wanted = array(one["pairs"], numpy.uint32).reshape(-1, 2)
                assert numpy.array_equal(finder.find(boxes, **filters), wanted), one["name"]
        compared += 1
    assert compared >= 100


def mix64(x: Any) -> Any:
    """As in throng/checksum.hpp."""
    with numpy.errstate(over="ignore"):
        x = x + numpy.uint64(0x9E3779B97F4A7C15)
        x = (x ^ (x >> numpy.uint64(30))) * numpy.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> numpy.uint64(27))) * numpy.uint64(0x94D049BB133111EB)
        return x ^ (x >> numpy.uint64(31))


@pytest.mark.parametrize("name", ["uniform", "clusters", "mixed"])
def test_100000_boxes(device: Any, name: str) -> None:
    boxes = throng.scene(name, 100_000)[0]
    finder = GpuFinder(device)
    found = finder.find(boxes)
    expected = throng.find_pairs(boxes)
    assert numpy.array_equal(numpy.sort(keys_of(found)), numpy.sort(keys_of(expected)))
    assert finder.result.algorithm == "grid" and finder.result.dispatches <= 12


@pytest.mark.parametrize("name", throng.scene_names)
def test_comparisons_are_those_of_the_cuda_pipeline(device: Any, name: str) -> None:
    boxes = throng.scene(name, 10_000)[0]
    own, other = GpuFinder(device, algorithm="grid"), throng.Finder(backend="emulated", algorithm="grid")
    own.find(boxes)
    other.find(boxes)
    assert own.result.comparisons <= 1.1 * other.result.comparisons + 100
    assert own.result.dispatches <= 12


def test_uneven_boxes_take_few_comparisons(device: Any) -> None:
    """Mixed sizes, clusters and far coordinates: far from a comparison of each box with each."""
    n = 20_000
    for shape, limit in ((decades, 40), (clusters, 40), (one_cell, 100), (infinite, 900), (scattered_decades, 100)):
        finder = GpuFinder(device, algorithm="grid")
        finder.find(shape(n, numpy.random.default_rng(2)))
        share = finder.result.comparisons / (n + finder.result.found)
        assert share <= limit, shape.__name__


def test_filters(finder: GpuFinder) -> None:
    r = numpy.random.default_rng(5)
    boxes = uniform(900, r)
    group, mask = r.integers(0, 16, 900, numpy.uint32), r.integers(0, 16, 900, numpy.uint32)
    for filters in ({"group": group}, {"mask": mask}, {"group": group, "mask": mask}, {"group": 3, "mask": mask.tolist()}):
        found = finder.find(boxes, **filters)
        expected = throng.find_pairs(boxes, **filters)
        assert numpy.array_equal(numpy.sort(keys_of(found)), numpy.sort(keys_of(expected)))
    assert len(finder.find(boxes)) > len(found)


def test_layouts(finder: GpuFinder) -> None:
    boxes = uniform(200, numpy.random.default_rng(6))
    expected = numpy.sort(double_loop(boxes))
    strided = numpy.zeros((200, 9), numpy.float32)[:, 1:7]
    strided[:] = boxes
    for given in (
        boxes.reshape(-1, 2, 3), (boxes[:, :3], boxes[:, 3:]), strided, boxes[::-1].copy()[::-1],
        boxes.astype(numpy.float64), boxes.tolist(), numpy.asfortranarray(boxes),
    ):  # fmt: skip
        assert numpy.array_equal(numpy.sort(keys_of(finder.find(given))), expected)
    flat = boxes.copy()
    flat[:, 2] = flat[:, 5] = 0
    expected = numpy.sort(double_loop(flat))
    for given in (flat[:, [0, 1, 3, 4]], flat[:, [0, 1, 3, 4]].reshape(-1, 2, 2), (flat[:, :2], flat[:, 3:5])):
        assert numpy.array_equal(numpy.sort(keys_of(finder.find(given))), expected)


def test_inactive_boxes(device: Any) -> None:
    boxes = uniform(600, numpy.random.default_rng(7))
    # NaNs of either sign, with one bit and with all.
    boxes.view(numpy.uint32)[[5, 77, 300], [1, 1, 4]] = 0x7F800001, 0xFF800001, 0xFFFFFFFF
    boxes[[40, 41, 42], 0] = 1e9
    for algorithm in ALGORITHMS:
        finder = GpuFinder(device, algorithm=algorithm, nan="inactive")
        check(finder, boxes)
        assert (finder.result.inactive, finder.result.nan_count) == (6, 3)
        with pytest.raises(ValueError, match="3 of 600 boxes have a NaN, the first is box 5; .* nan='inactive'"):
            GpuFinder(device, algorithm=algorithm).find(boxes)
        with pytest.raises(ValueError, match="3 of 600 boxes have lower > upper, the first is box 40; .*inverted='inactive'"):
            GpuFinder(device, algorithm=algorithm, nan="inactive", inverted="refuse").find(boxes)
    nothing = numpy.full((5000, 6), NAN, numpy.float32)
    assert len(GpuFinder(device, nan="inactive").find(nothing)) == 0


def upload(device: Any, array: NDArray[Any]) -> Any:
    usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
    return device.create_buffer_with_data(data=array, usage=usage)


def download(device: Any, buffer: Any) -> NDArray[numpy.uint32]:
    return numpy.frombuffer(device.queue.read_buffer(buffer), numpy.uint32)


@pytest.mark.parametrize("order", ["any", "canonical"])
@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_buffers_of_the_gpu(device: Any, algorithm: Any, order: Any) -> None:
    """With space for all pairs, for some, and for none."""
    boxes = uniform(700, numpy.random.default_rng(8))
    expected = double_loop(boxes)
    m = len(expected)
    finder = GpuFinder(device, algorithm=algorithm, order=order)
    given = upload(device, boxes)
    for capacity in (m + 70, m, m - 1, 5, 0):
        pairs = upload(device, numpy.full((m + 80, 2), 7_777_777, numpy.uint32))
        found = finder.find_on_gpu(given, 700, capacity=capacity, pairs=pairs)
        assert found.pairs is pairs and found.capacity == capacity
        counts = download(device, found.counts)
        written = m if capacity >= m else capacity if order == "any" else 0
        groups = -(-written // 64)
        assert counts[:8].tolist() == [written, m, 0, 0, groups, int(groups > 0), 1, 0]
        out = download(device, pairs).reshape(-1, 2)
        assert (out[capacity:] == 7_777_777).all()
        own = keys_of(out[:written])
        assert len(numpy.unique(own)) == written and numpy.isin(own, expected).all()
        if order == "canonical":
            assert numpy.array_equal(own, expected[:written])


def test_buffers_of_the_caller_are_not_kept(device: Any) -> None:
    finder = GpuFinder(device)
    boxes = upload(device, uniform(100, numpy.random.default_rng(1)))
    pairs = device.create_buffer(size=8000, usage=wgpu.BufferUsage.STORAGE)
    watched = weakref.ref(boxes), weakref.ref(pairs)
    for _ in range(2):
        finder.find_on_gpu(boxes, 100, capacity=1000, pairs=pairs)
    del boxes, pairs
    gc.collect()
    assert watched[0]() is None and watched[1]() is None


def test_a_pass_of_the_caller_reads_the_pairs(device: Any) -> None:
    """In the caller's encoder, with boxes as a WGSL struct of two vec3, and with an indirect dispatch."""
    boxes = uniform(5000, numpy.random.default_rng(9))
    padded = numpy.zeros((5000, 8), numpy.float32)
    padded[:, :3], padded[:, 4:7] = boxes[:, :3], boxes[:, 3:]
    filters = numpy.full((5000, 2), 1, numpy.uint32)
    filters[::3] = 2
    expected = throng.find_pairs(boxes, group=filters[:, 0], mask=filters[:, 1])
    finder = GpuFinder(device)
    encoder = device.create_command_encoder()
    found = finder.find_on_gpu(
        upload(device, padded), 5000, capacity=20_000, stride=32, filters=upload(device, filters), encoder=encoder
    )
    code = """
    @group(0) @binding(0) var<storage, read> pairs: array<vec2<u32>>;
    @group(0) @binding(1) var<storage, read> counts: array<u32>;
    @group(0) @binding(2) var<storage, read_write> partners: array<atomic<u32>>;
    @compute @workgroup_size(64)
    fn count_partners(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
      let k = id.y * groups.x * 64u + id.x;
      if k >= counts[0] { return; }
      atomicAdd(&partners[pairs[k].x], 1u);
      atomicAdd(&partners[pairs[k].y], 1u);
    }"""
    pipeline = device.create_compute_pipeline(
        layout="auto", compute={"module": device.create_shader_module(code=code), "entry_point": "count_partners"}
    )
    partners = upload(device, numpy.zeros(5000, numpy.uint32))
    copy = device.create_buffer(size=32, usage=wgpu.BufferUsage.INDIRECT | wgpu.BufferUsage.COPY_DST)
    encoder.copy_buffer_to_buffer(found.counts, 0, copy, 0, 32)
    group = device.create_bind_group(
        layout=pipeline.get_bind_group_layout(0),
        entries=[{"binding": k, "resource": {"buffer": b}} for k, b in enumerate([found.pairs, found.counts, partners])],
    )
    step = encoder.begin_compute_pass()
    step.set_pipeline(pipeline)
    step.set_bind_group(0, group)
    step.dispatch_workgroups_indirect(copy, 16)
    step.end()
    device.queue.submit([encoder.finish()])
    assert numpy.array_equal(download(device, partners)[:5000], numpy.bincount(expected.ravel(), minlength=5000))


def run_test_shader(device: Any, files: list[str], code: str, *arrays: NDArray[Any]) -> NDArray[numpy.uint32]:
    """Runs the entry `main` with one workgroup per 64 elements; returns the last array."""
    text = "\n".join((WGSL / f"{file}.wgsl").read_text() for file in files) + code
    module = device.create_shader_module(code=text)
    pipeline = device.create_compute_pipeline(layout="auto", compute={"module": module, "entry_point": "main"})
    buffers = [upload(device, array) for array in arrays]
    group = device.create_bind_group(
        layout=pipeline.get_bind_group_layout(0),
        entries=[{"binding": k, "resource": {"buffer": b}} for k, b in enumerate(buffers)],
    )
    encoder = device.create_command_encoder()
    step = encoder.begin_compute_pass()
    step.set_pipeline(pipeline)
    step.set_bind_group(0, group)
    step.dispatch_workgroups(-(-len(arrays[-1]) // 64))
    step.end()
    device.queue.submit([encoder.finish()])
    return download(device, buffers[-1])[: len(arrays[-1])]


def test_sizes_are_those_of_the_list_of_steps() -> None:
    listed = json.loads((WGSL / "steps.json").read_text())
    for n, m in ((0, 0), (1, 1), (64, 255), (65, 256), (2047, 10**6), (4096, 257), (4097, 7), (10**6, 2**24)):
        workgroups, bytes_of = throng.webgpu._sizes(n, m, True)
        names = {"n": n, "m": m, "min": min, "max": max, **workgroups}
        for found, texts in ((workgroups, listed["workgroups"]), (bytes_of, listed["bytes"])):
            assert found == {name: eval(text, names) for name, text in texts.items()}
    for step in listed["steps"].values():
        assert step["workgroups"] in listed["workgroups"]
        assert {b for b in step["buffers"] if b} <= set(listed["bytes"])
        # The default limit of WebGPU; one of the buffers is uniform.
        assert len([b for b in step["buffers"] if b and b != "parameters"]) <= 8


def test_the_pair_index_is_exact(device: Any) -> None:
    """At the first and last tile of columns, up to the last index of 32 bits."""
    columns = numpy.unique(
        numpy.concatenate([numpy.arange(200), 2 ** numpy.arange(17), numpy.arange(4090, 4100), numpy.arange(92600, 92682)])
    ).astype(numpy.uint64)
    firsts = columns * (columns + 1) // 2
    k = numpy.concatenate([firsts, firsts[1:] - 1, [2**32 - 1]]).astype(numpy.uint32)
    wanted = numpy.concatenate([columns, columns[1:] - 1, [92681]])
    code = """
    @group(0) @binding(0) var<storage, read_write> k: array<u32>;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3<u32>) {
      if id.x < arrayLength(&k) { k[id.x] = column_of(k[id.x]); }
    }"""
    assert numpy.array_equal(run_test_shader(device, ["pair_index"], code, k), wanted)


def all_floats() -> BoxArray:
    """In order: powers of two with their neighbours, denormals, zeros, infinities, random bits."""
    powers = (2.0 ** numpy.arange(-149, 128)).astype(numpy.float32)
    bits = powers.view(numpy.uint32)
    near = numpy.concatenate([bits, bits + 1, bits - 1, numpy.random.default_rng(1).integers(0, 0x7F800001, 3000, numpy.uint32)])
    positive = near.view(numpy.float32)
    return numpy.sort(numpy.concatenate([positive, -positive, numpy.array([0.0, -0.0, INF, -INF], numpy.float32)]))


def test_keys_have_the_order_of_floats(device: Any) -> None:
    floats = all_floats()
    code = """
    @group(0) @binding(0) var<storage, read_write> x: array<u32>;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3<u32>) {
      if id.x >= arrayLength(&x) { return; }
      let key = ordered_key(x[id.x]);
      // Back and forth gives the same key.
      x[id.x] = select(0u, key, ordered_key(bits_of_key(key)) == key);
    }"""
    keys = run_test_shader(device, ["ordered_keys"], code, floats.view(numpy.uint32)).astype(numpy.int64)
    assert numpy.array_equal(numpy.diff(keys) > 0, numpy.diff(floats) > 0)
    assert (numpy.diff(keys) >= 0).all()


@pytest.mark.parametrize("knots", [0, 1])
def test_cells_do_not_decrease(device: Any, knots: int) -> None:
    """For any grid, sensible or not: the proof needs nothing else."""
    floats = all_floats()
    r = numpy.random.default_rng(2)
    code = """
    @group(0) @binding(0) var<storage, read> grid: SizeClassGrid;
    @group(0) @binding(1) var<storage, read_write> x: array<u32>;
    @compute @workgroup_size(64)
    fn main(@builtin(global_invocation_id) id: vec3<u32>) {
      if id.x < arrayLength(&x) { x[id.x] = cell_of(0u, ordered_key(x[id.x])); }
    }"""
    for exponent in (-149, -140, -60, -20, 0, 60, 98):
        low, high = sorted(int(v) for v in r.integers(-(2**30), 2**30, 2))
        cells = int(r.integers(1, 2**22))
        grid = numpy.zeros(600, numpy.uint32)
        grid[0] = numpy.uint32(exponent & 0xFFFFFFFF)
        grid[4:5].view(numpy.int32)[0], grid[8:9].view(numpy.int32)[0] = low, high
        positions = 32 << 20 if knots else high - low + 1
        grid[12], grid[16], grid[23] = min(cells * 2**32 // positions, 2**32 - 1), cells - 1, knots
        begins = numpy.sort(r.integers(0, 2**32, 32, numpy.uint32))
        begins[0] = 0
        begins[7] = begins[6]  # an empty span
        for k in range(32):
            distance = max((int(begins[k + 1]) if k < 31 else 2**32 - 1) - int(begins[k]), 1)
            shift = 32 - distance.bit_length()
            # The planner's floats may give a little more than the quotient.
            scale = min(2**52 // (distance << shift) * 101 // 100, 2**32 - 1)
            grid[120 + 4 * k : 123 + 4 * k] = begins[k], shift, scale
        found = run_test_shader(
            device, ["ordered_keys", "records", "size_class_grid"], code, grid, floats.view(numpy.uint32)
        )
        assert (numpy.diff(found.astype(numpy.int64)) >= 0).all()
        assert found.max() <= cells - 1
        assert knots or cells == 1 or exponent == 98 or len(numpy.unique(found)) > 1


def test_errors(device: Any, monkeypatch: Any) -> None:
    finder = GpuFinder(device)
    boxes = uniform(10, numpy.random.default_rng(1))
    for given, kind, text in (
        (boxes[:, :5], ValueError, r"boxes: found shape \(10, 5\), wanted \(n, 6\)"),
        (boxes.astype(numpy.int32), TypeError, "boxes: found int32, wanted float32"),
        (boxes.astype(numpy.float64) + 1e-12, ValueError, "boxes: found float64 values that are no float32"),
        ((boxes[:, :3], boxes[:5, 3:]), ValueError, r"boxes: found shapes \(10, 3\) and \(5, 3\)"),
        ((boxes,), ValueError, "boxes: found a tuple of 1"),
    ):
        with pytest.raises(kind, match=text):
            finder.find(given)
    for filters, kind, text in (
        ({"group": [1, 2]}, ValueError, r"group: found shape \(2,\), wanted \(10,\)"),
        ({"mask": 2.5}, TypeError, "mask: found float64, wanted integers"),
        ({"mask": -1}, ValueError, "mask: found -1 to -1, wanted integers from 0 to 4294967295"),
    ):
        with pytest.raises(kind, match=text):
            finder.find(boxes, **filters)
    given = upload(device, boxes)
    uniform_buffer = device.create_buffer(size=1024, usage=wgpu.BufferUsage.UNIFORM)
    for arguments, kind, text in (
        ({"boxes": boxes}, TypeError, "boxes: found a ndarray, wanted a wgpu.GPUBuffer"),
        ({"count": 11}, ValueError, "boxes: found a buffer of 240 bytes, wanted at least 264"),
        ({"count": -1}, ValueError, "count: found -1, wanted an integer from 0"),
        ({"count": 1.0}, TypeError, "count: found 1.0, wanted an integer"),
        ({"capacity": 2**40}, ValueError, "capacity: found 1099511627776, wanted an integer from 0"),
        ({"stride": 28}, ValueError, "stride: found 28, wanted 24 or 32 bytes"),
        ({"boxes": uniform_buffer}, ValueError, "boxes: found a buffer without the usage STORAGE"),
        ({"pairs": given}, ValueError, "pairs: found a buffer of 240 bytes, wanted at least 800"),
        ({"filters": given, "count": 40, "boxes": upload(device, numpy.zeros((40, 6), numpy.float32))}, ValueError, "filters: found a buffer of 240"),
        ({"encoder": 1}, TypeError, "encoder: found a int, wanted a wgpu.GPUCommandEncoder"),
    ):
        with pytest.raises(kind, match=text):
            finder.find_on_gpu(**{"boxes": given, "count": 10, "capacity": 100, **arguments})
    for options, kind in (({"order": "some"}, ValueError), ({"nan": 1}, TypeError), ({"algorithm": "bvh"}, ValueError), ({"device": 1}, TypeError)):
        with pytest.raises(kind, match=f"{next(iter(options))}: found .*wanted"):
            GpuFinder(**{"device": device, **options})
    with pytest.raises(TypeError, match="cannot be copied or pickled"):
        __import__("copy").copy(finder)
    # A device with a lower limit.
    monkeypatch.setattr(finder, "_max_bytes", 32 * 9)
    with pytest.raises(ValueError, match="boxes: found 10 boxes, wanted at most 9: .*max-storage-buffer-binding-size"):
        finder.find(boxes)
    brute = GpuFinder(device, algorithm="all-pairs")
    monkeypatch.setattr(brute, "_max_bytes", 2**31)
    with pytest.raises(ValueError, match="boxes: found 6000000 boxes, wanted at most 5931456: .*algorithm='all-pairs'"):
        brute.find_on_gpu(given, 6_000_000, capacity=1)
    tiles = brute.max_boxes // 64
    assert tiles * (tiles + 1) // 2 <= 65535**2 < (tiles + 1) * (tiles + 2) // 2
    small = GpuFinder(device)
    monkeypatch.setattr(small, "_max_bytes", 8 * 4000)
    equal = numpy.zeros((100, 6), numpy.float32)
    with pytest.raises(MemoryError, match="4950 pairs were found, a buffer of this device holds 4000 .*max-storage-buffer"):
        small.find(equal)


def test_lost_and_other_devices(device: Any) -> None:
    boxes = uniform(10, numpy.random.default_rng(1))
    finder = GpuFinder()
    given = upload(finder.device, boxes)
    with pytest.raises(ValueError, match="boxes: found a buffer of another device"):
        GpuFinder(device).find_on_gpu(given, 10, capacity=10)
    check(finder, boxes)
    finder.device.destroy()
    with pytest.raises(RuntimeError, match="lost .* make another GpuFinder"):
        finder.find(boxes)
    with pytest.raises(RuntimeError, match="lost .* make another GpuFinder"):
        finder.find_on_gpu(given, 10, capacity=10)
    check(GpuFinder(device), boxes)


def test_without_wgpu_or_adapter(monkeypatch: Any) -> None:
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "wgpu", None)
        with pytest.raises(ImportError, match="pip install wgpu"):
            GpuFinder()

    def nothing(**_: Any) -> Any:
        raise RuntimeError("no adapter here")

    monkeypatch.setattr(wgpu.gpu, "request_adapter_sync", nothing)
    with pytest.raises(RuntimeError, match="found no GPU adapter: no adapter here; install a driver"):
        GpuFinder()


def test_one_thread_at_a_time(device: Any) -> None:
    finder = throng.webgpu.GpuFinder(device)
    boxes = numpy.zeros((3, 6), numpy.float32)
    with finder._lock, pytest.raises(RuntimeError, match="in a call of another thread: make one for each"):
        finder.find(boxes)
    assert len(finder.find(boxes)) == 3
    hidden = numpy.ma.masked_equal(boxes, 0)
    with pytest.raises(ValueError, match="boxes: found a masked array that hides values"):
        finder.find(hidden)


def test_buffers_that_are_empty_or_larger_than_needed(device: Any) -> None:
    finder = throng.webgpu.GpuFinder(device)
    usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
    boxes = numpy.array([[0, 0, 0, 1, 1, 1], [1, 1, 1, 2, 2, 2], [9, 9, 9, 9, 9, 9]], numpy.float32)
    large = device.create_buffer_with_data(data=boxes, usage=usage)
    pairs = device.create_buffer(size=1004, usage=usage)
    for count, capacity, found in [(2, 100, 1), (2, 0, 1), (0, 0, 0)]:
        made = finder.find_on_gpu(large, count, capacity=capacity, pairs=pairs)
        words = numpy.frombuffer(device.queue.read_buffer(made.counts), numpy.uint32)
        assert words[0] == min(found, capacity) and words[1] == found
