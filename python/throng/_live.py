"""Persistent objects: BroadPhase."""

import copy
import math
from collections.abc import Sequence
from typing import Any, NamedTuple, NoReturn, Self, SupportsIndex

import numpy
from numpy.typing import NDArray

from throng import _throng
from throng._exchange import check_result, integer_type, like
from throng._numbers import number, numbers, whole
from throng._types import (
    Array,
    BoxesLike,
    FilterLike,
    Hits,
    Inverted,
    Isa,
    Nan,
    PairType,
    ResultKind,
)

Ids = Array | Sequence[int] | SupportsIndex


class Filter(NamedTuple):
    """The filter values of one object."""

    group: int = 0xFFFFFFFF
    mask: int = 0xFFFFFFFF
    owner: int = -1
    world: int = -1
    static: bool = False


class RayHit(NamedTuple):
    """What a ray hits first: see BroadPhase.raycast."""

    object: int
    distance: float
    point: tuple[float, float, float]
    normal: tuple[float, float, float]


class _Results:
    """How the arrays of integers are returned."""

    def __init__(self, result: ResultKind, dtype: PairType) -> None:
        check_result(result)
        self.result = result
        self.dtype = integer_type(dtype)
        self.boxes: Any = ()  # those given last, if another library's array is wanted

    def notice(self, boxes: Any) -> None:
        if self.result == "same":
            one = boxes[0] if isinstance(boxes, tuple) and boxes else boxes
            is_array = hasattr(one, "__dlpack__") and hasattr(one, "__getitem__")
            # For NumPy nothing is kept: a view would keep the memory of all boxes.
            self.boxes = one[:0, ...] if is_array and not isinstance(one, numpy.ndarray) else ()

    def array(self, found: NDArray[numpy.uint32], boxes: Any = None) -> Any:
        """As an array of the library of `boxes`, or of those given last."""
        if self.result != "same" and self.dtype == "uint32":
            return found
        return like(found, self.boxes if boxes is None else boxes, self.result, self.dtype)

    def hits(self, pairs: Any, times: NDArray[numpy.float64], boxes: Any) -> tuple[Any, Any]:
        """The same for pairs and their times."""
        of_times = times if self.result != "same" else like(times, boxes, self.result)
        return self.array(pairs, boxes), of_times


