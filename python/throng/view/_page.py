"""A picture of boxes and pairs as one HTML page, by NumPy alone."""

import base64
import html
import json
import os
import sys
import tempfile
import webbrowser
from pathlib import Path
from typing import Any

import numpy
from numpy.typing import NDArray

from throng import _throng
from throng._batch import refuse_hidden
from throng._find import find_pairs
from throng._types import BoxesLike
from throng.view._frame import bounds, choose, is_large
from throng.view._heat import mixed

# Boxes and pairs that a browser turns smoothly.
MAX_BOXES, MAX_PAIRS = 5000, 20000
NO_OVERLAP = "#86868e"
COLOURS = 12
# Of an outlier, in units of half the size of what the camera shows.
MAX_DISTANCE = 1e6


class Page:
    """A self-contained page: a notebook draws it, and a script has it as a file."""

    def __init__(self, text: str, path: Path | None = None) -> None:
        self.html = text
        self._path = path
        if path is not None:
            path.write_text(text, encoding="utf-8")

    @property
    def path(self) -> Path:
        """The file; without one yet, a new temporary file."""
        if self._path is None:
            handle, name = tempfile.mkstemp(prefix="throng-", suffix=".html")
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(self.html)
            self._path = Path(name)
        return self._path

    def __fspath__(self) -> str:
        return str(self.path)

    def __str__(self) -> str:
        return str(self.path)

    def __repr__(self) -> str:
        return f"Page({str(self._path)!r})" if self._path else "Page()"

    def _repr_html_(self) -> str:
        text = html.escape(self.html, quote=True)
        return f'<iframe srcdoc="{text}" style="width: 100%; height: 480px; border: 0"></iframe>'


def show(
    boxes: BoxesLike,
    pairs: Any = None,
    path: str | os.PathLike[str] | None = None,
    *,
    most: int = MAX_BOXES,
) -> Page:
    """Draws boxes as solids, coloured by their number of overlaps, to be turned with the mouse.

    In a notebook, the last value of a cell is drawn. In a script, the page is written to a temporary
    file and opened in a browser, if there is a screen. Prints nothing.

    boxes: as for find_pairs, without worlds; z points up. A box with a NaN or lower > upper is not drawn;
        one that is infinite or 30 times larger than the median box is an outline.
    pairs: (m, 2) indices of boxes, or (m, 3) as BroadPhase.pairs: first, second, slot; None: those of find_pairs.
        Of a batch of worlds show one: show(boxes[w], pairs[pairs[:, 0] == w, 1:]).
    path: the file for the page, which is then not opened.
    most: the number of boxes to draw; of more, a sample. The numbers of overlaps are of all.

    Returns a Page: a path (os.fspath(page), page.path) that a notebook draws. Needs nothing but NumPy; the
    page loads nothing. Raises ValueError for an index that is no box.
    """
    text = _text(_rows(boxes), pairs, most)
    page = Page(text, None if path is None else Path(path))
    if path is None and not _is_notebook():
        address = page.path.as_uri()
        if _has_screen():
            webbrowser.open(address)
    return page


def _is_notebook() -> bool:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel")


def _has_screen() -> bool:
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _numpy(array: Any) -> NDArray[numpy.float64]:
    if not isinstance(array, numpy.ndarray) and hasattr(array, "__dlpack__"):
        array = numpy.from_dlpack(array)
    array = numpy.asarray(array)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"boxes: found an array of {array.dtype}, wanted float32 or float64")
    return array.astype(numpy.float64, copy=False)


def _rows(boxes: BoxesLike) -> NDArray[numpy.float64]:
    """(n, 6) or (n, 4)"""
    refuse_hidden(boxes, "boxes")
    given = _throng.boxes_of_lists(boxes, "boxes")
    if isinstance(given, tuple):
        shapes = [numpy.shape(corner) for corner in given]
        if len(shapes) != 2 or shapes[0] != shapes[1] or len(shapes[0]) != 2 or shapes[0][1] not in (2, 3):
            raise ValueError(f"boxes: found corners of shapes {shapes}, wanted two of shape (n, 3), for 2-D (n, 2)")
        rows = numpy.concatenate([_numpy(corner) for corner in given], axis=1)
    else:
        rows = _numpy(given)
    if rows.ndim == 3 and rows.shape[1] == 2 and rows.shape[2] in (2, 3):
        rows = rows.reshape(len(rows), -1)
    if rows.ndim != 2 or rows.shape[1] not in (4, 6):
        one = "; show one world: boxes[w], pairs[pairs[:, 0] == w, 1:]" if rows.ndim == 3 else ""
        raise ValueError(f"boxes: found shape {rows.shape}, wanted (n, 6) or (n, 2, 3), for 2-D (n, 4) or (n, 2, 2){one}")
    return rows


