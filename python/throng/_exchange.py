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


def like(found: Any, boxes: BoxesLike, result: object) -> Any:
    """The pairs as `result` requests: possibly an array of the boxes' library."""
    is_host = isinstance(found, numpy.ndarray)
    if result == "numpy" or (result == "auto" and is_host):
        return found
    array = _first(boxes)
    if is_host and isinstance(array, numpy.ndarray):
        return found
    name, library = _library(array)
    if hasattr(array, "__array_namespace__"):
        library = array.__array_namespace__()
    make = getattr(library, "from_dlpack", None)
    if make is not None:
        return make(found)
    if result == "auto":
        return found  # already a DLPack producer
    raise TypeError(
        f"result: found 'same' for boxes in a {type(array).__name__}, and {name} has no "
        "from_dlpack; give 'numpy' or 'auto'"
    )


def check_result(result: object) -> None:
    if isinstance(result, str) and result in ("auto", "numpy", "same"):
        return
    kind = ValueError if isinstance(result, str) else TypeError
    raise kind(f"result: found {result!r:.60}, wanted one of 'auto', 'numpy', 'same'")
