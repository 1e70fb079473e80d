"""Arrays of other libraries: their streams, and results of their type."""

import sys
from typing import Any

import numpy

from throng._types import BoxesLike


def _library(array: object) -> tuple[str, Any]:
    """Name and module of an array's library; for a subclass those of its base."""
    for cls in type(array).__mro__:
        name = cls.__module__.partition(".")[0]
        if name in ("torch", "cupy", "numpy"):
            return name, sys.modules[name]
    name = type(array).__module__.partition(".")[0]
    return name, sys.modules.get(name)


def _first(boxes: BoxesLike) -> Any:
    return boxes[0] if isinstance(boxes, tuple) and boxes else boxes


def stream_address(stream: object, boxes: BoxesLike) -> int:
    """A stream's address; 0: the default stream. None: the current stream of the array's library."""
    if stream is None:
        array = _first(boxes)
        if type(array) is numpy.ndarray:
            return 0
        name, library = _library(array)
        if name == "torch" and array.is_cuda:
            return int(library.cuda.current_stream(array.device).cuda_stream)
        if name == "cupy":
            return int(library.cuda.get_current_stream(array.device.id).ptr)
        return 0
    address: Any = stream
    if hasattr(stream, "__cuda_stream__"):
        address = stream.__cuda_stream__()[1]
    else:
        for attribute in ("cuda_stream", "ptr"):  # of PyTorch, of CuPy
            address = getattr(stream, attribute, address)
    if isinstance(address, bool) or not isinstance(address, int):
        raise TypeError(
            f"stream: found a {type(stream).__name__}, wanted a CUDA stream of PyTorch, CuPy or "
            "cuda.core, or its address as an int"
        )
    if not 0 <= address < 2**64:
        raise ValueError(f"stream: found {address}, wanted the address of a CUDA stream")
    return address


def like(found: Any, boxes: BoxesLike, result: object, dtype: object = "uint32") -> Any:
    """The integers as `result` and `dtype` request: possibly an array of the boxes' library."""
    is_host = isinstance(found, numpy.ndarray)
    if is_host and dtype != "uint32":
        found = found.astype(numpy.int64, copy=False)
    if result == "numpy" or (result == "auto" and is_host):
        return found
    array = _first(boxes)
    if is_host and isinstance(array, (numpy.ndarray, list, tuple)):
        return found
    name, library = _library(array)
    if hasattr(array, "__array_namespace__"):
        library = array.__array_namespace__()
    make = getattr(library, "from_dlpack", None)
    if make is not None:
        made = make(found)
        if is_host or dtype == "uint32":
            return made
        return made.to(library.int64) if hasattr(made, "to") else made.astype(library.int64)
    if result == "auto" and dtype == "uint32":
        return found  # already a DLPack producer
    wanted = "'same'" if result == "same" else "dtype 'int64'"
    raise TypeError(
        f"result: found {wanted} for boxes in a {type(array).__name__}, and {name} has no "
        "from_dlpack; give 'numpy'" + (" or 'auto'" if result == "same" else "")
    )


def check_result(result: object) -> None:
    if isinstance(result, str) and result in ("auto", "numpy", "same"):
        return
    kind = ValueError if isinstance(result, str) else TypeError
    raise kind(f"result: found {result!r:.60}, wanted one of 'auto', 'numpy', 'same'")


def integer_type(dtype: object) -> str:
    """'uint32' or 'int64'."""
    if isinstance(dtype, str) and dtype in ("uint32", "int64"):
        return dtype
    try:
        name = numpy.dtype(dtype).name  # type: ignore[call-overload]
    except TypeError:
        name = ""
    if dtype is not None and name in ("uint32", "int64"):
        return str(name)
    raise ValueError(f"dtype: found {dtype!r:.60}, wanted 'uint32' or 'int64'")