class BroadPhase:
    """Keeps objects from frame to frame, and reports which pairs began and which ended.

    Objects are added, moved and removed, by ids; update() then reports the changes of the pairs. The
    cost depends on the number of changed objects. A call that raises changes nothing; Ctrl-C
    interrupts a long update(), find_overlaps() or find_hits(), and the next update() reports the
    changes.

    Boxes as for find_pairs, or one box (6,); float64 is rounded to float32, lower corners down and upper
    corners up, so that no pair is lost. Where ids are taken, one id is, too; each filter is one integer
    per box, or one for all.

    margin, nan, inverted, threads, isa: as for find_pairs, but `inverted` is 'inactive' by default:
        boxes with lower > upper are empty slots.
    result: 'numpy' or 'auto': NumPy arrays. 'same': arrays of ids, pairs and times are of the library of
        a query's boxes, else of the boxes given last.
    dtype: of ids and pairs: 'uint32', or 'int64', as PyTorch's indexing needs.

    Any number of threads may query one at once: find_overlaps, find_hits, raycast, box, filter, is_alive, begun,
    ended, pairs_of and the counts; calls release the GIL. With several threads `threads=1` is fastest. Other
    calls, and pairs, which sorts on demand, need it alone: during one of them, or while a query runs, they
    raise RuntimeError and change nothing.
    """

    def __init__(
        self,
        *,
        margin: float = 0.0,
        nan: Nan = "refuse",
        inverted: Inverted = "inactive",
        threads: int = 0,
        isa: Isa = "auto",
        result: ResultKind = "auto",
        dtype: PairType = "uint32",
    ) -> None:
        self._live = _throng.BroadPhase(margin, nan, inverted, threads, isa)
        self._results = _Results(result, dtype)

    def copy(self) -> Self:
        """A snapshot with the same ids, slots and results of the last update. copy.copy and copy.deepcopy
        do the same.
        """
        return self.__copy__()

    def __copy__(self) -> Self:
        made = type(self).__new__(type(self))
        vars(made).update(vars(self))  # attributes of a derived class
        made._live = self._live.copy()
        made._results = copy.copy(self._results)
        return made

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        made = type(self).__new__(type(self))
        memo[id(self)] = made
        others = {name: value for name, value in vars(self).items() if name not in ("_live", "_results")}
        vars(made).update(copy.deepcopy(others, memo))
        made._live = self._live.copy()
        made._results = copy.copy(self._results)
        return made

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a BroadPhase is not pickled: pickle its objects' box(id) and filter(id), and "
            "add that to a new one; within the process use copy()"
        )

    def add(
        self,
        boxes: BoxesLike,
        *,
        group: FilterLike | None = None,
        mask: FilterLike | None = None,
        owner: FilterLike | None = None,
        world: FilterLike | None = None,
        static: FilterLike | None = None,
    ) -> Any:
        """Adds an object for each box; the filters are those of find_pairs.

        Returns their ids, (n,): 0, 1, 2, ... if none was removed. The id of a removed object is reused only
        after an update.
        """
        ids = self._live.add(boxes, (group, mask, owner, world, static))
        self._results.notice(boxes)
        return self._results.array(ids)

    def remove(self, ids: Ids) -> None:
        """Removes objects, or one. ValueError for an id that is not alive, or occurs twice."""
        self._live.remove(ids)

    def move(self, ids: Ids, boxes: BoxesLike) -> None:
        """Gives objects new boxes, one per id; of several calls before an update the last one counts.

        All or nothing: a box with a NaN raises a ValueError that names its position and id; with
        nan='inactive' it is accepted, and overlaps nothing.
        """
        self._live.move(ids, boxes)
        self._results.notice(boxes)

    def move_all(self, boxes: BoxesLike) -> None:
        """The same for all objects: boxes[id] for every id below id_limit; unchanged boxes are skipped."""
        self._live.move_all(boxes)
        self._results.notice(boxes)

    def set_filters(
        self,
        ids: Ids,
        *,
        group: FilterLike | None = None,
        mask: FilterLike | None = None,
        owner: FilterLike | None = None,
        world: FilterLike | None = None,
        static: FilterLike | None = None,
    ) -> None:
        """One value per id, or one for all; filters that are not given stay unchanged."""
        self._live.set_filters(ids, (group, mask, owner, world, static))

    def shift_origin(self, by: Sequence[float]) -> None:
        """Adds `by` (x, y, z) to all corners, rounded to the nearest float32; (x, y) leaves z.

        Active boxes stay active, and inactive ones inactive.
        """
        shift = [*numbers(by, "by", (3, 2)), 0.0]
        self._live.shift_origin(*shift[:3])

    def update(self) -> _throng.Result:
        """Finds the pairs that began and ended since the last update."""
        return self._live.update()

    @property
    def begun(self) -> Any:
        """(m, 3), sorted: the ids first < second, and the pair's slot.

        The slot is unique to the pair while it exists: an index for per-pair data.
        """
        return self._results.array(self._live.begun())

    @property
    def ended(self) -> Any:
        """(m, 3) as begun; these slots are free now: the next update may reuse them."""
        return self._results.array(self._live.ended())

    @property
    def pairs(self) -> Any:
        """(m, 3) as begun: all pairs as of the last update."""
        return self._results.array(self._live.pairs())

    def pairs_of(self, id: int) -> Any:
        """(m, 3) as begun: the pairs of one object as of the last update, sorted by the other id.

        Empty for an id without pairs. The cost depends on the object's own pairs; only after an update
        that found all pairs from scratch the first calls scan all of them.
        """
        return self._results.array(self._live.pairs_of(id))

    def find_overlaps(
        self,
        boxes: BoxesLike,
        *,
        group: FilterLike | None = None,
        mask: FilterLike | None = None,
        owner: FilterLike | None = None,
        world: FilterLike | None = None,
        static: FilterLike | None = None,
    ) -> Any:
        """(m, 2), sorted: the index of a box, and the id of an object that it overlaps.

        Queries the current boxes of the objects, without the margin.
        """
        found = self._live.find_overlaps(boxes, (group, mask, owner, world, static))
        return self._results.array(found, boxes)

    def find_hits(
        self,
        boxes: BoxesLike,
        by: Array,
        *,
        which: Hits = "all",
        group: FilterLike | None = None,
        mask: FilterLike | None = None,
        owner: FilterLike | None = None,
        world: FilterLike | None = None,
        static: FilterLike | None = None,
    ) -> tuple[Any, Any]:
        """Ray and shape casts: the objects that boxes hit when they move by `by` from time 0 to 1. A ray
        is a moving point: find_hits((origin, origin), direction).

        by: (n, 3), one per box, or (n, 2) for 2-D boxes, in world units; finite, at most 3.4e38 per
            component: for an unlimited ray use one longer than the scene. float64 is rounded to the nearest
            float32, and the box extended so that it covers the given path: no hit is lost, and a time is
            at most that of the given box.
        which: 'all' objects on the way, or the 'first' that is hit; of several at once the lowest id.

        Returns (pairs, times), sorted by pair: (m, 2), the index of a box and the id of an object
        that it hits, and (m,) float64, the time of first contact: 0 if they overlap at the start. Queries
        the current boxes of the objects, without the margin.
        """
        pairs, times = self._live.find_hits(boxes, by, which, (group, mask, owner, world, static))
        return self._results.hits(pairs, times, boxes)

    def raycast(
        self,
        origin: Array | Sequence[float],
        direction: Array | Sequence[float],
        max_distance: float = math.inf,
        *,
        layer_mask: int = 0xFFFFFFFF,
        world: int | None = None,
    ) -> RayHit | None:
        """The closest object that one ray hits, or None.

        origin, direction: (x, y, z), or (x, y), rounded to the nearest float32; the direction may have any
            length but 0. max_distance, and the distance of the hit, are in world units.
        layer_mask: only objects whose group has one of these bits are hit.
        world: only objects of this world, and those of every world, are hit; None: of all worlds.

        Returns the id of the object, the distance, a point of its box, and the normal of the face that the
        ray enters; at an edge that of the first axis. Touching counts. A ray that starts in a box has
        distance 0, the origin as point, and the opposite of the direction as normal.

        Any number of threads may cast rays at once; during a call that changes the BroadPhase it raises
        RuntimeError. For many rays, use find_hits.
        """
        hit = self._live.raycast(
            [*numbers(origin, "origin", (3, 2)), 0.0][:3],
            [*numbers(direction, "direction", (3, 2)), 0.0][:3],
            number(max_distance, "max_distance", infinite=True),
            whole(layer_mask, "layer_mask"),
            -1 if world is None else whole(world, "world"),
        )
        return None if hit is None else RayHit(*hit)

    def is_alive(self, id: int) -> bool:
        """Whether an object has this id."""
        return self._live.is_alive(id)

    def box(self, id: int) -> NDArray[numpy.float32]:
        """(6,) float32: lower x, y, z, upper x, y, z of an object's current box.

        ValueError for an id that is not alive.
        """
        return self._live.box(id)

    def filter(self, id: int) -> Filter:
        """The current filter values of an object; a filter that was never set has its default.
        ValueError for an id that is not alive.
        """
        return Filter(*self._live.filter(id))

    def __len__(self) -> int:
        return self._live.object_count

    @property
    def pair_count(self) -> int:
        """The number of pairs."""
        return self._live.pair_count

    @property
    def id_limit(self) -> int:
        """All ids are below this."""
        return self._live.id_limit

    @property
    def slot_limit(self) -> int:
        """Upper limit (exclusive) of the slots of pairs that exist, or ended in the last update."""
        return self._live.slot_limit


