"""Arrays as other libraries make them: DLPack, with any device type."""

import ctypes
from typing import Any

from numpy.typing import NDArray

CPU, CUDA, MANAGED = 1, 2, 13
CODES = {"i": 0, "u": 1, "f": 2, "c": 5, "b": 6}


class Tensor(ctypes.Structure):
    _fields_ = [
        ("data", ctypes.c_void_p),
        ("device_type", ctypes.c_int32),
        ("device_id", ctypes.c_int32),
        ("ndim", ctypes.c_int32),
        ("code", ctypes.c_uint8),
        ("bits", ctypes.c_uint8),
        ("lanes", ctypes.c_uint16),
        ("shape", ctypes.POINTER(ctypes.c_int64)),
        ("strides", ctypes.POINTER(ctypes.c_int64)),
        ("byte_offset", ctypes.c_uint64),
    ]


class Managed(ctypes.Structure):
    _fields_ = [
        ("tensor", Tensor),
        ("context", ctypes.c_void_p),
        ("deleter", ctypes.c_void_p),
    ]


_new = ctypes.pythonapi.PyCapsule_New
_new.restype = ctypes.py_object
_new.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
_pointer = ctypes.pythonapi.PyCapsule_GetPointer
_pointer.restype = ctypes.c_void_p
_pointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
_kept: list[Any] = []  # what capsules point to: few and small


def capsule(like: NDArray[Any], address: int, device: tuple[int, int]) -> Any:
    """A DLPack capsule of `like`'s shape, strides and type."""
    dims = ctypes.c_int64 * like.ndim
    made = Managed()
    made.tensor = Tensor(
        address,
        *device,
        like.ndim,
        CODES[like.dtype.kind],
        8 * like.itemsize,
        1,
        dims(*like.shape),
        dims(*(s // like.itemsize for s in like.strides)),
        0,
    )
    _kept.extend((made, like))
    return _new(ctypes.addressof(made), b"dltensor", None)


def opened(of: Any) -> Tensor:
    """What a capsule holds."""
    tensor: Tensor = Managed.from_address(_pointer(of, b"dltensor")).tensor
    return tensor


class ArrayOnDevice:
    """An array with a device type; its values are at `address`, by default an invalid one."""

    def __init__(self, device: Any, values: Any = None, address: int = 4096) -> None:
        self.device, self.values, self.address = device, values, address
        self.streams: list[Any] = []

    def __dlpack_device__(self) -> Any:
        return self.device

    def __dlpack__(self, *, stream: int | None = None, **_: Any) -> Any:
        self.streams.append(stream)
        assert self.values is not None, "not to be requested"
        return capsule(self.values, self.address, self.device)


class OnlyDLPack:
    """As from a library other than NumPy."""

    def __init__(self, values: Any) -> None:
        self.values = values

    def __dlpack_device__(self) -> Any:
        return (CPU, 0)

    def __dlpack__(self, **_: Any) -> Any:
        return self.values.__dlpack__()
