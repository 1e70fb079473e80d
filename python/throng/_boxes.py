"""Boxes in the formats of other libraries: centers and sizes, intervals."""

from typing import Any

import numpy
from numpy.typing import ArrayLike, NDArray


def boxes_from_center(center: ArrayLike, size: ArrayLike) -> NDArray[numpy.float32]:
    """Boxes around centers.

    center: (n, 3), or (n, 2) for 2-D.
    size: the full extent on each axis, not half of it; the same shape, or one that broadcasts to it,
        such as one number.

    Returns (n, 6) float32, or (n, 4): center - size / 2 rounded down, center + size / 2 rounded up, so
    that each box contains the exact one. Raises ValueError for a negative size.
    """
    middle = _floats(center, "center")
    if middle.ndim != 2 or middle.shape[1] not in (2, 3):
        raise ValueError(f"center: found shape {middle.shape}, wanted (n, 3), or (n, 2) for 2-D")
    full = _floats(size, "size")
    try:
        half = numpy.broadcast_to(full, middle.shape) / 2
    except ValueError:
        raise ValueError(
            f"size: found shape {full.shape}, wanted that of center, {middle.shape}, or one number"
        ) from None
    bad = numpy.flatnonzero((half < 0).any(axis=1))
    if bad.size:
        raise ValueError(f"size: {bad.size} are negative, the first is at {bad[0]}; wanted 0 or more")
    return numpy.concatenate([down(*two_sum(middle, -half)), -down(*two_sum(-middle, -half))], axis=1)


def boxes_from_intervals(
    xmin: ArrayLike,
    xmax: ArrayLike,
    ymin: ArrayLike,
    ymax: ArrayLike,
    zmin: ArrayLike | None = None,
    zmax: ArrayLike | None = None,
) -> NDArray[numpy.float32]:
    """Boxes from one interval per axis, in VTK's order: xmin, xmax, ymin, ymax, zmin, zmax.

    Each is (n,), or one number for all; without zmin and zmax the boxes are 2-D. For VTK's rows `b`,
    (n, 6): boxes_from_intervals(*b.T).

    Returns (n, 6) float32, or (n, 4): lower bounds rounded down, upper bounds up.
    """
    if (zmin is None) != (zmax is None):
        missing = "zmin" if zmin is None else "zmax"
        raise TypeError(f"{missing}: found None, wanted both zmin and zmax, or neither for 2-D")
    lower = [_floats(xmin, "xmin"), _floats(ymin, "ymin")]
    upper = [_floats(xmax, "xmax"), _floats(ymax, "ymax")]
    if zmin is not None and zmax is not None:
        lower.append(_floats(zmin, "zmin"))
        upper.append(_floats(zmax, "zmax"))
    try:
        columns = numpy.broadcast_arrays(*lower, *upper)
    except ValueError:
        shapes = ", ".join(str(a.shape) for a in (*lower, *upper))
        raise ValueError(f"bounds: found shapes {shapes}, wanted (n,) of each") from None
    rows = numpy.stack([numpy.atleast_1d(column) for column in columns], axis=-1)
    if rows.ndim != 2:
        raise ValueError(f"bounds: found shape {columns[0].shape}, wanted (n,) of each")
    d = len(lower)
    none = numpy.zeros((len(rows), d))
    return numpy.concatenate([down(rows[:, :d], none), -down(-rows[:, d:], none)], axis=1)


def _floats(value: Any, name: str) -> NDArray[numpy.float64]:
    array = numpy.asarray(value)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: found {array.dtype} of shape {array.shape}, wanted numbers")
    return array.astype(numpy.float64)


def two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """a + b and its rounding error (Knuth's two-sum); error 0 where infinite."""
    with numpy.errstate(invalid="ignore", over="ignore"):
        s = a + b
        part = s - a
        error = (a - (s - part)) + (b - part)
    return s, numpy.where(numpy.isfinite(s), error, 0)


def down(s: Any, error: Any) -> NDArray[numpy.float32]:
    """The largest float32 <= s + error."""
    with numpy.errstate(over="ignore"):
        nearest = s.astype(numpy.float32)
    above = (nearest > s) | ((nearest == s) & (error < 0))
    below: NDArray[numpy.float32] = numpy.nextafter(nearest, numpy.float32(-numpy.inf))
    out: NDArray[numpy.float32] = numpy.where(above, below, nearest)
    return out