class BroadPhaseQuery:
    """Queries of a BroadPhase with options of their own: other threads, results or rules for NaN.

    One thread at a time; a call during another one raises RuntimeError.

    nan, inverted, threads, isa, result, dtype: as for BroadPhase.
    """

    def __init__(
        self,
        *,
        nan: Nan = "refuse",
        inverted: Inverted = "inactive",
        threads: int = 0,
        isa: Isa = "auto",
        result: ResultKind = "auto",
        dtype: PairType = "uint32",
    ) -> None:
        self._query = _throng.BroadPhaseQuery(nan, inverted, threads, isa)
        self._results = _Results(result, dtype)

    def __reduce__(self) -> NoReturn:
        raise TypeError("a BroadPhaseQuery is neither copied nor pickled: make another")

    def find_overlaps(
        self,
        objects: BroadPhase,
        boxes: BoxesLike,
        *,
        group: FilterLike | None = None,
        mask: FilterLike | None = None,
        owner: FilterLike | None = None,
        world: FilterLike | None = None,
        static: FilterLike | None = None,
    ) -> Any:
        """As BroadPhase.find_overlaps, on the objects of a BroadPhase."""
        found = self._query.find_overlaps(
            _broad_phase_of(objects), boxes, (group, mask, owner, world, static)
        )
        return self._results.array(found, boxes)

    def find_hits(
        self,
        objects: BroadPhase,
        boxes: BoxesLike,
        by: Array,
        *,
        which: Hits = "all",
        group: FilterLike | None = None,
        mask: FilterLike | None = None,
        owner: FilterLike | None = None,
        world: FilterLike | None = None,
        static: FilterLike | None = None,
    ) -> tuple[Any, Any]:
        """As BroadPhase.find_hits, on the objects of a BroadPhase."""
        pairs, times = self._query.find_hits(
            _broad_phase_of(objects), boxes, by, which, (group, mask, owner, world, static)
        )
        return self._results.hits(pairs, times, boxes)


def _broad_phase_of(objects: object) -> _throng.BroadPhase:
    if isinstance(objects, BroadPhase):
        return objects._live
    raise TypeError(f"objects: found a {type(objects).__name__}, wanted a BroadPhase")
