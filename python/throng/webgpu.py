"""Pairs of overlapping boxes on any GPU, by WebGPU: Vulkan, Metal or Direct3D 12, through the package wgpu.

    >>> import numpy, throng.webgpu
    >>> finder = throng.webgpu.GpuFinder()
    >>> boxes = numpy.array([[0, 0, 0, 2, 2, 2], [1, 1, 1, 3, 3, 3], [9, 9, 9, 9, 9, 9]], numpy.float32)
    >>> finder.find(boxes)
    array([[0, 1]], dtype=uint32)

The pairs are those of throng.find_pairs on any device, as its shaders compare integers alone. This module
needs the package wgpu; `import throng` does not import it.
"""

import json
import struct
import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NoReturn

import numpy
from numpy.typing import NDArray

from throng._batch import refuse_hidden

__all__ = ["GpuFinder", "GpuPairs", "GpuResult"]

_NO_WGPU = "throng.webgpu needs the package wgpu, which is not installed: pip install wgpu"
_MAX_WORKGROUPS = 65535
# Up to this many boxes brute force runs: 3 steps instead of 7. The CUDA search has 4096, measured on an H200;
# this is an estimate for GPUs a tenth as fast, measured on none.
_BRUTE_FORCE_LIMIT = 2048
_ROW_CELLS = 8192  # see size_class_grid.wgsl
_SCAN_BLOCK = 2048  # see scan_cells.wgsl
_TILE = 64
_REPORT_BYTES = 64
_COUNTS_BYTES = 32
_GRID_BYTES = 2016  # see size_class_grid.wgsl
_FIRST_CAPACITY = 4096
_LARGEST_COUNT = 2**29 - 1  # boxes, whose words have indices of 32 bits
_MOST_TILES = 92679  # of brute force: their pairs are no more than workgroups in two dimensions

_pipelines: weakref.WeakKeyDictionary[Any, dict[str, Any]] = weakref.WeakKeyDictionary()


def _wgpu() -> Any:
    try:
        import wgpu
    except ImportError as error:
        raise ImportError(_NO_WGPU) from error
    return wgpu


def _folder() -> Path:
    """The shaders: in a folder next to this file in the installed package, else in the source tree."""
    here = Path(__file__).resolve()
    for folder in (here.parent / "wgsl", here.parents[2] / "web" / "wgsl"):
        if (folder / "steps.json").is_file():
            return folder
    raise FileNotFoundError(
        f"throng.webgpu: no shaders in {here.parent / 'wgsl'}; install the package again"
    )


@dataclass(frozen=True)
class GpuResult:
    """Counts of a search."""

    found: int
    """All pairs."""
    written: int
    """Pairs in the buffer."""
    inactive: int
    """Boxes that overlap nothing: lower > upper on some axis, or a NaN."""
    nan_count: int
    """Boxes with a NaN."""
    comparisons: int
    """Compared pairs of boxes."""
    dispatches: int
    """Steps that ran on the GPU."""
    algorithm: str
    """'all-pairs' or 'grid'."""


@dataclass(frozen=True)
class GpuPairs:
    """Pairs in the memory of the GPU, overwritten by the next search of the same finder.

    pairs: a wgpu.GPUBuffer of (first, second), uint32.
    counts: a wgpu.GPUBuffer of eight uint32: the pairs in the buffer; all pairs found, low word and high
        word; boxes with a NaN; at byte 16 the arguments x, y, z of an indirect dispatch of workgroups of
        64 threads, one thread per pair; inactive boxes.
    capacity: pairs that fit the buffer.
    """

    pairs: Any
    counts: Any
    capacity: int


@dataclass(frozen=True)
class _Report:
    found: int
    comparisons: int
    inactive: int
    nan_count: int
    first_nan: int
    inverted_count: int
    first_inverted: int

    @classmethod
    def of(cls, words: Any) -> "_Report":
        w = [int(word) for word in words]
        last = 0xFFFFFFFF  # marks are the highest index minus an index, so that the first is the maximum
        return cls(w[0] | w[1] << 32, w[3] | w[4] << 32, w[5], w[6], last - w[7], w[8], last - w[9])


