"""Persistent objects: BroadPhase."""

import copy
from collections.abc import Sequence
from typing import Any, NamedTuple, NoReturn, Self

import numpy
from numpy.typing import NDArray

from throng import _throng
from throng._numbers import numbers
from throng._types import Array, BoxesLike, Hits, Inverted, Isa, Nan


class Filter(NamedTuple):
    """The filter values of one object."""

    group: int = 0xFFFFFFFF
    mask: int = 0xFFFFFFFF
    owner: int = -1
    world: int = -1
    static: bool = False


class BroadPhase:
    """Keeps objects from frame to frame, and reports which pairs began and which ended.

    Objects are added, moved and removed, by ids; update() then reports the changes of the pairs. The
    cost depends on the number of changed objects. A call that raises changes nothing; Ctrl-C
    interrupts a long update(), find_overlaps() or find_hits(), and the next update() reports the
    changes.

    margin, nan, inverted, threads, isa: as for find_pairs, but `inverted` is 'inactive' by default:
    boxes with lower > upper are empty slots. One thread at a time; a call during another one raises
    RuntimeError. Several threads may query one at once, each with its own BroadPhaseQuery.
    """

    def __init__(
        self,
        *,
        margin: float = 0.0,
        nan: Nan = "refuse",
        inverted: Inverted = "inactive",
        threads: int = 0,
        isa: Isa = "auto",
    ) -> None:
        self._live = _throng.BroadPhase(margin, nan, inverted, threads, isa)

    def copy(self) -> Self:
        """A snapshot with the same ids, slots and results of the last update. copy.copy and copy.deepcopy
        do the same.
        """
        return self.__copy__()

    def __copy__(self) -> Self:
        made = type(self).__new__(type(self))
        vars(made).update(vars(self))  # attributes of a derived class
        made._live = self._live.copy()
        return made

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        made = type(self).__new__(type(self))
        memo[id(self)] = made
        others = {name: value for name, value in vars(self).items() if name != "_live"}
        vars(made).update(copy.deepcopy(others, memo))
        made._live = self._live.copy()
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
        group: Array | None = None,
        mask: Array | None = None,
        owner: Array | None = None,
        world: Array | None = None,
        static: Array | None = None,
    ) -> NDArray[numpy.uint32]:
        """Adds an object for each box; the filters are those of find_pairs.

        Returns their ids, (n,) uint32: 0, 1, 2, ... if none was removed. The id of a removed object is
        reused only after an update.
        """
        return self._live.add(boxes, (group, mask, owner, world, static))

    def remove(self, ids: Array) -> None:
        """Removes objects. ValueError for an id that is not alive, or occurs twice."""
        self._live.remove(ids)

    def move(self, ids: Array, boxes: BoxesLike) -> None:
        """Gives objects new boxes, one per id; of several calls before an update the last one counts.

        All or nothing: a box with a NaN raises a ValueError that names its position and id; with
        nan='inactive' it is accepted, and overlaps nothing.
        """
        self._live.move(ids, boxes)

    def move_all(self, boxes: BoxesLike) -> None:
        """The same for all objects: boxes[id] for every id below id_limit; unchanged boxes are skipped."""
        self._live.move_all(boxes)

    def set_filters(
        self,
        ids: Array,
        *,
        group: Array | None = None,
        mask: Array | None = None,
        owner: Array | None = None,
        world: Array | None = None,
        static: Array | None = None,
    ) -> None:
        """One value per id; filters that are not given stay unchanged."""
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
    def begun(self) -> NDArray[numpy.uint32]:
        """(m, 3) uint32, sorted: the ids first < second, and the pair's slot.

        The slot is unique to the pair while it exists: an index for per-pair data.
        """
        return self._live.begun()

    @property
    def ended(self) -> NDArray[numpy.uint32]:
        """(m, 3) as begun; these slots are free now: the next update may reuse them."""
        return self._live.ended()

    @property
    def pairs(self) -> NDArray[numpy.uint32]:
        """(m, 3) as begun: all pairs as of the last update."""
        return self._live.pairs()

    def pairs_of(self, id: int) -> NDArray[numpy.uint32]:
        """(m, 3) as begun: the pairs of one object as of the last update, sorted by the other id.

        Empty for an id without pairs. The cost depends on the object's own pairs; only after an update
        that found all pairs from scratch the first calls scan all of them.
        """
        return self._live.pairs_of(id)

    def find_overlaps(
        self,
        boxes: BoxesLike,
        *,
        group: Array | None = None,
        mask: Array | None = None,
        owner: Array | None = None,
        world: Array | None = None,
        static: Array | None = None,
    ) -> NDArray[numpy.uint32]:
        """(m, 2) uint32, sorted: the index of a box, and the id of an object that it overlaps.

        Queries the current boxes of the objects, without the margin.
        """
        return self._live.find_overlaps(boxes, (group, mask, owner, world, static))

    def find_hits(
        self,
        boxes: BoxesLike,
        by: Array,
        *,
        which: Hits = "all",
        group: Array | None = None,
        mask: Array | None = None,
        owner: Array | None = None,
        world: Array | None = None,
        static: Array | None = None,
    ) -> tuple[NDArray[numpy.uint32], NDArray[numpy.float64]]:
        """Ray and shape casts: the objects that boxes hit when they move by `by` from time 0 to 1. A ray
        is a moving point: find_hits((origin, origin), direction).

        by: (n, 3) float32, one per box, or (n, 2) for 2-D boxes, in world units; finite, at most 3.4e38 per
            component: for an unlimited ray use one longer than the scene. float64 is copied, if every
            value is a float32.
        which: 'all' objects on the way, or the 'first' that is hit; of several at once the lowest id.

        Returns (pairs, times), sorted by pair: (m, 2) uint32, the index of a box and the id of an object
        that it hits, and (m,) float64, the time of first contact: 0 if they overlap at the start. Queries
        the current boxes of the objects, without the margin.
        """
        return self._live.find_hits(boxes, by, which, (group, mask, owner, world, static))

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
    """Queries of one thread. Any number of threads may query one BroadPhase at once, each with its
    own BroadPhaseQuery; calls release the GIL.

    During a query, a call that changes the BroadPhase raises RuntimeError; during such a call,
    queries do. So does a call during another one on the same BroadPhaseQuery.

    nan, inverted, threads, isa: as for BroadPhase; threads=1 if several threads query at once.
    """

    def __init__(
        self,
        *,
        nan: Nan = "refuse",
        inverted: Inverted = "inactive",
        threads: int = 0,
        isa: Isa = "auto",
    ) -> None:
        self._query = _throng.BroadPhaseQuery(nan, inverted, threads, isa)

    def __reduce__(self) -> NoReturn:
        raise TypeError("a BroadPhaseQuery is neither copied nor pickled: make another")

    def find_overlaps(
        self,
        objects: BroadPhase,
        boxes: BoxesLike,
        *,
        group: Array | None = None,
        mask: Array | None = None,
        owner: Array | None = None,
        world: Array | None = None,
        static: Array | None = None,
    ) -> NDArray[numpy.uint32]:
        """As BroadPhase.find_overlaps, on the objects of a BroadPhase."""
        return self._query.find_overlaps(
            _broad_phase_of(objects), boxes, (group, mask, owner, world, static)
        )

    def find_hits(
        self,
        objects: BroadPhase,
        boxes: BoxesLike,
        by: Array,
        *,
        which: Hits = "all",
        group: Array | None = None,
        mask: Array | None = None,
        owner: Array | None = None,
        world: Array | None = None,
        static: Array | None = None,
    ) -> tuple[NDArray[numpy.uint32], NDArray[numpy.float64]]:
        """As BroadPhase.find_hits, on the objects of a BroadPhase."""
        return self._query.find_hits(
            _broad_phase_of(objects), boxes, by, which, (group, mask, owner, world, static)
        )


def _broad_phase_of(objects: object) -> _throng.BroadPhase:
    if isinstance(objects, BroadPhase):
        return objects._live
    raise TypeError(f"objects: found a {type(objects).__name__}, wanted a BroadPhase")
