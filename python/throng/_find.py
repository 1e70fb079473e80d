"""Searches: find_pairs and Finder."""

from collections.abc import Callable
from typing import Any, Literal, NoReturn, Unpack, overload

import numpy
from numpy.typing import NDArray

from throng import _throng
from throng._exchange import check_result, like, stream_address
from throng._types import (
    Algorithm,
    Array,
    Backend,
    BoxesLike,
    FilterArrays,
    Inverted,
    Isa,
    Nan,
    NumpyBoxes,
    Order,
    ResultKind,
    Round,
    SearchOptions,
)


@overload
def find_pairs(
    boxes: NumpyBoxes,
    other: BoxesLike | None = None,
    *,
    result: ResultKind = "auto",
    stream: object = None,
    **options: Unpack[SearchOptions],
) -> NDArray[numpy.uint32]: ...
@overload
def find_pairs(
    boxes: BoxesLike,
    other: BoxesLike | None = None,
    *,
    result: Literal["numpy"],
    stream: object = None,
    **options: Unpack[SearchOptions],
) -> NDArray[numpy.uint32]: ...
@overload
def find_pairs(
    boxes: BoxesLike,
    other: BoxesLike | None = None,
    *,
    result: ResultKind = "auto",
    stream: object = None,
    **options: Unpack[SearchOptions],
) -> Any: ...
def find_pairs(
    boxes: BoxesLike,
    other: BoxesLike | None = None,
    *,
    group: Array | None = None,
    mask: Array | None = None,
    owner: Array | None = None,
    world: Array | None = None,
    static: Array | None = None,
    other_group: Array | None = None,
    other_mask: Array | None = None,
    other_owner: Array | None = None,
    other_world: Array | None = None,
    other_static: Array | None = None,
    margin: float = 0.0,
    order: Order = "any",
    algorithm: Algorithm = "auto",
    nan: Nan = "refuse",
    inverted: Inverted = "refuse",
    round: Round | None = None,
    threads: int = 0,
    backend: Backend = "auto",
    isa: Isa = "auto",
    result: ResultKind = "auto",
    stream: object = None,
) -> Any:
    """All pairs of overlapping boxes.

    boxes: float32 of shape (n, 6): lower x, y, z, upper x, y, z, in units of your world; or (n, 4)
        for 2-D: lower x, y, upper x, y; or (n, 2, 3), (n, 2, 2): lower and upper corners; or a tuple
        (lower, upper) of two arrays (n, 3) or (n, 2).
        NumPy's arrays and whatever speaks DLPack, read where they lie: any strides, so long as rows
        do not run backwards; read-only is fine. float64 is copied to float32, unless `round` says
        otherwise. No box may change during the call. Arrays on a GPU (PyTorch, CuPy, JAX) stay
        there, in a build with CUDA; all arrays of a call in one place, and there nothing is
        converted.
    other: a second set of boxes: pairs are then of a box of `boxes` and one of `other`.
    round: what becomes of float64. None: float32, if every value is one, else ValueError. 'outward':
        float32, lower corners rounded down, upper ones up. 'exact': it is compared as it is, read
        where it lies, on the CPU alone, and takes 24 bytes a box more; where one of two sets is
        float32, that is copied to float64; where both are, they are searched as without it.

    Filters, one value a box; a pair is reported when every given one allows it. Those of the second
    set begin with other_.
    group, mask: uint32; (group a & mask b) and (group b & mask a) must both be nonzero; a missing
        one counts as all ones.
    owner: int32; equal owners never pair; -1 is nobody's.
    world: int32; different worlds never pair; -1 meets every world.
    static: uint8 or bool; two nonzero never pair.

    margin: boxes are compared as lower - margin and upper + margin, rounded outward to the type
        that is compared; in units of your world, not negative. A margin that is no float32 is
        rounded up.
    order: 'any' is fastest; 'canonical': sorted by first, then second, the same bytes everywhere.
    algorithm: 'auto', 'all-pairs', 'grid'. The pairs are the same for each.
    nan: 'refuse' raises ValueError at a box with a NaN; 'inactive': such a box overlaps nothing.
    inverted: 'refuse' raises ValueError at a box with lower > upper on some axis, and names the likely
        mistake, as boxes given as center and size (see boxes_from_center, boxes_from_intervals);
        'inactive': such a box is an empty slot and overlaps nothing.
    threads: at most so many; 0: as many as there are processors.
    backend: 'auto', 'cpu'; 'emulated': what a GPU would run, slowly, for tests.
    isa: the instruction set; 'auto' takes the widest there is. Of a GPU's arrays neither this nor
        threads matters.
    result: 'numpy': an array of NumPy. 'same': of the library that the boxes are of, where they lie,
        made by its from_dlpack. 'auto': of NumPy for boxes on the CPU, 'same' for those on a GPU.
    stream: for arrays on a GPU: the CUDA stream to search on, an object of PyTorch, CuPy or
        cuda.core, or its address; None: that which PyTorch or CuPy works on, else the default one.
        The pairs are there when this returns, for any stream.

    Returns (m, 2) uint32, which owns its memory: of one set first < second, each pair once.

    Raises TypeError (no array, wrong type), ValueError (wrong shape, a NaN, a value out of range),
    MemoryError, RuntimeError. The message names the argument, what it was, and what would do.

    Other Python threads run meanwhile. Ctrl-C ends a search on the CPU soon and raises
    KeyboardInterrupt.
    """
    finder = _throng.Finder(
        order, algorithm, backend, nan, inverted, isa, margin, threads, 0, round, True
    )
    check_result(result)
    found = finder.find(
        boxes,
        other,
        (group, mask, owner, world, static),
        (other_group, other_mask, other_owner, other_world, other_static),
        stream_address(stream, boxes),
        result == "numpy",
    )
    return like(found, boxes, result)