class GpuFinder:
    """Finds pairs on a GPU repeatedly, and keeps its memory.

    device: a wgpu.GPUDevice; None: that of the fastest adapter, with the adapter's limits.
    algorithm: 'auto', 'all-pairs', 'grid'. The pairs are the same for each.
    order: 'any' is fastest; 'canonical': sorted by first, then second.
    nan, inverted: 'refuse' raises ValueError for such a box; 'inactive': it overlaps nothing.

    Raises ImportError without the package wgpu, RuntimeError if there is no adapter.

    One thread at a time: a call during one of another thread raises RuntimeError.
    """

    def __init__(
        self,
        device: Any = None,
        *,
        algorithm: Literal["auto", "all-pairs", "grid"] = "auto",
        order: Literal["any", "canonical"] = "any",
        nan: Literal["refuse", "inactive"] = "refuse",
        inverted: Literal["refuse", "inactive"] = "inactive",
    ) -> None:
        self._algorithm = _choice("algorithm", algorithm, ("auto", "all-pairs", "grid"))
        self._order = _choice("order", order, ("any", "canonical"))
        self._nan = _choice("nan", nan, ("refuse", "inactive"))
        self._inverted = _choice("inverted", inverted, ("refuse", "inactive"))
        self._wgpu = _wgpu()
        self._device = _default_device(self._wgpu) if device is None else device
        if not isinstance(self._device, self._wgpu.GPUDevice):
            raise TypeError(f"device: found a {type(device).__name__}, wanted a wgpu.GPUDevice or None")
        limits = self._device.limits
        most = min(limits["max-storage-buffer-binding-size"], limits["max-buffer-size"])
        self._max_bytes = most & ~15
        manifest = json.loads((_folder() / "steps.json").read_text("utf-8"))
        self._steps: dict[str, Any] = manifest["steps"]
        self._frames: dict[str, dict[str, list[str]]] = manifest["frames"]
        # Compiled once per device: that takes seconds for all steps.
        self._pipelines = _pipelines.setdefault(self._device, {})
        self._buffers: dict[str, Any] = {}
        self._parameters: dict[bytes, Any] = {}
        self._bind_groups: dict[Any, Any] = {}
        self._result = GpuResult(0, 0, 0, 0, 0, 0, "")
        self._lock = threading.Lock()

    def __reduce__(self) -> NoReturn:
        raise TypeError("a GpuFinder cannot be copied or pickled: make another with the same options")

    @property
    def device(self) -> Any:
        """The wgpu.GPUDevice."""
        return self._device

    @property
    def result(self) -> GpuResult:
        """Counts of the last call of find()."""
        return self._result

    @property
    def max_boxes(self) -> int:
        """The most boxes that the device's limits allow."""
        most = _MOST_TILES * _TILE if self._algorithm == "all-pairs" else _LARGEST_COUNT
        return int(min(most, self._max_bytes // 32))

    @property
    def max_pairs(self) -> int:
        """The most pairs that the device's limits allow in one buffer."""
        return int(min(2**31, self._max_bytes // 8))

    def find(self, boxes: Any, *, group: Any = None, mask: Any = None) -> NDArray[numpy.uint32]:
        """All pairs of overlapping boxes, (m, 2) uint32, first < second, each pair once.

        boxes: NumPy arrays or what NumPy converts: (n, 6) lower x, y, z, upper x, y, z; (n, 4) for 2-D;
            (n, 2, 3) or (n, 2, 2) corners; or a tuple (lower, upper) of arrays (n, 3) or (n, 2). float32,
            or float64 whose every value is a float32.
        group, mask: uint32, one value per box, or one for all; a pair needs (group a & mask b) and
            (group b & mask a) nonzero; a missing one counts as all ones.

        Raises TypeError, ValueError (shape, NaN, too many boxes), MemoryError (more pairs than a buffer
        of the device holds), RuntimeError (the device is lost). The message names the argument, the
        value and the fix.
        """
        for name, given in (("boxes", boxes), ("group", group), ("mask", mask)):
            refuse_hidden(given, name)
        array = _as_boxes(boxes)
        self._check_count(len(array))
        filters = _as_filters(group, mask, len(array))
        if len(array) == 0:
            self._result = GpuResult(0, 0, 0, 0, 0, 0, self._frame(0))
            return numpy.empty((0, 2), numpy.uint32)
        with self._call():
            return self._find(array, filters)

    def _find(
        self, array: NDArray[numpy.float32], filters: NDArray[numpy.uint32] | None
    ) -> NDArray[numpy.uint32]:
        n = len(array)
        queue = self._device.queue
        given = self._reserve("boxes", 24 * n)
        queue.write_buffer(given, 0, array)
        given_filters = None
        if filters is not None:
            given_filters = self._reserve("filters", 8 * n)
            queue.write_buffer(given_filters, 0, filters)
        wanted = _FIRST_CAPACITY
        while True:
            pairs = self._reserve("pairs", 8 * min(wanted, self.max_pairs))
            capacity = min(pairs.size // 8, self.max_pairs)
            counts = self._reserve("counts", _COUNTS_BYTES)
            encoder = self._device.create_command_encoder()
            dispatches = self._record(encoder, given, n, 24, given_filters, pairs, counts, capacity)
            queue.submit([encoder.finish()])
            report = _Report.of(numpy.frombuffer(queue.read_buffer(self._buffers["report"]), numpy.uint32))
            self._refuse(report, n)
            if report.found <= capacity:
                break
            if report.found > self.max_pairs:
                raise MemoryError(
                    f"{report.found} pairs were found, a buffer of this device holds {self.max_pairs} "
                    f"(limit max-storage-buffer-binding-size of {self._max_bytes} bytes); filter by group "
                    "and mask, search parts of the boxes, or use throng.Finder.consume"
                )
            wanted = report.found
        self._result = GpuResult(
            report.found,
            report.found,
            report.inactive,
            report.nan_count,
            report.comparisons,
            dispatches,
            self._frame(n),
        )
        if report.found == 0:
            return numpy.empty((0, 2), numpy.uint32)
        found = queue.read_buffer(pairs, 0, 8 * report.found)
        return numpy.frombuffer(found, numpy.uint32).reshape(-1, 2).copy()

    def find_on_gpu(
        self,
        boxes: Any,
        count: int,
        *,
        capacity: int,
        stride: int = 24,
        filters: Any = None,
        pairs: Any = None,
        counts: Any = None,
        encoder: Any = None,
    ) -> GpuPairs:
        """Finds pairs of boxes in the memory of the GPU, without reading anything back.

        boxes: a wgpu.GPUBuffer of float32 with usage STORAGE.
        stride: bytes from one box to the next: 24 for lower x, y, z, upper x, y, z; 32 for a WGSL struct of
            two vec3<f32>.
        count: the number of boxes.
        capacity: space for this many pairs. All are counted, written or not; in canonical order none is
            written if they do not fit.
        filters: a wgpu.GPUBuffer of (group, mask), uint32, per box.
        pairs, counts: the caller's buffers of 8 * capacity and of 32 bytes, with usage STORAGE; None: those
            of the finder, with usages STORAGE, COPY_SRC and INDIRECT.
        encoder: a wgpu.GPUCommandEncoder of the device, to which the search is added; None: it is submitted.

        A NaN raises no error: its box is inactive, and `counts` has the number. Raises TypeError and
        ValueError for other arguments, RuntimeError if the device is lost.
        """
        wgpu = self._wgpu
        self._check_count(_whole("count", count, _LARGEST_COUNT))
        _whole("capacity", capacity, self.max_pairs)
        if stride not in (24, 32):
            raise ValueError(f"stride: found {stride!r:.60}, wanted 24 or 32 bytes")
        self._check_buffer("boxes", boxes, stride * count)
        if filters is not None:
            self._check_buffer("filters", filters, 8 * count)
        if pairs is not None:
            self._check_buffer("pairs", pairs, 8 * capacity)
        if counts is not None:
            self._check_buffer("counts", counts, _COUNTS_BYTES)
        if encoder is not None and not isinstance(encoder, wgpu.GPUCommandEncoder):
            raise TypeError(
                f"encoder: found a {type(encoder).__name__}, wanted a wgpu.GPUCommandEncoder or None"
            )
        with self._call():
            pairs = self._reserve("pairs", 8 * max(capacity, 1)) if pairs is None else pairs
            counts = self._reserve("counts", _COUNTS_BYTES) if counts is None else counts
            own = encoder is None
            encoder = self._device.create_command_encoder() if own else encoder
            self._record(encoder, boxes, count, stride, filters, pairs, counts, capacity)
            if own:
                self._device.queue.submit([encoder.finish()])
        return GpuPairs(pairs, counts, capacity)

    @contextmanager
    def _call(self) -> Iterator[None]:
        if not self._lock.acquire(blocking=False):
            raise RuntimeError("this GpuFinder is in a call of another thread: make one for each thread")
        try:
            yield
        except self._wgpu.GPUError as error:
            if "lost" not in str(error):
                raise
            raise RuntimeError(
                "the GPU device of this GpuFinder is lost (the driver was reset, or device.destroy() was "
                "called): make another GpuFinder, and upload the boxes again"
            ) from error
        finally:
            self._lock.release()

    # ---- the frame ------------------------------------------------------------------------------

    def _frame(self, count: int) -> str:
        if self._algorithm != "auto":
            return self._algorithm
        return "all-pairs" if count <= _BRUTE_FORCE_LIMIT else "grid"

    def _record(
        self,
        encoder: Any,
        boxes: Any,
        count: int,
        stride: int,
        filters: Any,
        pairs: Any,
        counts: Any,
        capacity: int,
    ) -> int:
        """Records all steps of a frame; returns their number."""
        is_sorted = self._order == "canonical"
        name = self._frame(count)
        workgroups, bytes_of = _sizes(count, capacity, is_sorted)
        bound = {"boxes": boxes, "pairs": pairs, "counts": counts}
        # Of the caller's buffers no more is bound: they may be larger than a binding. Nothing is read or
        # written of empty ones.
        used = {"boxes": stride * count, "pairs": 8 * capacity, "counts": _COUNTS_BYTES}
        if filters is not None:
            bound["filters"] = filters
            used["filters"] = 8 * count
        for name_of, size in used.items():
            if size == 0:
                bound[name_of], used[name_of] = self._reserve(name_of, 32), 32
        if not is_sorted:
            bound["found"], used["found"] = bound["pairs"], used["pairs"]
        bound["parameters"] = self._uniform(
            struct.pack(
                "<8I",
                count,
                stride // 4,
                3 if stride == 24 else 4,
                capacity,
                _table_cells(count),
                filters is not None,
                is_sorted,
                0,
            )
        )
        frame = self._frames[name + " sorted" if is_sorted else name]
        bytes_of["filters"] = 8  # unless given; then not read
        # All before any is bound: a buffer that grows is another one.
        needed = frame["clear"] + [b for step in frame["steps"] for b in self._steps[step]["buffers"]]
        for buffer in needed:
            if buffer is not None and buffer not in bound:
                bound[buffer] = self._reserve(buffer, bytes_of[buffer])
        for buffer in frame["clear"]:
            encoder.clear_buffer(bound[buffer], 0, bytes_of[buffer])
        compute = encoder.begin_compute_pass()
        for step in frame["steps"]:
            pipeline = self._pipeline(step)
            names = self._steps[step]["buffers"]
            buffers = [None if b is None else (bound[b], used.get(b, bound[b].size)) for b in names]
            groups = workgroups[self._steps[step]["workgroups"]]
            if groups == 0:
                continue
            width = min(groups, _MAX_WORKGROUPS)
            compute.set_pipeline(pipeline)
            compute.set_bind_group(0, self._bind_group(step, pipeline, buffers))
            compute.dispatch_workgroups(width, -(-groups // width))
        compute.end()
        return len(frame["steps"])

    def _pipeline(self, name: str) -> Any:
        if name not in self._pipelines:
            folder = _folder()
            step = self._steps[name]
            code = "\n".join((folder / f"{file}.wgsl").read_text("utf-8") for file in step["files"])
            module = self._device.create_shader_module(label=name, code=code)
            self._pipelines[name] = self._device.create_compute_pipeline(
                label=name, layout="auto", compute={"module": module, "entry_point": step.get("entry", name)}
            )
        return self._pipelines[name]

    def _bind_group(self, name: str, pipeline: Any, buffers: list[tuple[Any, int] | None]) -> Any:
        """Kept if all buffers are the finder's: those of the caller are not kept alive."""
        own = [*self._buffers.values(), *self._parameters.values()]
        keeps = all(b is None or any(b[0] is other for other in own) for b in buffers)
        key = name, *((b and id(b[0]), b and b[1]) for b in buffers)
        if keeps and key in self._bind_groups:
            return self._bind_groups[key][0]
        group = self._device.create_bind_group(
            layout=pipeline.get_bind_group_layout(0),
            entries=[
                {"binding": k, "resource": {"buffer": part[0], "offset": 0, "size": part[1]}}
                for k, part in enumerate(buffers)
                if part is not None
            ],
        )
        if keeps:
            if len(self._bind_groups) >= 256:
                self._bind_groups.clear()
            self._bind_groups[key] = group, buffers  # while the buffers live, no id is reused
        return group

    def _uniform(self, data: bytes) -> Any:
        """A buffer with these parameters. Encoders that wait for submission have theirs."""
        if data not in self._parameters:
            if len(self._parameters) >= 64:
                self._parameters.clear()
            usage = self._wgpu.BufferUsage.UNIFORM
            self._parameters[data] = self._device.create_buffer_with_data(data=data, usage=usage)
        return self._parameters[data]

    # ---- memory ---------------------------------------------------------------------------------

    def _reserve(self, name: str, size: int) -> Any:
        """A buffer of at least this size, with space for growth."""
        buffer = self._buffers.get(name)
        if buffer is not None and buffer.size >= size:
            return buffer
        if size > self._max_bytes:
            raise MemoryError(
                f"the buffer '{name}' needs {size} bytes, the device allows {self._max_bytes} "
                "(limits max-storage-buffer-binding-size, max-buffer-size); search fewer boxes"
            )
        size = min(max(size + size // 4, 256) + 15 & ~15, self._max_bytes & ~15)
        use = self._wgpu.BufferUsage
        usage = use.STORAGE | use.COPY_SRC | use.COPY_DST | use.INDIRECT
        self._bind_groups.clear()
        self._buffers[name] = self._device.create_buffer(label=name, size=size, usage=usage)
        return self._buffers[name]

    def _check_count(self, count: int) -> None:
        if count <= self.max_boxes:
            return
        why = (
            f"the device binds at most {self._max_bytes} bytes (limits max-storage-buffer-binding-size, "
            "max-buffer-size)"
        )
        if self.max_boxes < self._max_bytes // 32:
            why = f"more are not possible with algorithm={self._algorithm!r}"
        raise ValueError(
            f"boxes: found {count} boxes, wanted at most {self.max_boxes}: {why}; split them, or use "
            "throng.find_pairs"
        )

    def _check_buffer(self, name: str, buffer: Any, size: int) -> None:
        wgpu = self._wgpu
        if not isinstance(buffer, wgpu.GPUBuffer):
            raise TypeError(f"{name}: found a {type(buffer).__name__}, wanted a wgpu.GPUBuffer")
        if getattr(buffer, "_device", self._device) is not self._device:
            raise ValueError(f"{name}: found a buffer of another device, wanted one of GpuFinder.device")
        if buffer.size < size:
            raise ValueError(f"{name}: found a buffer of {buffer.size} bytes, wanted at least {size}")
        if not buffer.usage & wgpu.BufferUsage.STORAGE:
            raise ValueError(
                f"{name}: found a buffer without the usage STORAGE; create it with wgpu.BufferUsage.STORAGE"
            )

    def _refuse(self, report: _Report, count: int) -> None:
        if report.nan_count and self._nan == "refuse":
            raise ValueError(
                f"boxes: {report.nan_count} of {count} boxes have a NaN, the first is box "
                f"{report.first_nan}; fix them, or pass nan='inactive'"
            )
        if report.inverted_count and self._inverted == "refuse":
            raise ValueError(
                f"boxes: {report.inverted_count} of {count} boxes have lower > upper, the first is box "
                f"{report.first_inverted}; fix them, or for empty slots pass inverted='inactive'"
            )


def _table_cells(count: int) -> int:
    return count * 9 // 4 + 1024


def _sizes(count: int, capacity: int, is_sorted: bool) -> tuple[dict[str, int], dict[str, int]]:
    """Workgroups of the steps, and bytes of the buffers, by the names in steps.json."""
    tiles = -(-count // _TILE)
    table_blocks = -(-(_table_cells(count) + _ROW_CELLS + 1) // _SCAN_BLOCK)
    row_blocks = -(-(count + 1) // _SCAN_BLOCK)
    workgroups = {
        "one": 1,
        "boxes_by_256": -(-count // 256),
        "boxes_by_64": -(-count // 64),
        "tiles": tiles * (tiles + 1) // 2,
        "table_blocks": table_blocks,
        "row_blocks": row_blocks,
        "pairs_by_256": min(-(-capacity // 256), 4096),
        "long_rows": min(-(-count // 64), 256),
    }
    bytes_of = {
        "parameters": 32,
        "boxes": 24 * count,
        "filters": 8 * count,
        "records": 32 * count,
        "grid": _GRID_BYTES,
        "table": 4 * _SCAN_BLOCK * table_blocks,
        "sums": 4 * max(table_blocks, row_blocks),
        "places": 8 * count,
        "pairs": 8 * capacity,
        "found": 8 * capacity,
        "firsts": 4 * _SCAN_BLOCK * row_blocks if is_sorted else 4,
        "rows": 4 * count,
        "report": _REPORT_BYTES,
        "counts": _COUNTS_BYTES,
    }
    return workgroups, bytes_of


def _default_device(wgpu: Any) -> Any:
    try:
        adapter = wgpu.gpu.request_adapter_sync(power_preference="high-performance")
    except RuntimeError as error:
        adapter, reason = None, f": {error}"
    else:
        reason = ""
    if adapter is None:
        raise RuntimeError(
            f"throng.webgpu found no GPU adapter{reason}; install a driver for Vulkan (on Linux without a "
            "GPU: mesa-vulkan-drivers), or use throng.find_pairs"
        )
    return adapter.request_device_sync()


def _choice(name: str, value: Any, wanted: tuple[str, ...]) -> str:
    if isinstance(value, str) and value in wanted:
        return value
    kind = ValueError if isinstance(value, str) else TypeError
    raise kind(f"{name}: found {value!r:.60}, wanted one of {', '.join(map(repr, wanted))}")


def _whole(name: str, value: Any, most: int) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, numpy.integer)):
        raise TypeError(f"{name}: found {value!r:.60}, wanted an integer from 0 to {most}")
    if not 0 <= value <= most:
        raise ValueError(f"{name}: found {value}, wanted an integer from 0 to {most}")
    return int(value)


def _as_floats(array: Any, name: str) -> NDArray[numpy.float32]:
    found = numpy.asarray(array)
    if found.dtype == numpy.float32:
        return found
    if found.dtype != numpy.float64:
        raise TypeError(f"{name}: found {found.dtype}, wanted float32")
    with numpy.errstate(over="ignore"):
        exact = found.astype(numpy.float32)
    if not numpy.array_equal(exact, found, equal_nan=True):
        raise ValueError(
            f"{name}: found float64 values that are no float32, wanted float32; round them, which may change "
            "pairs, or use throng.find_pairs, which compares float64"
        )
    return exact


def _as_boxes(boxes: Any) -> NDArray[numpy.float32]:
    """Contiguous (n, 6)."""
    if isinstance(boxes, tuple):
        if len(boxes) != 2:
            raise ValueError(f"boxes: found a tuple of {len(boxes)}, wanted (lower, upper)")
        lower, upper = _as_floats(boxes[0], "boxes[0]"), _as_floats(boxes[1], "boxes[1]")
        if lower.shape != upper.shape or lower.ndim != 2 or lower.shape[1] not in (2, 3):
            raise ValueError(
                f"boxes: found shapes {lower.shape} and {upper.shape}, wanted two of (n, 3), or of (n, 2)"
            )
    else:
        array = _as_floats(boxes, "boxes")
        if array.ndim == 2 and array.shape[1] in (4, 6):
            half = array.shape[1] // 2
            lower, upper = array[:, :half], array[:, half:]
        elif array.ndim == 3 and array.shape[1] == 2 and array.shape[2] in (2, 3):
            lower, upper = array[:, 0], array[:, 1]
        else:
            raise ValueError(
                f"boxes: found shape {array.shape}, wanted (n, 6), (n, 4), (n, 2, 3), (n, 2, 2), or a tuple "
                "(lower, upper)"
            )
        if array.ndim == 2 and array.shape[1] == 6 and array.flags.c_contiguous:
            return array
    out = numpy.zeros((len(lower), 6), numpy.float32)
    out[:, : lower.shape[1]] = lower
    out[:, 3 : 3 + lower.shape[1]] = upper
    return out


def _as_filters(group: Any, mask: Any, count: int) -> NDArray[numpy.uint32] | None:
    """(n, 2): group and mask."""
    if group is None and mask is None:
        return None
    out = numpy.full((count, 2), 0xFFFFFFFF, numpy.uint32)
    for column, (name, given) in enumerate((("group", group), ("mask", mask))):
        if given is None:
            continue
        values = numpy.asarray(given)
        if values.dtype.kind not in "iu":
            raise TypeError(f"{name}: found {values.dtype}, wanted integers from 0 to {2**32 - 1}")
        if values.ndim and values.shape != (count,):
            raise ValueError(f"{name}: found shape {values.shape}, wanted ({count},), one value per box")
        if values.size and not (0 <= int(values.min()) and int(values.max()) < 2**32):
            raise ValueError(
                f"{name}: found {int(values.min())} to {int(values.max())}, wanted integers from 0 to "
                f"{2**32 - 1}"
            )
        out[:, column] = values
    return out
