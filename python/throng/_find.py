"""Searches: find_pairs and Finder."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, NoReturn, Unpack, overload

import numpy
from numpy.typing import NDArray

from throng import _throng
from throng._batch import Batch, flattened, triples, with_worlds
from throng._exchange import check_result, integer_type, like, stream_address
from throng._types import (
    Algorithm,
    Backend,
    BoxesLike,
    FilterArrays,
    FilterLike,
    Inverted,
    Isa,
    Nan,
    NumpyBoxes,
    Order,
    PairType,
    ResultKind,
    Round,
    SearchOptions,
)

Filters = tuple[Any, ...]


@dataclass(frozen=True)
class _Arguments:
    """Boxes and filters as the module takes them, and the batches that they were."""

    boxes: Any
    other: Any
    filters: Filters
    other_filters: Filters
    batch: Batch | None
    other_batch: Batch | None

    def pairs(self, found: NDArray[Any]) -> NDArray[Any]:
        """(m, 2) flat indices as the caller's: of a batch (m, 3)."""
        if self.batch is None:
            return found
        return triples(found, self.batch, self.other_batch, self.other is None)


def _arguments(
    boxes: BoxesLike, other: BoxesLike | None, filters: Filters, other_filters: Filters
) -> _Arguments:
    flat, batch = flattened(boxes, "boxes")
    flat_other, other_batch = (None, None) if other is None else flattened(other, "other")
    if batch is not None:
        filters = with_worlds(batch, filters, "")
    if other_batch is not None:
        if batch is None or batch.worlds != other_batch.worlds:
            found = "boxes without worlds" if batch is None else f"{batch.worlds} worlds in boxes"
            raise ValueError(
                f"other: found {other_batch.worlds} worlds, and {found}, wanted the same number; of "
                "two sets the first has the worlds, and the second has them, too, or is in each"
            )
        other_filters = with_worlds(other_batch, other_filters, "other_")
    return _Arguments(flat, flat_other, filters, other_filters, batch, other_batch)


def _find(
    finder: _throng.Finder,
    boxes: BoxesLike,
    other: BoxesLike | None,
    filters: Filters,
    other_filters: Filters,
    result: object,
    stream: object,
    dtype: object,
) -> Any:
    check_result(result)
    kind = integer_type(dtype)
    given = _arguments(boxes, other, filters, other_filters)
    found = finder.find(
        given.boxes,
        given.other,
        given.filters,
        given.other_filters,
        stream_address(stream, given.boxes),
        result == "numpy",
    )
    return like(given.pairs(found), boxes, result, kind)


