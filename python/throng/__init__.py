"""All pairs of overlapping boxes among very many moving objects: the broad phase of collision
detection.

    >>> import numpy, throng
    >>> boxes = numpy.array([[0, 0, 0, 2, 2, 2], [1, 1, 1, 3, 3, 3], [9, 9, 9, 9, 9, 9]], numpy.float32)
    >>> throng.find_pairs(boxes)
    array([[0, 1]], dtype=uint32)

A box is closed: lower x, y, z, upper x, y, z, float32 or float64, in world units. Two boxes overlap when on
every axis ``a.lower <= b.upper`` and ``b.lower <= a.upper``: touching counts. find_pairs refuses a
box with ``lower > upper`` on some axis; with ``inverted='inactive'``, and by default in a Finder and
a BroadPhase, it is an empty slot that overlaps nothing. A NaN is refused, or makes its box inactive
with ``nan='inactive'``.

The pairs are those of the double loop over the given numbers, for every algorithm, number of threads
and instruction set. A BroadPhase keeps float32: it rounds float64 outward.

throng.mesh: intersecting triangles of meshes. throng.ipc: a broad phase for ipctk.
"""

import atexit as _atexit
import os as _os
import threading as _threading

from throng import _throng, mesh
from throng._bodies import box, capsule, convex, shape_type, sphere, update_boxes
from throng._boxes import boxes_from_center, boxes_from_intervals
from throng._conflict import warn_of_other_project as _warn_of_other_project
from throng._find import Finder, find_pairs
from throng._live import BroadPhase, BroadPhaseQuery, Filter, RayHit
from throng._scenes import (
    load_boxes,
    save_boxes,
    save_pairs,
    scene,
    scene_names,
    scene_worlds,
)
from throng._throng import Explanation, Plan, Result, StageTimes, __version__
from throng._types import Array, BoxesLike

__all__ = [
    "Array",
    "BoxesLike",
    "BroadPhase",
    "BroadPhaseQuery",
    "Explanation",
    "Filter",
    "Finder",
    "Plan",
    "RayHit",
    "Result",
    "StageTimes",
    "__version__",
    "box",
    "boxes_from_center",
    "boxes_from_intervals",
    "capsule",
    "convex",
    "find_pairs",
    "load_boxes",
    "mesh",
    "save_boxes",
    "save_pairs",
    "scene",
    "scene_names",
    "scene_worlds",
    "shape_type",
    "sphere",
    "update_boxes",
]

# A forked child has none of its parent's threads.
if hasattr(_os, "register_at_fork"):
    _os.register_at_fork(after_in_child=_throng.forget_threads)

_warn_of_other_project()


def _at_exit() -> None:
    # A daemon thread never releases its objects: not a leak of the module.
    if any(thread.daemon for thread in _threading.enumerate()):
        _throng.expect_leaks()


_atexit.register(_at_exit)
