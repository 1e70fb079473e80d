"""The double loop, by NumPy, and random boxes for tests."""

import math
from fractions import Fraction
from typing import Any

import numpy
from hypothesis import strategies as st
from numpy.typing import NDArray

import throng

Pairs = list[tuple[int, int]]
INF = float("inf")
NAN = float("nan")

# Few values, so that boxes touch, coincide, are inverted, empty and infinite.
coordinate = st.sampled_from([-INF, -2.5, -1.0, -0.0, 0.0, 1e-45, 0.5, 1.0, 2.0, 3.0, 3.4e38, INF])
any_coordinate = coordinate | st.just(NAN) | st.floats(width=32)


def stepped(x: float, steps: int) -> float:
    """x, moved by this many float64 steps."""
    for _ in range(abs(steps)):
        x = math.nextafter(x, math.copysign(INF, steps))
    return x


# float64 that touch, or miss each other by one step, at small and large magnitudes.
double = st.builds(stepped, st.sampled_from([-1e9, 0.0, 0.1, 1.0, 1e9, 1e9 + 1e-6]), st.integers(-2, 2))
double |= st.sampled_from([-INF, -1e300, 1e300, INF])


def double_rows(columns: int = 6, most: int = 24, value: Any = double) -> Any:
    """Arrays (n, columns) of float64."""
    return box_rows(columns, most, value, numpy.float64)


def box_rows(columns: int = 6, most: int = 24, value: Any = coordinate, kind: Any = numpy.float32) -> Any:
    """Arrays (n, columns) of `kind`."""
    row = st.lists(value, min_size=columns, max_size=columns)
    return st.lists(row, max_size=most).map(
        lambda rows: numpy.array(rows, kind).reshape(-1, columns)
    )


def overlap(a: NDArray[Any], b: NDArray[Any]) -> NDArray[numpy.bool_]:
    """(n, m): whether box i of a overlaps box j of b. NaN and inverted boxes overlap nothing."""
    d = a.shape[1] // 2
    active: list[Any] = [(x[:, :d] <= x[:, d:]).all(axis=1) for x in (a, b)]
    meet = (a[:, None, :d] <= b[None, :, d:]) & (b[None, :, :d] <= a[:, None, d:])
    met: NDArray[numpy.bool_] = meet.all(axis=2) & active[0][:, None] & active[1][None, :]
    return met


def pairs_of(met: NDArray[numpy.bool_], one_set: bool) -> Pairs:
    """Sorted pairs; with one set only first < second."""
    if one_set:
        met = numpy.triu(met, 1)
    return [(int(i), int(j)) for i, j in zip(*numpy.nonzero(met))]


def brute_force(a: NDArray[Any], b: NDArray[Any] | None = None) -> Pairs:
    return pairs_of(overlap(a, a if b is None else b), b is None)


def find_pairs(boxes: Any, other: Any = None, **options: Any) -> Any:
    """throng.find_pairs of boxes, some of them inverted."""
    return throng.find_pairs(boxes, other, **{"inverted": "inactive", **options})


def as_pairs(found: NDArray[Any]) -> Pairs:
    assert found.dtype == numpy.uint32 and found.ndim == 2 and found.shape[1] == 2
    return sorted((int(i), int(j)) for i, j in found)


def grown(boxes: NDArray[Any], margin: float) -> NDArray[Any]:
    """The smallest float64 boxes that contain all within a margin; inactive ones stay."""
    d = boxes.shape[1] // 2
    out = boxes.astype(numpy.float64)
    for row in out:
        if not all(row[:d] <= row[d:]):
            continue
        for k, sign in enumerate([-1] * d + [1] * d):
            if not math.isfinite(row[k]):
                continue
            there = Fraction(float(row[k])) + sign * Fraction(margin)
            nearest = float(there)
            row[k] = stepped(nearest, sign) if (Fraction(nearest) - there) * sign < 0 else nearest
    return out