@overload
def find_pairs(
    boxes: NumpyBoxes,
    other: BoxesLike | None = None,
    *,
    result: ResultKind = "auto",
    stream: object = None,
    dtype: Literal["uint32"] = "uint32",
    **options: Unpack[SearchOptions],
) -> NDArray[numpy.uint32]: ...
@overload
def find_pairs(
    boxes: NumpyBoxes,
    other: BoxesLike | None = None,
    *,
    result: ResultKind = "auto",
    stream: object = None,
    dtype: Literal["int64"] | type[numpy.int64],
    **options: Unpack[SearchOptions],
) -> NDArray[numpy.int64]: ...
@overload
def find_pairs(
    boxes: BoxesLike,
    other: BoxesLike | None = None,
    *,
    result: Literal["numpy"],
    stream: object = None,
    dtype: Literal["uint32"] = "uint32",
    **options: Unpack[SearchOptions],
) -> NDArray[numpy.uint32]: ...
@overload
def find_pairs(
    boxes: BoxesLike,
    other: BoxesLike | None = None,
    *,
    result: Literal["numpy"],
    stream: object = None,
    dtype: Literal["int64"] | type[numpy.int64],
    **options: Unpack[SearchOptions],
) -> NDArray[numpy.int64]: ...
@overload
def find_pairs(
    boxes: BoxesLike,
    other: BoxesLike | None = None,
    *,
    result: ResultKind = "auto",
    stream: object = None,
    dtype: PairType = "uint32",
    **options: Unpack[SearchOptions],
) -> Any: ...
def find_pairs(
    boxes: BoxesLike,
    other: BoxesLike | None = None,
    *,
    group: FilterLike | None = None,
    mask: FilterLike | None = None,
    owner: FilterLike | None = None,
    world: FilterLike | None = None,
    static: FilterLike | None = None,
    other_group: FilterLike | None = None,
    other_mask: FilterLike | None = None,
    other_owner: FilterLike | None = None,
    other_world: FilterLike | None = None,
    other_static: FilterLike | None = None,
    margin: float = 0.0,
    order: Order = "any",
    algorithm: Algorithm = "auto",
    nan: Nan = "refuse",
    inverted: Inverted = "refuse",
    round: Round = "exact",
    threads: int = 0,
    backend: Backend = "auto",
    isa: Isa = "auto",
    result: ResultKind = "auto",
    stream: object = None,
    dtype: PairType = "uint32",
) -> Any:
    """All pairs of overlapping boxes.

    boxes: of shape (n, 6): lower x, y, z, upper x, y, z, in world units; or (n, 4) for 2-D: lower x, y,
        upper x, y; or (n, 2, 3), (n, 2, 2): lower and upper corners; or a tuple (lower, upper) of two
        arrays (n, 3) or (n, 2). With one more index in front, (worlds, n, ...), each world is searched
        for itself.
        NumPy or DLPack arrays of float32 or float64, read in place: any strides, except negative row
        strides; may be read-only. Lists and tuples become float64. The arrays must not change during
        the call. GPU arrays (PyTorch, CuPy, JAX) stay on the GPU, in a build with CUDA; all arrays of a
        call must be on one device, and on a GPU no values are converted.
    other: a second set of boxes: each pair is then a box of `boxes` and one of `other`. With worlds, the
        second set has as many, or is one that each world has.
    round: the handling of float64. 'exact': compared as float64, CPU only, 24 more bytes per box; if one
        of two sets is float32, it is copied to float64. 'outward': copied to float32, lower corners
        rounded down, upper corners up. On float32 boxes the option has no effect.

    Filters, one integer per box, or one for all; with worlds (worlds, n), or (n,) for each. A pair is
    reported if all given filters allow it. Those of the second set begin with other_.
    group, mask: uint32; (group a & mask b) and (group b & mask a) must both be nonzero; a missing
        one counts as all ones.
    owner: int32; equal owners never pair; -1: no owner.
    world: int32 world (environment); different worlds never pair; -1: in every world.
    static: uint8 or bool; two nonzero never pair.

    margin: boxes are compared as lower - margin and upper + margin, rounded outward to the compared
        type; in world units, not negative. A margin that is not a float32 is rounded up.
    order: 'any' is fastest; 'canonical': sorted by first, then second, the same bytes everywhere.
    algorithm: 'auto', 'all-pairs', 'grid'. The pairs are the same for each.
    nan: 'refuse' raises ValueError for a box with a NaN; 'inactive': such a box overlaps nothing.
    inverted: 'refuse' raises ValueError for a box with lower > upper on some axis, and names the likely
        mistake, such as boxes given as center and size (see boxes_from_center, boxes_from_intervals);
        'inactive': such a box is an empty slot and overlaps nothing.
    threads: maximum number; 0: one per processor.
    backend: 'auto', 'cpu'; 'emulated': the GPU pipeline on the CPU, slow, for tests.
    isa: the instruction set; 'auto': the widest available. GPU arrays ignore isa and threads.
    result: 'numpy': a NumPy array. 'same': an array of the boxes' library, on the same device, made by
        its from_dlpack. 'auto': 'numpy' for boxes on the CPU, 'same' for those on a GPU.
    stream: for GPU arrays: the CUDA stream to search on, an object of PyTorch, CuPy or cuda.core, or
        its address; None: the current stream of PyTorch or CuPy, else the default stream. On return
        the pairs are complete, for any stream.

    dtype: of the pairs: 'uint32', or 'int64', a copy, as PyTorch's indexing needs.

    Returns (m, 2), which owns its memory: with one set first < second, each pair once. Of worlds (m, 3):
    the world, and the indices of both boxes in it.

    Raises TypeError (not an array, wrong type), ValueError (wrong shape, a NaN, a value out of range),
    MemoryError, RuntimeError. The message names the argument, the value found, and the fix.

    Releases the GIL. Ctrl-C interrupts a search on the CPU with KeyboardInterrupt.
    """
    finder = _throng.Finder(
        order, algorithm, backend, nan, inverted, isa, margin, threads, 0, round, True
    )
    return _find(
        finder,
        boxes,
        other,
        (group, mask, owner, world, static),
        (other_group, other_mask, other_owner, other_world, other_static),
        result,
        stream,
        dtype,
    )


