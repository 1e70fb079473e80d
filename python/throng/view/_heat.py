"""The heat map of a grid's cells: the boxes per cell along the sweep axis; by NumPy alone.
Pixels go right along the first of the other two axes, and up along the second.
"""

from dataclasses import dataclass
from typing import Any

import numpy
from numpy.typing import NDArray

from throng.view._frame import Frame

# Colours from few to many: Viridis without its darkest fifth, which dark screens do not show. Its lightness
# increases, so that it is readable with any kind of colour vision.
SCALE = numpy.array(
    [[65, 68, 135], [53, 95, 141], [42, 120, 142], [33, 145, 140], [34, 168, 132], [68, 191, 112],
     [122, 209, 81], [189, 223, 38], [253, 231, 37]]
)  # fmt: skip
EMPTY = [44, 46, 52]
BACKGROUND = [24, 25, 28]
# Pixels of the longer side; and per cell, if there are few cells.
MAX_PIXELS, PIXELS_PER_CELL = 384, 24
# Maximum ratio of the sides.
MAX_ASPECT_RATIO = 4
# Up to this many cells are all labelled; of more, only the densest.
MAX_LABELS = 16
# Maximum of the scale / minimum, at least: equally full cells look equal.
MIN_SCALE_RATIO = 16


def mixed(at: NDArray[Any]) -> NDArray[numpy.uint8]:
    """(..., 3): the colour for 0 (few) .. 1 (many)."""
    stops = numpy.linspace(0, 1, len(SCALE))
    parts = [numpy.interp(at, stops, SCALE[:, k]) for k in range(3)]
    return numpy.stack(parts, axis=-1).astype(numpy.uint8)


@dataclass(frozen=True)
class Scale:
    """Logarithmic position of numbers of boxes between `least` and `most`."""

    least: int
    most: int

    @staticmethod
    def of(counts: NDArray[Any]) -> "Scale":
        full = counts[counts > 0]
        most = int(full.max(initial=1))
        return Scale(max(1, min(int(full.min(initial=most)), most // MIN_SCALE_RATIO)), max(most, 2))

    def at(self, counts: NDArray[Any]) -> NDArray[Any]:
        """0 .. 1"""
        logs = numpy.log2(numpy.maximum(counts, self.least)) - numpy.log2(self.least)
        part: NDArray[Any] = logs / (numpy.log2(self.most) - numpy.log2(self.least))
        return part

    def colours(self, counts: NDArray[Any]) -> NDArray[numpy.uint8]:
        """(..., 3); dark for cells without boxes."""
        return numpy.where(counts[..., None] > 0, mixed(self.at(counts)), EMPTY).astype(numpy.uint8)

    def marks(self) -> list[int]:
        """Labels of the scale, ascending."""
        return sorted({self.least, round((self.least * self.most) ** 0.5), self.most})


@dataclass(frozen=True)
class HeatMap:
    """Of one frame with a grid."""

    counts: NDArray[numpy.uint32]  # (height, width): of the densest cell under each pixel
    scale: Scale
    low: NDArray[numpy.float64]  # (2,) of the grid, in world units
    high: NDArray[numpy.float64]
    axes: tuple[str, str]
    across: tuple[int, int]  # indices of these axes

    def rectangles(self, bounds: NDArray[Any]) -> NDArray[numpy.float32]:
        """(k, 4): left, top, right, bottom of boxes (k, 6) in pixels, clipped to the edges."""
        size = numpy.array(self.counts.shape[::-1])
        pixels = size / numpy.maximum(self.high - self.low, 1e-30)
        ends = [numpy.asarray(bounds)[:, [k + j for k in self.across]] for j in (0, 3)]
        lower, upper = (numpy.clip((end - self.low) * pixels, 0, size) for end in ends)
        parts = [lower[:, 0], size[1] - upper[:, 1], upper[:, 0], size[1] - lower[:, 1]]
        return numpy.stack(parts, axis=1).astype(numpy.float32)

    @property
    def strip(self) -> int:
        """Pixels that the scale is high, and what is between it and the map."""
        return max(int(max(self.counts.shape)) // 16, 2)

    def picture(self) -> NDArray[numpy.uint8]:
        """(height + 2 strip, width, 3): the scale below the map."""
        height, width = self.counts.shape
        whole = numpy.empty((height + 2 * self.strip, width, 3), numpy.uint8)
        whole[:height] = self.scale.colours(self.counts)
        whole[height : height + self.strip] = BACKGROUND
        whole[height + self.strip :] = mixed(numpy.linspace(0, 1, width))
        return whole

    def words(self) -> tuple[NDArray[numpy.float32], list[str]]:
        """Places (k, 2) in pixels, and what to write there: the axes above, the scale's numbers below."""
        height, width = self.counts.shape
        ends = [f"{axis} {low:.4g} to {high:.4g}" for axis, low, high in zip(self.axes, self.low, self.high)]
        places, said = [(width / 2, -3.0 * self.strip)], [f"right: {ends[0]}; up: {ends[1]}"]
        for number in self.scale.marks():
            places.append((float(self.scale.at(numpy.array(number))) * width, height + 2.0 * self.strip))
            said.append(f"{number:,}" + (" boxes" if number == self.scale.most else ""))
        return numpy.array(places, numpy.float32), said


def heat_map(frame: Frame) -> HeatMap | None:
    """None where there is no one grid."""
    if frame.explanation.cells == 0:
        return None
    counts = frame.occupancy
    axis = frame.explanation.result.plan.sweep_axis
    first, second = (k for k in range(3) if k != axis)
    grid = numpy.array(frame.explanation.grid, numpy.float64).reshape(2, 3)
    low, high = grid[:, [first, second]]
    longer = min(max(counts.shape) * PIXELS_PER_CELL, MAX_PIXELS)
    sides = numpy.maximum(high - low, 1e-30)
    shape = numpy.maximum(longer * sides / sides.max(), longer / MAX_ASPECT_RATIO).round().astype(int)
    pixels = counts
    for k in range(2):
        # Of a pixel that covers several cells the most; of a cell that covers several pixels, itself.
        starts = numpy.arange(shape[k]) * counts.shape[k] // shape[k]
        pixels = numpy.maximum.reduceat(pixels, starts, axis=k)
    upright = numpy.ascontiguousarray(pixels.T[::-1])
    return HeatMap(upright, Scale.of(counts), low, high, frame.axes, (first, second))