def _checked(pairs: Any, boxes: NDArray[Any]) -> NDArray[numpy.int64]:
    if pairs is None:
        all_pairs: NDArray[numpy.int64] = find_pairs(boxes, nan="inactive", inverted="inactive", dtype="int64")
        return all_pairs
    if not isinstance(pairs, numpy.ndarray) and hasattr(pairs, "__dlpack__"):
        pairs = numpy.from_dlpack(pairs)
    found = numpy.asarray(pairs)
    if found.size == 0:
        return numpy.zeros((0, 2), numpy.int64)
    if found.ndim != 2 or found.shape[1] not in (2, 3) or found.dtype.kind not in "iu":
        raise ValueError(f"pairs: found {found.dtype} of shape {found.shape}, wanted integers of shape (m, 2)")
    found = found[:, :2]
    bad = numpy.flatnonzero(((found < 0) | (found >= len(boxes))).any(axis=1))
    if bad.size:
        raise ValueError(f"pairs: the row {bad[0]} is {found[bad[0]].tolist()}, wanted indices below {len(boxes)}")
    return found.astype(numpy.int64)


def _text(rows: NDArray[numpy.float64], given: Any, most: int) -> str:
    if not isinstance(most, (int, numpy.integer)):
        raise TypeError(f"most: found {most!r}, wanted an integer of 1 or more")
    if most < 1:
        raise ValueError(f"most: found {most}, wanted 1 or more")
    pairs = _checked(given, rows)
    is_flat = rows.shape[1] == 4
    boxes = rows if not is_flat else numpy.insert(rows, [2, 4], 0, axis=1)
    overlaps = numpy.bincount(pairs.reshape(-1), minlength=len(boxes))
    shown = choose(boxes, overlaps, [], most)
    number = numpy.full(len(boxes), -1)
    number[shown] = numpy.arange(len(shown))
    drawn = number[pairs]
    drawn = drawn[(drawn >= 0).all(axis=1)]
    lines = drawn[:: -(-len(drawn) // MAX_PAIRS)] if len(drawn) > MAX_PAIRS else drawn
    large = is_large(boxes[shown])
    corners = _centered(boxes[shown], large)
    title = f"{_number(len(boxes), 'box', 'boxes')}, {_number(len(pairs), 'pair', 'pairs')}"
    if len(shown) < len(boxes):
        title += f"; {len(shown):,} boxes drawn"
    if len(lines) < len(pairs):
        title += f", {len(lines):,} pairs drawn"
    scale = ["#" + bytes(colour).hex() for colour in mixed(numpy.linspace(0, 1, COLOURS))]
    data = {
        "title": title,
        "flat": is_flat,
        "outlined": numpy.flatnonzero(large).tolist(),
        "colours": [NO_OVERLAP, *scale],
        "corners": _base64(corners, numpy.float32),
        "index": _base64(shown, numpy.uint32),
        "overlaps": _base64(overlaps[shown], numpy.uint32),
        "pairs": _base64(lines, numpy.uint32),
    }
    template = Path(__file__).with_name("page.html").read_text(encoding="utf-8")
    return template.replace("@DATA@", json.dumps(data))


def _number(count: int, one: str, more: str) -> str:
    return f"{count:,} {one if count == 1 else more}"


def _base64(values: NDArray[Any], kind: Any) -> str:
    little = numpy.ascontiguousarray(values, numpy.dtype(kind).newbyteorder("<"))
    return base64.b64encode(little.tobytes()).decode("ascii")


def _centered(
    boxes: NDArray[numpy.float64], large: NDArray[numpy.bool_]
) -> NDArray[numpy.float64]:
    """The boxes from the middle of what the camera shows, the largest distance to its sides 1. Large
    boxes are clipped a little farther out.
    """
    low, high = bounds(boxes)
    # Halves: the difference of two finite numbers may be infinite.
    middle, reach = high / 2 + low / 2, (high / 2 - low / 2).max() or 1.0
    with numpy.errstate(over="ignore"):
        corners = (boxes.reshape(-1, 3) / 2 - middle / 2) / (reach / 2)
        edge = (high / 2 - low / 2) / reach + 0.1
    clipped = numpy.clip(corners, -edge, edge)
    farthest = numpy.clip(corners, -MAX_DISTANCE, MAX_DISTANCE)
    return numpy.where(large.repeat(2)[:, None], clipped, farthest).reshape(-1, 6)
