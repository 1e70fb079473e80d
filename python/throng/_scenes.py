"""Generated scenes, and files of boxes and pairs."""

import errno
import os
from typing import Any, Literal

import numpy
from numpy.typing import NDArray

from throng import _throng
from throng._types import Array

scene_names: tuple[str, ...] = _throng.scene_names
"""The names of the scenes."""


def scene(
    name: str,
    objects: int,
    frames: int = 1,
    density: float | None = None,
    seed: int = 1,
    moving: float = 1.0,
) -> NDArray[numpy.float32]:
    """Generated boxes: the same bits everywhere.

    name: one of scene_names, such as 'uniform', 'pile', 'mixed', 'rods', 'worlds'. density: expected
    pairs per box; None: the scene's default. moving: the share of the boxes that move between frames.

    Returns (frames, objects, 6) float32; z points up. Raises ValueError for an unknown name or an
    invalid number.
    """
    return _throng.scene(name, objects, frames, density, seed, moving)


def scene_worlds(name: str, objects: int) -> NDArray[numpy.int32] | None:
    """The world of each box of a scene, (objects,) int32; None if it has none."""
    return _throng.scene_worlds(name, objects)


def load_boxes(
    path: str | os.PathLike[str], round: Literal["outward"] | None = None
) -> NDArray[numpy.float32]:
    """The boxes of a .npy file: (n, 6) float32, or (frames, n, 6) for several frames. 2-D boxes have
    4 for 6; lower and upper corners as (n, 2, 3) become (n, 6).

    Accepts either byte order, Fortran order, and float64 if each value is a float32, or with
    round='outward'. Raises FileNotFoundError, or ValueError that describes the file's contents.
    """
    if not os.path.exists(path):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), os.fspath(path))
    return _throng.load_boxes(os.fspath(path), round)


def save_boxes(path: str | os.PathLike[str], boxes: Array) -> None:
    """Writes boxes, (n, 6), (n, 2, 3) or (frames, n, 6), to a .npy file. The file gets its name when
    complete; on failure (OSError) an older file stays.
    """
    shape: Any = getattr(boxes, "shape", ())
    of_frames = len(shape) == 3 and tuple(shape[1:]) != (2, 3)
    frames = [boxes[i] for i in range(shape[0])] if of_frames else [boxes]  # type: ignore[index]
    _throng.save_boxes(os.fspath(path), frames)


def save_pairs(path: str | os.PathLike[str], pairs: Array) -> None:
    """Writes pairs, (m, 2) uint32, to a .npy file, as save_boxes does."""
    _throng.save_pairs(os.fspath(path), pairs)
