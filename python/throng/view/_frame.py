"""The data shown of each frame, by NumPy alone."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy
from numpy.typing import NDArray

from throng._find import Finder
from throng._throng import Explanation

Pairs = NDArray[numpy.uint32]

# Maximum number of drawn boxes: the viewer stays smooth.
MAX_DRAWN = 200_000
# Boxes this many times larger than the median box would hide the others, and the camera ignores them.
LARGE = 30
# The share of boxes at each end of each axis that the camera ignores.
OUTLIERS = 0.002


@dataclass(frozen=True)
class Frame:
    """One frame, searched. Pairs are sorted, (m, 2) uint32."""

    number: int
    boxes: NDArray[numpy.float32]  # (n, 6), all of them
    shown: NDArray[numpy.intp]  # ascending indices of the drawn boxes, all active
    overlaps: NDArray[numpy.intp]  # (n,) number of overlaps of each box
    pairs: Pairs  # all of them
    begun: Pairs  # absent in the previous frame; empty for the first frame
    ended: Pairs  # present in the previous frame only
    explanation: Explanation

    @property
    def occupancy(self) -> NDArray[numpy.uint32]:
        """Boxes per cell, 2-D: summed along the sweep axis."""
        axis = self.explanation.result.plan.sweep_axis
        summed: NDArray[numpy.uint32] = self.explanation.occupancy.sum(axis=axis, dtype=numpy.uint32)
        return summed

    @property
    def axes(self) -> tuple[str, str]:
        """The two axes of occupancy."""
        left = "xyz".replace("xyz"[self.explanation.result.plan.sweep_axis], "")
        return left[0], left[1]

    def lines(self, pairs: Pairs, most: int = MAX_DRAWN) -> Pairs:
        """Those of `pairs` whose boxes are both drawn, evenly thinned to `most`."""
        drawn = numpy.zeros(len(self.boxes), bool)
        drawn[self.shown] = True
        both = pairs[drawn[pairs].all(axis=1)]
        return both[:: -(-len(both) // most)] if len(both) > most else both

    def corners(self, which: Any) -> NDArray[numpy.float32]:
        """(k, 6): the boxes, infinite ones clipped to the range of the finite ones."""
        low, high = self.extent
        wanted = self.boxes[which]
        lower = numpy.maximum(wanted[:, :3], low)
        return numpy.concatenate(
            [lower, numpy.maximum(lower, numpy.minimum(wanted[:, 3:], high))], axis=1
        )

    @property
    def extent(self) -> tuple[NDArray[numpy.float32], NDArray[numpy.float32]]:
        """The range of all finite corners, 5 % wider."""
        some = self.boxes[self.shown].reshape(-1, 3)
        finite = numpy.where(numpy.isfinite(some), some, numpy.nan)
        low, high = numpy.zeros(3), numpy.zeros(3)
        for k in range(3):
            if numpy.isfinite(finite[:, k]).any():
                low[k], high[k] = numpy.nanmin(finite[:, k]), numpy.nanmax(finite[:, k])
        wider = (high - low) / 20 + 1e-6
        return (low - wider).astype(numpy.float32), (high + wider).astype(numpy.float32)

    def cells(self, most: int = 2000) -> tuple[NDArray[numpy.float32], NDArray[numpy.uint32]]:
        """The cells with the most boxes: bounds (k, 6), and their numbers of boxes, descending."""
        counts = self.explanation.occupancy
        flat = counts.reshape(-1)
        full = numpy.flatnonzero(flat)
        full = full[numpy.argsort(flat[full], kind="stable")[::-1][:most]]
        grid = numpy.array(self.explanation.grid).reshape(2, 3)
        step = (grid[1] - grid[0]) / numpy.maximum(counts.shape, 1)
        lower = grid[0] + numpy.stack(numpy.unravel_index(full, counts.shape), axis=1) * step
        # Columns are unbounded along the sweep axis; use the boxes' range.
        low, high = self.extent
        upper = lower + step
        axis = self.explanation.result.plan.sweep_axis
        if counts.shape[axis] == 1:
            lower[:, axis], upper[:, axis] = low[axis], high[axis]
        return numpy.concatenate([lower, upper], axis=1).astype(numpy.float32), flat[full]


def frames(scene: Sequence[Any] | NDArray[Any], most: int = MAX_DRAWN, **options: Any) -> Iterator[Frame]:
    """Searches frame after frame, (frames, n, 6) float32; options are those of Finder. A box with a
    NaN overlaps nothing, and is not drawn.
    """
    finder = Finder(order="canonical", nan="inactive", **options)
    before: NDArray[numpy.uint64] | None = None
    for number, given in enumerate(scene):
        boxes = numpy.ascontiguousarray(given)
        pairs = finder.find(boxes)
        explanation = finder.explain(boxes)
        n = len(boxes)
        overlaps = numpy.bincount(pairs.reshape(-1), minlength=n)
        codes = pairs[:, 0].astype(numpy.uint64) << numpy.uint64(32) | pairs[:, 1]
        began, ended = codes[:0], codes[:0]
        if before is not None:
            began = numpy.setdiff1d(codes, before, assume_unique=True)
            ended = numpy.setdiff1d(before, codes, assume_unique=True)
        before = codes
        largest = [box.index for box in explanation.largest]
        shown = choose(boxes, overlaps, largest, most)
        yield Frame(number, boxes, shown, overlaps, pairs, _decoded(began), _decoded(ended), explanation)


def _decoded(codes: NDArray[numpy.uint64]) -> Pairs:
    parts = [codes >> numpy.uint64(32), codes & numpy.uint64(0xFFFFFFFF)]
    return numpy.stack(parts, axis=1).astype(numpy.uint32)


def choose(
    boxes: NDArray[Any], overlaps: NDArray[Any], largest: list[int], most: int
) -> NDArray[numpy.intp]:
    """Indices of the boxes to draw, ascending: a random choice of many boxes, the same in each frame, and the boxes of special interest."""
    active = (boxes[:, :3] <= boxes[:, 3:]).all(axis=1)
    n = len(boxes)
    chosen = numpy.ones(n, bool)
    if n > most:
        few = min(100, most // 10)
        crowded = numpy.argpartition(overlaps, n - few - 1)[n - few :]
        random_count = max(most - few - len(largest), 0)
        chosen[:] = False
        chosen[numpy.random.default_rng(1).permutation(n)[:random_count]] = True
        chosen[crowded] = True
        chosen[largest[:most]] = True
    return numpy.flatnonzero(chosen & active)


def is_large(boxes: NDArray[Any]) -> NDArray[numpy.bool_]:
    """(n,): whether a box is infinite, or LARGE times larger than the median box."""
    with numpy.errstate(invalid="ignore", over="ignore"):
        extents = (boxes[:, 3:] - boxes[:, :3]).max(axis=1)
    finite = numpy.isfinite(boxes).all(axis=1) & numpy.isfinite(extents)
    some = extents[finite & (extents > 0)]
    limit = LARGE * float(numpy.median(some)) if some.size else 0.0
    large: NDArray[numpy.bool_] = ~finite | (extents > limit)
    return large


def bounds(boxes: NDArray[Any]) -> tuple[NDArray[numpy.float64], NDArray[numpy.float64]]:
    """Lower and upper corner of what a camera shows: of the boxes that are not large, without outliers."""
    some = boxes[(boxes[:, :3] <= boxes[:, 3:]).all(axis=1)]
    some = some[~is_large(some)].astype(numpy.float64)
    if not len(some):
        return numpy.zeros(3), numpy.ones(3)
    low = numpy.quantile(some[:, :3], OUTLIERS, axis=0, method="lower")
    return low, numpy.quantile(some[:, 3:], 1 - OUTLIERS, axis=0, method="higher")


def moving(scene: Sequence[Any] | NDArray[Any]) -> NDArray[Any]:
    """(k, 6): the boxes that move, at the first, middle and last frame; all boxes if none moves."""
    some = [numpy.asarray(scene[k]) for k in sorted({0, len(scene) // 2, len(scene) - 1})]
    if any(len(boxes) != len(some[0]) for boxes in some):
        return numpy.concatenate(some)
    moves = numpy.zeros(len(some[0]), bool)
    for boxes in some:
        moves |= (boxes != some[0]).any(axis=1)
    return numpy.concatenate([boxes[moves] for boxes in some] if moves.any() else some[:1])