class Finder:
    """Finds pairs frame after frame, and keeps its memory: a warm one is faster than find_pairs.

    The options are those of find_pairs, but `inverted` is 'inactive' by default: boxes with
    lower > upper are empty slots, which result.inactive counts. And
    memory_cap: for consume: all memory that the library may take, in bytes; 0: no cap.

    One thread at a time; a call during another one raises RuntimeError. It is neither copied nor
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
        round: Round | None = None,
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
            "a Finder is neither copied nor pickled: make another, throng.Finder(...) with the same "
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
        **filters: Unpack[FilterArrays],
    ) -> NDArray[numpy.uint32]: ...
    @overload
    def find(
        self,
        boxes: BoxesLike,
        other: BoxesLike | None = None,
        *,
        result: ResultKind = "auto",
        stream: object = None,
        **filters: Unpack[FilterArrays],
    ) -> Any: ...
    def find(
        self,
        boxes: BoxesLike,
        other: BoxesLike | None = None,
        *,
        group: Array | None = None,
        mask: Array | None = None,
        owner: Array | None = None,
        world: Array | None = None,
        static: Array | None = None,
        other_group: Array | None = None,
        other_mask: Array | None = None,
        other_owner: Array | None = None,
        other_world: Array | None = None,
        other_static: Array | None = None,
        result: ResultKind = "auto",
        stream: object = None,
    ) -> Any:
        """All pairs, as find_pairs gives them: (m, 2) uint32, an array of its own for each call.

        The memory of an array of NumPy's that you let go of serves a later call. `result` tells the
        rest.
        """
        check_result(result)
        found = self._finder.find(
            boxes,
            other,
            (group, mask, owner, world, static),
            (other_group, other_mask, other_owner, other_world, other_static),
            stream_address(stream, boxes),
            result == "numpy",
        )
        return like(found, boxes, result)

    def consume(
        self,
        boxes: BoxesLike,
        callback: Callable[[NDArray[numpy.uint32]], object],
        other: BoxesLike | None = None,
        *,
        group: Array | None = None,
        mask: Array | None = None,
        owner: Array | None = None,
        world: Array | None = None,
        static: Array | None = None,
        other_group: Array | None = None,
        other_mask: Array | None = None,
        other_owner: Array | None = None,
        other_world: Array | None = None,
        other_static: Array | None = None,
    ) -> _throng.Result:
        """Hands the pairs to callback(pairs) in blocks, (k, 2) uint32, and stores no others.

        The callback runs on a thread of the library's, one call at a time. If what it returns is
        false, and not None, the search stops; what it raises comes through. A memory_cap that is too small raises MemoryError,
        which names the bytes needed.
        """
        self._finder.consume(
            boxes,
            callback,
            other,
            (group, mask, owner, world, static),
            (other_group, other_mask, other_owner, other_world, other_static),
        )
        return self._finder.result

    def explain(
        self,
        boxes: BoxesLike,
        other: BoxesLike | None = None,
        *,
        group: Array | None = None,
        mask: Array | None = None,
        owner: Array | None = None,
        world: Array | None = None,
        static: Array | None = None,
        other_group: Array | None = None,
        other_mask: Array | None = None,
        other_owner: Array | None = None,
        other_world: Array | None = None,
        other_static: Array | None = None,
    ) -> _throng.Explanation:
        """Finds the pairs as find() does, and tells why that costs what it does, and what would make
        it faster: cells and how full they are, the largest boxes, memory, advice.

        By the CPU alone. Takes some 100 times as long as find() for small sets. ValueError for a
        Finder with round='exact'.
        """
        return self._finder.explain(
            boxes,
            other,
            (group, mask, owner, world, static),
            (other_group, other_mask, other_owner, other_world, other_static),
        )

    @property
    def result(self) -> _throng.Result:
        """What the last call told beside its pairs: counts, plan, times."""
        return self._finder.result

    @property
    def memory_bytes(self) -> int:
        """Bytes that the library's workspace holds now."""
        return self._finder.memory_bytes
