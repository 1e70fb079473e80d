"""Objects that live: BroadPhase."""

import copy
from collections.abc import Sequence
from typing import Any, NamedTuple, NoReturn, Self

import numpy
from numpy.typing import NDArray

from throng import _throng
from throng._numbers import numbers
from throng._types import Array, BoxesLike, Hits, Inverted, Isa, Nan


class Filter(NamedTuple):
    """What one object pairs with: a value of each filter."""

    group: int = 0xFFFFFFFF
    mask: int = 0xFFFFFFFF
    owner: int = -1
    world: int = -1
    static: bool = False


class BroadPhase:
    """Keeps objects from frame to frame, and tells which pairs began and which ended.

    Objects are added, moved and removed, by ids; update() then tells what this did to the pairs. The
    cost follows the objects that changed. A call that raises has changed nothing; Ctrl-C ends a long
    update(), find_overlaps() or find_hits() soon, and what changed is told by the next update().

    margin, nan, inverted, threads, isa: as of find_pairs, but `inverted` is 'inactive' by default:
    boxes with lower > upper are empty slots. One thread at a time; a call during another one raises
    RuntimeError. Several threads query one at once by a BroadPhaseQuery each.
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
        """A snapshot: ids, slots and what the last update told are the same. The module copy makes
        such, too.
        """
        return self.__copy__()

    def __copy__(self) -> Self:
        made = type(self).__new__(type(self))
        vars(made).update(vars(self))  # what a class derived from this one has
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
            "a BroadPhase is not pickled: pickle what its objects have, box(id) and filter(id), and "
            "add that to a new one; within the process copy() makes a snapshot"
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

        Returns their ids, (n,) uint32: 0, 1, 2, ... where none was removed. The id of a removed object
        is given away again only after an update.
        """
        return self._live.add(boxes, (group, mask, owner, world, static))

    def remove(self, ids: Array) -> None:
        """Removes objects. ValueError for an id that is not alive, or twice in the list."""
        self._live.remove(ids)

    def move(self, ids: Array, boxes: BoxesLike) -> None:
        """Gives objects new boxes, one an id; of several calls before an update the last wins.

        The list is taken whole or not at all: a box with a NaN refuses it, and ValueError names its
        place and id; with nan='inactive' it is taken, and overlaps nothing.
        """
        self._live.move(ids, boxes)

    def move_all(self, boxes: BoxesLike) -> None:
        """The same for all: boxes[id] for every id below id_limit; it finds out which differ."""
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
        """One value an id; filters that are not given stay as they were."""
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
        """(m, 3) uint32, sorted: first < second, which are ids, and the pair's slot.

        The slot is the pair's own for as long as it lives: a place for what you keep of it.
        """
        return self._live.begun()

    @property
    def ended(self) -> NDArray[numpy.uint32]:
        """(m, 3) as begun; these slots are free now: the next update may give them away."""
        return self._live.ended()

    @property
    def pairs(self) -> NDArray[numpy.uint32]:
        """(m, 3) as begun: all pairs there are since the last update."""
        return self._live.pairs()

    def pairs_of(self, id: int) -> NDArray[numpy.uint32]:
        """(m, 3) as begun: the pairs of one object since the last update, sorted by the other one.

        Empty for an id that has none. It costs what the object's own pairs do; only after an update
        that found all pairs anew the first calls look through all of them.
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
        """(m, 2) uint32, sorted: the number of a box, and the id of an object that it overlaps.

        Asks the objects as they were given last. The margin plays no part.
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
        """What boxes meet that go straight by `by` in the time from 0 to 1. A ray is a point that
        does: find_hits((origin, origin), direction).

        by: (n, 3) float32, one a box, or of 2-D boxes (n, 2), in units of your world; finite, at most
            3.4e38 a component: a ray without a limit is one that is longer than the scene. float64 is
            copied, if every value is a float32.
        which: 'all' objects on the way, or the 'first' that is met; of several at once that of the
            lowest id.

        Returns (pairs, times), sorted by pair: (m, 2) uint32, the number of a box and the id of an
        object that it meets, and (m,) float64, when it first touches it: 0 where it does from the
        start. Asks the objects as they were given last. The margin plays no part.
        """
        return self._live.find_hits(boxes, by, which, (group, mask, owner, world, static))

    def is_alive(self, id: int) -> bool:
        """Whether an object has this id."""
        return self._live.is_alive(id)

    def box(self, id: int) -> NDArray[numpy.float32]:
        """(6,) float32: lower x, y, z, upper x, y, z of an object, as it was given last.

        ValueError for an id that is not alive.
        """
        return self._live.box(id)

    def filter(self, id: int) -> Filter:
        """What an object pairs with, as set_filters was given it last; what was never given is as if
        there were no such filter. ValueError for an id that is not alive.
        """
        return Filter(*self._live.filter(id))

    def __len__(self) -> int:
        return self._live.object_count

    @property
    def pair_count(self) -> int:
        """How many pairs live."""
        return self._live.pair_count

    @property
    def id_limit(self) -> int:
        """All ids are below this."""
        return self._live.id_limit

    @property
    def slot_limit(self) -> int:
        """All slots of pairs that live, or ended in the last update, are below this."""
        return self._live.slot_limit


class BroadPhaseQuery:
    """Queries of one thread. Any number of threads may query one BroadPhase at once, each by a
    BroadPhaseQuery of its own, and other Python threads run meanwhile.

    While a query is under way, a call that changes the BroadPhase raises RuntimeError; during such a
    call queries do. So does a call during another one on the same BroadPhaseQuery.

    nan, inverted, threads, isa: as of BroadPhase; threads=1 where several threads query at once.
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
        """As BroadPhase.find_overlaps, of the objects of a BroadPhase."""
        return self._query.find_overlaps(
            _live_of(objects), boxes, (group, mask, owner, world, static)
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
        """As BroadPhase.find_hits, of the objects of a BroadPhase."""
        return self._query.find_hits(
            _live_of(objects), boxes, by, which, (group, mask, owner, world, static)
        )


def _live_of(objects: object) -> _throng.BroadPhase:
    if isinstance(objects, BroadPhase):
        return objects._live
    raise TypeError(f"objects: found a {type(objects).__name__}, wanted a BroadPhase")
