"""Results of the caller's array type, and arrays on a GPU."""

import ctypes
import sys
import types
from typing import Any

import numpy
import pytest
from dlpack import CUDA, MANAGED, ArrayOnDevice, OnlyDLPack, capsule, opened
from reference import as_pairs

import throng
from throng import _exchange, _throng

BOXES = numpy.array([[0, 0, 0, 2, 2, 2], [1, 1, 1, 3, 3, 3], [3, 3, 3, 4, 4, 4]], numpy.float32)
PAIRS = [(0, 1), (1, 2)]
on_gpu = ArrayOnDevice((CUDA, 1), BOXES)


def test_kinds() -> None:
    strict = pytest.importorskip("array_api_strict")
    boxes = strict.asarray(BOXES)
    assert type(throng.find_pairs(boxes)) is numpy.ndarray
    assert type(throng.find_pairs(BOXES, result="same")) is numpy.ndarray
    corners = boxes[:, :3], boxes[:, 3:]
    finder = throng.Finder()
    for found in (
        throng.find_pairs(boxes, result="same"),
        throng.find_pairs(corners, result="same"),
        finder.find(boxes, result="same"),
    ):
        assert type(found) is type(boxes) and found.dtype == strict.uint32
        assert as_pairs(numpy.asarray(found)) == PAIRS
    assert type(throng.find_pairs(boxes, result="numpy")) is numpy.ndarray


def test_invalid_result_kinds() -> None:
    with pytest.raises(TypeError, match="result: found 'same' for boxes in a memoryview, and builtins has"):
        view: Any = memoryview(BOXES)  # type: ignore[arg-type]
        throng.find_pairs(view, result="same")
    with pytest.raises(ValueError, match="result: found 'torch', wanted one of 'auto'"):
        throng.find_pairs(BOXES, result="torch")  # type: ignore[call-overload]
    with pytest.raises(TypeError, match="result: found 3, wanted"):
        throng.Finder().find(BOXES, result=3)  # type: ignore[call-overload]


def test_streams(monkeypatch: pytest.MonkeyPatch) -> None:
    class Tensor:
        __module__ = "torch"
        is_cuda = True
        device = "cuda:1"

        def __dlpack__(self) -> Any: ...

    class Array:
        __module__ = "cupy"
        device = types.SimpleNamespace(id=1)

        def __dlpack__(self) -> Any: ...

    class Mine(Tensor):
        __module__ = "my.own"

    current = {"cuda:1": types.SimpleNamespace(cuda_stream=77), 1: types.SimpleNamespace(ptr=88)}
    cuda = types.SimpleNamespace(
        current_stream=current.__getitem__, get_current_stream=current.__getitem__
    )
    for name in ("torch", "cupy"):
        monkeypatch.setitem(sys.modules, name, types.SimpleNamespace(cuda=cuda))
    address = _exchange.stream_address
    assert address(None, Tensor()) == address(None, (Mine(), Mine())) == 77
    assert address(None, Array()) == 88
    assert address(None, BOXES) == address(None, OnlyDLPack(BOXES)) == 0
    assert address(12345, BOXES) == 12345
    assert address(current["cuda:1"], BOXES) == 77 and address(current[1], BOXES) == 88
    protocol = types.SimpleNamespace(__cuda_stream__=lambda: (0, 99))
    assert address(protocol, BOXES) == 99
    for wrong in ("main", 1.5, True, BOXES):
        with pytest.raises(TypeError, match="stream: found a"):
            throng.find_pairs(BOXES, stream=wrong)
    with pytest.raises(ValueError, match="stream: found -1"):
        throng.find_pairs(BOXES, stream=-1)


def test_only_the_host() -> None:
    """CPU-only calls refuse GPU arrays without reading their memory."""
    finder = throng.Finder()
    live = throng.BroadPhase()
    for call in (
        lambda: finder.consume(on_gpu, print),
        lambda: finder.explain(on_gpu),
        lambda: live.add(on_gpu),
        lambda: live.find_overlaps(on_gpu),
        lambda: throng.update_boxes(on_gpu, [throng.sphere(1)]),
        lambda: throng.save_boxes("/nowhere/boxes.npy", on_gpu),
    ):
        with pytest.raises(ValueError, match="found an array on cuda:1, which this call cannot use; copy"):
            call()
    with pytest.raises(ValueError, match=r"found an array on cuda:0"):
        finder.explain(capsule(BOXES, 4096, (CUDA, 0)))
    assert on_gpu.streams == []


def test_mixed_devices() -> None:
    on_host = OnlyDLPack(BOXES)
    kind = "cannot use|this build searches on the CPU alone" if not _throng.has_cuda else "lies on"
    calls: list[tuple[Any, Any, Any]] = [
        (on_host, on_gpu, None),
        (on_gpu, on_host, None),
        ((BOXES[:, :3], ArrayOnDevice((CUDA, 0), BOXES[:, 3:])), None, None),
        (on_host, None, ArrayOnDevice((CUDA, 0), numpy.ones(3, numpy.uint32))),
    ]
    for boxes, other, group in calls:
        with pytest.raises(ValueError, match=kind):
            throng.find_pairs(boxes, other, group=group)


def test_an_array_with_a_wrong_device() -> None:
    class WrongDevice(ArrayOnDevice):
        def __dlpack_device__(self) -> Any:
            return (1, 0)

    with pytest.raises(TypeError, match="__dlpack_device__ says the CPU, its __dlpack__ gives cuda:1"):
        throng.find_pairs(WrongDevice((CUDA, 1), BOXES))