class Finder:
    """Finds pairs repeatedly and keeps its memory: later calls are faster than find_pairs.

    The options are those of find_pairs, but `inverted` is 'inactive' by default: boxes with
    lower > upper are empty slots, counted by result.inactive. In addition:
    memory_cap: for consume: limit of all memory of the library, in bytes; 0: no cap.

    One thread at a time; a call during another one raises RuntimeError. It cannot be copied or
    pickled.
    """

    def __init__(
        self,
        *,
        margin: float = 0.0,
        order: Order = "any",
        algorithm: Algorithm = "auto",
        nan: Nan = "refuse",
        inverted: Inverted = "inactive",
        round: Round = "exact",
        threads: int = 0,
        backend: Backend = "auto",
        isa: Isa = "auto",
        memory_cap: int = 0,
    ) -> None:
        self._finder = _throng.Finder(
            order, algorithm, backend, nan, inverted, isa, margin, threads, memory_cap, round, False
        )

    def __reduce__(self) -> NoReturn:
        raise TypeError(
            "a Finder cannot be copied or pickled: make another, throng.Finder(...) with the same "
            "options"
        )

    @overload
    def find(
        self,
        boxes: NumpyBoxes,
        other: BoxesLike | None = None,
        *,
        result: ResultKind = "auto",
        stream: object = None,
        dtype: Literal["uint32"] = "uint32",
        **filters: Unpack[FilterArrays],
    ) -> NDArray[numpy.uint32]: ...
    @overload
    def find(
        self,
        boxes: NumpyBoxes,
        other: BoxesLike | None = None,
        *,
        result: ResultKind = "auto",
        stream: object = None,
        dtype: Literal["int64"] | type[numpy.int64],
        **filters: Unpack[FilterArrays],
    ) -> NDArray[numpy.int64]: ...
    @overload
    def find(
        self,
        boxes: BoxesLike,
        other: BoxesLike | None = None,
        *,
        result: Literal["numpy"],
        stream: object = None,
        dtype: Literal["uint32"] = "uint32",
        **filters: Unpack[FilterArrays],
    ) -> NDArray[numpy.uint32]: ...
    @overload
    def find(
        self,
        boxes: BoxesLike,
        other: BoxesLike | None = None,
        *,
        result: Literal["numpy"],
        stream: object = None,
        dtype: Literal["int64"] | type[numpy.int64],
        **filters: Unpack[FilterArrays],
    ) -> NDArray[numpy.int64]: ...
    @overload
    def find(
        self,
        boxes: BoxesLike,
        other: BoxesLike | None = None,
        *,
        result: ResultKind = "auto",
        stream: object = None,
        dtype: PairType = "uint32",
        **filters: Unpack[FilterArrays],
    ) -> Any: ...
    def find(
        self,
        boxes: BoxesLike,
        other: BoxesLike | None = None,
        *,
        group: FilterLike | None = None,
        mask: FilterLike | None = None,
        owner: FilterLike | None = None,
        world: FilterLike | None = None,
        static: FilterLike | None = None,
        other_group: FilterLike | None = None,
        other_mask: FilterLike | None = None,
        other_owner: FilterLike | None = None,
        other_world: FilterLike | None = None,
        other_static: FilterLike | None = None,
        result: ResultKind = "auto",
        stream: object = None,
        dtype: PairType = "uint32",
    ) -> Any:
        """All pairs, as from find_pairs: (m, 2), or of worlds (m, 3); a new array for each call.

        The memory of a released NumPy result is reused by a later call. Counts, plan and times are in
        `result`.
        """
        return _find(
            self._finder,
            boxes,
            other,
            (group, mask, owner, world, static),
            (other_group, other_mask, other_owner, other_world, other_static),
            result,
            stream,
            dtype,
        )

    def consume(
        self,
        boxes: BoxesLike,
        callback: Callable[[NDArray[numpy.uint32]], object],
        other: BoxesLike | None = None,
        *,
        group: FilterLike | None = None,
        mask: FilterLike | None = None,
        owner: FilterLike | None = None,
        world: FilterLike | None = None,
        static: FilterLike | None = None,
        other_group: FilterLike | None = None,
        other_mask: FilterLike | None = None,
        other_owner: FilterLike | None = None,
        other_world: FilterLike | None = None,
        other_static: FilterLike | None = None,
    ) -> _throng.Result:
        """Passes the pairs to callback(pairs) in blocks, (k, 2) uint32, or of worlds (k, 3), and stores no
        others.

        The callback runs on a thread of the library, one call at a time. If it returns a false value
        other than None, the search stops; its exceptions propagate. A memory_cap that is too small raises
        MemoryError, which names the bytes needed.
        """
        given = _arguments(
            boxes,
            other,
            (group, mask, owner, world, static),
            (other_group, other_mask, other_owner, other_world, other_static),
        )
        receive = callback
        if given.batch is not None and callable(callback):
            receive = lambda pairs: callback(given.pairs(pairs))  # noqa: E731
        self._finder.consume(
            given.boxes, receive, given.other, given.filters, given.other_filters
        )
        return self._finder.result

    def explain(
        self,
        boxes: BoxesLike,
        other: BoxesLike | None = None,
        *,
        group: FilterLike | None = None,
        mask: FilterLike | None = None,
        owner: FilterLike | None = None,
        world: FilterLike | None = None,
        static: FilterLike | None = None,
        other_group: FilterLike | None = None,
        other_mask: FilterLike | None = None,
        other_owner: FilterLike | None = None,
        other_world: FilterLike | None = None,
        other_static: FilterLike | None = None,
    ) -> _throng.Explanation:
        """Finds the pairs as find() does, and explains the cost: cells and their occupancy, the largest
        boxes, memory, and advice to make it faster.

        CPU only. About 100 times as long as find() for small sets. float64 is explained as float32,
        rounded outward.
        """
        given = _arguments(
            boxes,
            other,
            (group, mask, owner, world, static),
            (other_group, other_mask, other_owner, other_world, other_static),
        )
        return self._finder.explain(given.boxes, given.other, given.filters, given.other_filters)

    @property
    def result(self) -> _throng.Result:
        """The last call's counts, plan and times."""
        return self._finder.result

    @property
    def memory_bytes(self) -> int:
        """Bytes of the library's workspace."""
        return self._finder.memory_bytes
