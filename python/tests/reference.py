"""The double loop, by NumPy, and what boxes tests are made of."""

from typing import Any

import numpy
from hypothesis import strategies as st
from numpy.typing import NDArray

Pairs = list[tuple[int, int]]
INF = float("inf")
NAN = float("nan")

# Few values, so that boxes touch, coincide, are inverted, of no size and infinite.
coordinate = st.sampled_from([-INF, -2.5, -1.0, -0.0, 0.0, 1e-45, 0.5, 1.0, 2.0, 3.0, 3.4e38, INF])
any_coordinate = coordinate | st.just(NAN) | st.floats(width=32)


def box_rows(columns: int = 6, most: int = 24, value: Any = coordinate) -> Any:
    """Arrays (n, columns) of float32."""
    row = st.lists(value, min_size=columns, max_size=columns)
    return st.lists(row, max_size=most).map(
        lambda rows: numpy.array(rows, numpy.float32).reshape(-1, columns)
    )


def overlap(a: NDArray[Any], b: NDArray[Any]) -> NDArray[numpy.bool_]:
    """(n, m): does box i of a meet box j of b. NaN and inverted boxes meet nothing."""
    d = a.shape[1] // 2
    active: list[Any] = [(x[:, :d] <= x[:, d:]).all(axis=1) for x in (a, b)]
    meet = (a[:, None, :d] <= b[None, :, d:]) & (b[None, :, :d] <= a[:, None, d:])
    met: NDArray[numpy.bool_] = meet.all(axis=2) & active[0][:, None] & active[1][None, :]
    return met


def pairs_of(met: NDArray[numpy.bool_], one_set: bool) -> Pairs:
    """Sorted pairs; of one set those with first < second."""
    if one_set:
        met = numpy.triu(met, 1)
    return [(int(i), int(j)) for i, j in zip(*numpy.nonzero(met))]


def brute_force(a: NDArray[Any], b: NDArray[Any] | None = None) -> Pairs:
    return pairs_of(overlap(a, a if b is None else b), b is None)


def as_pairs(found: NDArray[Any]) -> Pairs:
    assert found.dtype == numpy.uint32 and found.ndim == 2 and found.shape[1] == 2
    return sorted((int(i), int(j)) for i, j in found)
