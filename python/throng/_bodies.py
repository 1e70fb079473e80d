"""From transforms and shapes to boxes."""

from collections.abc import Sequence
from typing import Any, cast

import numpy
from numpy.typing import NDArray

from throng import _throng
from throng._numbers import number, numbers, whole
from throng._types import Array

shape_type: numpy.dtype[Any] = numpy.dtype(
    [
        ("kind", numpy.uint32),  # 0: box, 1: convex
        ("center", numpy.float32, 3),
        ("half_extents", numpy.float32, 3),
        ("radius", numpy.float32),
        ("first_point", numpy.uint32),
        ("point_count", numpy.uint32),
    ]
)
"""A shape in its body's frame, extended by a sphere of `radius`."""

Vector = Sequence[float]


def box(half_extents: Vector, center: Vector = (0, 0, 0)) -> numpy.void:
    """A box; half extents may be 0 or infinite: a plane is a box that is infinite along two axes."""
    half = numbers(half_extents, "half_extents", (3,), infinite=True)
    return _shape((0, _center(center), half, 0, 0, 0))


def sphere(radius: float, center: Vector = (0, 0, 0)) -> numpy.void:
    """A sphere."""
    return _shape((0, _center(center), (0, 0, 0), number(radius, "radius", infinite=True), 0, 0))


def capsule(half_length: float, radius: float, center: Vector = (0, 0, 0)) -> numpy.void:
    """A capsule along y; half_length without the caps."""
    half = (0, number(half_length, "half_length", infinite=True), 0)
    return _shape((0, _center(center), half, number(radius, "radius", infinite=True), 0, 0))


def convex(first_point: int, point_count: int, radius: float = 0) -> numpy.void:
    """The convex hull of points[first_point : first_point + point_count]."""
    first, count = whole(first_point, "first_point"), whole(point_count, "point_count")
    return _shape((1, (0, 0, 0), (0, 0, 0), number(radius, "radius", infinite=True), first, count))


def _center(center: object) -> list[float]:
    return numbers(center, "center", (3,))


def _shape(values: tuple[object, ...]) -> numpy.void:
    return cast(numpy.void, numpy.array(values, shape_type)[()])


def update_boxes(
    position: Array | Sequence[Any],
    shapes: NDArray[Any] | Sequence[numpy.void],
    *,
    rotation: Array | None = None,
    displacement: Array | None = None,
    shape: Array | None = None,
    points: Array | None = None,
    margin: float = 0.0,
    threads: int = 0,
) -> NDArray[numpy.float32]:
    """The boxes of bodies; each contains its body, tightly.

    position: (n, 3) float32.
    shapes: a list of shapes by box(), sphere(), capsule() and convex(), or an array of shape_type;
        one per body, one for all, or with `shape` any number.
    rotation: (n, 4) float32 unit quaternions x, y, z, w; None: no rotation.
    displacement: (n, 3) float32; a box covers its body's straight path along it.
    shape: (n,) uint32: index into `shapes`.
    points: (k, 3) float32, of convex shapes.
    margin: added to every radius.

    float64 is copied to float32, if every value is a float32.

    Returns (n, 6) float32: lower x, y, z, upper x, y, z. A transform that is not finite gives a box
    with a NaN. Raises TypeError or ValueError that names the argument, or the first bad shape.
    Ctrl-C interrupts a long call.
    """
    array = numpy.ascontiguousarray(shapes)
    if array.size == 0:
        array = numpy.zeros(0, shape_type)
    if array.dtype != shape_type:
        raise TypeError(
            f"shapes: found {array.dtype} of shape {array.shape}, wanted throng.shape_type; "
            "throng.box(), sphere(), capsule() and convex() make such"
        )
    rows = array.reshape(-1).view(numpy.float32).reshape(-1, 10)
    return _throng.update_boxes(
        position, rows, rotation, displacement, shape, points, margin, threads
    )