@pytest.mark.skipif(_throng.has_cuda, reason="this build has a GPU backend")
def test_without_a_gpu_backend() -> None:
    for boxes in (on_gpu, ArrayOnDevice((MANAGED, 1), BOXES), capsule(BOXES, 4096, (CUDA, 1))):
        with pytest.raises(ValueError, match="boxes: found an array on cuda:1, and this build searches on "
                           "the CPU alone; build with THRONG_CUDA=ON, or copy it to the host"):  # fmt: skip
            throng.find_pairs(boxes)


@pytest.mark.skipif(not _throng.has_cuda, reason="this build has no GPU backend")
def test_refused_before_gpu_access() -> None:
    def refuses(kind: type[Exception], text: str, boxes: Any, *args: Any, **named: Any) -> None:
        with pytest.raises(kind, match=text):
            throng.find_pairs(boxes, *args, **named)

    device_array = ArrayOnDevice((CUDA, 0), BOXES)
    refuses(ValueError, "backend: found 'cpu' for boxes on cuda:0", device_array, backend="cpu", stream=55)
    assert device_array.streams == [55]
    refuses(ValueError, "backend: found 'emulated'", device_array, backend="emulated")
    assert device_array.streams[-1] == 1  # the default stream, in DLPack's numbers
    doubles = ArrayOnDevice((CUDA, 0), BOXES.astype(float))
    refuses(TypeError, "found float64 .* on cuda:0, where values", doubles)
    refuses(TypeError, "boxes: found float64 .* on cuda:0, where values", doubles, round="exact")
    refuses(TypeError, "other: found float64 .* on cuda:0, where values", device_array, doubles, round="exact")
    refuses(ValueError, r"found float32 of shape \(3, 5\)", ArrayOnDevice((CUDA, 0), BOXES[:, :5]))
    refuses(ValueError, "rows run backwards", ArrayOnDevice((CUDA, 0), BOXES[::-1]))
    longs = ArrayOnDevice((CUDA, 0), numpy.ones(3, numpy.int64))
    refuses(TypeError, "world: found int64 .* on cuda:0, where values", device_array, world=longs)
    other = ArrayOnDevice((CUDA, 1), BOXES)
    refuses(ValueError, "other: found an array on cuda:1, and boxes lies on cuda:0", device_array, other)


class Driver:
    """GPU memory by the driver API alone. OSError if there is no GPU."""

    def __init__(self) -> None:
        self.lib = ctypes.CDLL("libcuda.so.1")
        device, context = ctypes.c_int(), ctypes.c_void_p()
        if self.lib.cuInit(0) or self.lib.cuDeviceGet(ctypes.byref(device), 0):
            raise OSError("no GPU")
        self.need(self.lib.cuDevicePrimaryCtxRetain(ctypes.byref(context), device))
        self.need(self.lib.cuCtxSetCurrent(context))

    @staticmethod
    def need(error: int) -> None:
        assert error == 0, f"CUDA error {error}"

    def put(self, values: Any) -> ArrayOnDevice:
        address = ctypes.c_uint64()
        size = ctypes.c_size_t(max(values.nbytes, 1))
        self.need(self.lib.cuMemAlloc_v2(ctypes.byref(address), size))
        data = ctypes.c_void_p(values.ctypes.data)
        self.need(self.lib.cuMemcpyHtoD_v2(address, data, ctypes.c_size_t(values.nbytes)))
        return ArrayOnDevice((CUDA, 0), values, address.value)

    def get(self, found: Any) -> Any:
        assert found.__dlpack_device__() == (CUDA, 0)
        held = found.__dlpack__()
        tensor = opened(held)
        assert (tensor.ndim, tensor.code, tensor.bits, tensor.shape[1]) == (2, 1, 32, 2)
        values = numpy.empty((tensor.shape[0], 2), numpy.uint32)
        size, data = ctypes.c_size_t(values.nbytes), ctypes.c_void_p(values.ctypes.data)
        self.need(self.lib.cuMemcpyDtoH_v2(data, ctypes.c_uint64(tensor.data), size))
        return values


def test_on_a_gpu() -> None:
    if not _throng.has_cuda:
        pytest.skip("this build has no GPU backend")
    try:
        gpu = Driver()
    except OSError as reason:
        with pytest.raises(RuntimeError, match="no GPU can be used"):
            throng.find_pairs(ArrayOnDevice((CUDA, 0), BOXES))
        pytest.skip(str(reason))
    finder = throng.Finder(order="canonical")
    for name, objects in (("uniform", 50000), ("pile", 20000), ("uniform", 10)):
        boxes = throng.scene(name, objects)[0]
        wanted = throng.find_pairs(boxes, order="canonical")
        there = gpu.put(boxes)
        assert numpy.array_equal(gpu.get(finder.find(there)), wanted)
        assert finder.result.plan.backend == "cuda" and finder.memory_bytes > 0
        assert numpy.array_equal(finder.find(there, result="numpy"), wanted)
        half = gpu.put(numpy.arange(objects, dtype=numpy.int32) % 2)
        found = throng.find_pairs(there, world=half, order="canonical")
        same = throng.find_pairs(boxes, world=half.values, order="canonical")
        assert numpy.array_equal(gpu.get(found), same)
        two = throng.find_pairs(there, gpu.put(boxes[:9]), order="canonical")
        assert numpy.array_equal(gpu.get(two), throng.find_pairs(boxes, boxes[:9], order="canonical"))
    with pytest.raises(ValueError, match="the first is box 1; .* nan='inactive'"):
        throng.find_pairs(gpu.put(BOXES * numpy.array([[1], [numpy.nan], [1]], numpy.float32)))
