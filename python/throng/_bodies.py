"""From transforms and shapes to boxes."""

from collections.abc import Sequence
from typing import Any, cast

import numpy
from numpy.typing import NDArray

from throng import _throng
from throng._boxes import down, two_sum
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
    rotation: Array | Sequence[Any] | None = None,
    displacement: Array | Sequence[Any] | None = None,
    shape: Array | Sequence[int] | None = None,
    points: Array | Sequence[Any] | None = None,
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

    Lists and float64 are accepted, and a box contains the body as given: float64 positions and
    displacements are added as they are, and the sum is rounded outward. float64 rotations and points are
    rounded to float32, and the box extended by as much as that may move the body: of a unit quaternion at
    most 1e-6 of the largest distance of its shape from its origin.

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
    place, way = _as_numpy(position), _as_numpy(displacement)
    turn, corner = _as_numpy(rotation), _as_numpy(points)
    if all(_is_exact(given) for given in (place, way, turn, corner)):
        return _throng.update_boxes(place, rows, turn, way, shape, corner, margin, threads)
    # Boxes of bodies at the origin; zeros have the shapes, which the module checks.
    zeros = [_zeros(given) for given in (place, way)]
    turn32, corner32 = _nearest(turn), _nearest(corner)
    around = _throng.update_boxes(zeros[0], rows, turn32, zeros[1], shape, corner32, margin, threads)
    grow = _growth(array.reshape(-1), len(around), shape, turn, corner)
    return _placed(around.astype(numpy.float64), place, way, grow)


def _as_numpy(values: Any) -> Any:
    """float64 and lists as NumPy arrays; other arguments as they are."""
    if isinstance(values, (list, tuple)):
        try:
            made = numpy.asarray(values)
        except ValueError:
            return values
        return made.astype(numpy.float64) if made.dtype.kind in "iu" or made.size == 0 else made
    if isinstance(values, numpy.ndarray) or not str(getattr(values, "dtype", "")).endswith("float64"):
        return values
    return numpy.from_dlpack(values.detach() if hasattr(values, "detach") else values)


def _zeros(values: Any) -> Any:
    return None if values is None else numpy.zeros(numpy.shape(values), numpy.float32)


def _nearest(values: Any) -> Any:
    if not isinstance(values, numpy.ndarray) or values.dtype != numpy.float64:
        return values
    with numpy.errstate(over="ignore"):
        return values.astype(numpy.float32)


def _error(values: Any) -> NDArray[numpy.float64]:
    """By how much rounding to float32 moves each value."""
    with numpy.errstate(invalid="ignore"):
        error: NDArray[numpy.float64] = numpy.abs(values - _nearest(values).astype(numpy.float64))
    kept: NDArray[numpy.float64] = numpy.where(numpy.isfinite(values), error, 0)
    return kept


def _is_exact(values: Any) -> bool:
    """Not float64, or float64 each of which is a float32."""
    if not isinstance(values, numpy.ndarray) or values.dtype != numpy.float64:
        return True
    return not bool(_error(values).any())


def _growth(
    shapes: NDArray[Any], n: int, shape: Any, rotation: Any, points: Any
) -> NDArray[numpy.float64]:
    """(n, 1): by how much rounding of rotations and points may move a body."""
    reach = (numpy.abs(shapes["center"]) + shapes["half_extents"]).max(axis=1, initial=0).astype(numpy.float64)
    moved = numpy.zeros(len(shapes))
    if points is not None:
        corner = numpy.asarray(points, numpy.float64)
        for k in numpy.flatnonzero(shapes["kind"] == 1):
            first, count = int(shapes["first_point"][k]), int(shapes["point_count"][k])
            some = corner[first : first + count]
            reach[k] = numpy.abs(some).max(initial=0)
            moved[k] = numpy.sqrt(3) * _error(some).max(initial=0)
    which: Any = numpy.zeros(n, int) if len(shapes) == 1 else numpy.arange(n)
    if shape is not None:
        which = numpy.broadcast_to(numpy.asarray(shape), (n,))
    if n == 0 or rotation is None:
        alone: NDArray[numpy.float64] = moved[which].reshape(n, 1)
        return alone
    turn = numpy.asarray(rotation, numpy.float64)
    square = (turn * turn).sum(axis=1)
    # Each product of two components changes by 2**-23 of itself; a row of the matrix has at most
    # 4 square of them, and a coordinate changes by that times the reach. Twice that for what is
    # rounded here.
    of_turn = numpy.where(_error(turn).any(axis=1), square * 2.0**-20 * reach[which], 0)
    both: NDArray[numpy.float64] = (of_turn + (1 + 3 * square) * moved[which]).reshape(n, 1)
    return both


def _placed(around: Any, position: Any, displacement: Any, grow: Any) -> NDArray[numpy.float32]:
    """Boxes around the origin, grown, at their places: rounded outward."""
    place = numpy.asarray(position, numpy.float64)
    is_finite = numpy.isfinite(place).all(axis=1)
    low, high = place, place
    with numpy.errstate(invalid="ignore", over="ignore"):
        if displacement is not None:
            way = numpy.asarray(displacement, numpy.float64)
            is_finite &= numpy.isfinite(way).all(axis=1)
            end, error = two_sum(place, way)
            low = numpy.minimum(low, numpy.where(error < 0, numpy.nextafter(end, -numpy.inf), end))
            high = numpy.maximum(high, numpy.where(error > 0, numpy.nextafter(end, numpy.inf), end))
        lower, upper = around[:, :3], around[:, 3:]
        lower = numpy.where(grow > 0, numpy.nextafter(lower - grow, -numpy.inf), lower)
        upper = numpy.where(grow > 0, numpy.nextafter(upper + grow, numpy.inf), upper)
        # An empty hull stays empty.
        is_empty = (around[:, :3] > around[:, 3:]).any(axis=1)
        boxes = numpy.concatenate([down(*two_sum(low, lower)), -down(*two_sum(-high, -upper))], axis=1)
    boxes[is_empty] = around[is_empty].astype(numpy.float32)
    boxes[~is_finite] = numpy.nan
    return boxes
