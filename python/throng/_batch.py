"""Boxes of many worlds in one array: (worlds, n, 6)."""

from dataclasses import dataclass
from typing import Any

import numpy
from numpy.typing import NDArray

from throng import _throng

FILTERS = "group", "mask", "owner", "world", "static"


@dataclass(frozen=True)
class Batch:
    """The shape of boxes whose first index is a world."""

    worlds: int
    count: int  # boxes per world


def refuse_hidden(values: Any, name: str) -> None:
    """Hidden values of masked arrays, also of those in a list, would be read as if they were not."""
    for value in values if isinstance(values, (list, tuple)) else [values]:
        if isinstance(value, numpy.ma.MaskedArray) and numpy.ma.is_masked(value):
            raise ValueError(
                f"{name}: found a masked array that hides values, wanted no hidden values; fill them: "
                f"numpy.ma.filled({name}, value)"
            )


def _shape(array: Any) -> tuple[int, ...]:
    shape = getattr(array, "shape", None)
    return tuple(shape) if shape is not None else ()


def _is_on_host(array: Any) -> bool:
    device = getattr(array, "__dlpack_device__", None)
    return device is None or device()[0] in (1, 3)  # DLPack's CPU, pinned memory


def _reshaped(array: Any, row: tuple[int, ...]) -> Any:
    """The array with one index for all rows; a view, if its layout allows that."""
    if not hasattr(array, "reshape"):
        array = numpy.from_dlpack(array)
    return array.reshape(array.shape[0] * array.shape[1], *row)


def flattened(boxes: Any, name: str) -> tuple[Any, Batch | None]:
    """Boxes without the index of the world, and the batch if they had one. Lists become arrays."""
    if type(boxes) is numpy.ndarray and boxes.ndim == 2:
        return boxes, None
    if isinstance(boxes, list):
        refuse_hidden(boxes, name)
    boxes = _throng.boxes_of_lists(boxes, name)
    if isinstance(boxes, tuple):
        shapes = [_shape(corner) for corner in boxes]
        if len(boxes) != 2 or any(len(s) != 3 or s[2] not in (2, 3) for s in shapes) or shapes[0] != shapes[1]:
            return boxes, None
        if not all(_is_on_host(corner) for corner in boxes):
            return boxes, None
        return tuple(_reshaped(corner, shapes[0][2:]) for corner in boxes), Batch(*shapes[0][:2])
    shape = _shape(boxes)
    of_rows = len(shape) == 3 and shape[2] in (4, 6)
    of_corners = len(shape) == 4 and shape[2] == 2 and shape[3] in (2, 3)
    # On a GPU no values are made: the message of the module says what to do.
    if not (of_rows or of_corners) or not _is_on_host(boxes):
        return boxes, None
    return _reshaped(boxes, shape[2:]), Batch(*shape[:2])


def with_worlds(batch: Batch, filters: tuple[Any, ...], prefix: str) -> tuple[Any, ...]:
    """The filters of all boxes of a batch: one value per box, per box of a world, or for all."""
    if filters[3] is not None:
        raise ValueError(
            f"{prefix}world: found a value for boxes of shape (worlds, n, ...), where the first index is "
            "the world, wanted None; to choose worlds, give boxes of shape (n, 6)"
        )
    whole = batch.worlds, batch.count
    flat: list[Any] = []
    for name, values in zip(FILTERS, filters):
        refuse_hidden(values, prefix + name)
        if isinstance(values, (list, tuple)):
            values = numpy.asarray(values)
        shape = _shape(values)
        if shape == whole:
            values = values.reshape(-1)
        elif shape == (batch.count,):
            values = numpy.tile(numpy.asarray(values), batch.worlds)
        elif shape:
            raise ValueError(
                f"{prefix}{name}: found shape {shape}, wanted {whole}, ({batch.count},) for each world, "
                "or one number"
            )
        flat.append(values)
    flat[3] = numpy.repeat(numpy.arange(batch.worlds, dtype=numpy.int32), batch.count)
    return tuple(flat)


def triples(pairs: NDArray[Any], batch: Batch, other: Batch | None, is_one_set: bool) -> NDArray[Any]:
    """(m, 3): world, and the indices of both boxes in it, of pairs of flat indices."""
    count = pairs.dtype.type(max(batch.count, 1))
    out = numpy.empty((len(pairs), 3), pairs.dtype)
    world = pairs[:, 0] // count
    out[:, 0] = world
    out[:, 1] = pairs[:, 0] - world * count
    second = batch if is_one_set else other
    out[:, 2] = pairs[:, 1] if second is None else pairs[:, 1] - world * pairs.dtype.type(second.count)
    return out
