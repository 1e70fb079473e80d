"""Argument types, for type checkers."""

from collections.abc import Sequence
from typing import Any, Literal, Protocol, SupportsIndex, TypeAlias, TypedDict

import numpy
from numpy.typing import NDArray

Order: TypeAlias = Literal["any", "canonical"]
Algorithm: TypeAlias = Literal["auto", "all-pairs", "grid"]
Backend: TypeAlias = Literal["auto", "cpu", "cuda", "emulated"]
Nan: TypeAlias = Literal["refuse", "inactive"]
Inverted: TypeAlias = Literal["refuse", "inactive"]
Hits: TypeAlias = Literal["all", "first"]
Round: TypeAlias = Literal["outward", "exact"]
ResultKind: TypeAlias = Literal["auto", "numpy", "same"]
PairType: TypeAlias = Literal["uint32", "int64"] | type[numpy.uint32] | type[numpy.int64] | numpy.dtype[Any]
Isa: TypeAlias = Literal["auto", "scalar", "sse4", "avx2", "avx512", "neon"]


class Array(Protocol):
    """An array of NumPy, PyTorch, JAX, ...: any DLPack producer."""

    def __dlpack__(self, *args: Any, **kwargs: Any) -> Any: ...


# An array, a list or tuple of boxes, or a tuple (lower, upper).
BoxesLike: TypeAlias = Array | Sequence[Any]
NumpyBoxes: TypeAlias = NDArray[Any] | tuple[NDArray[Any], NDArray[Any]] | list[Any]
# One integer per box, or one for all.
FilterLike: TypeAlias = Array | Sequence[int] | SupportsIndex | numpy.bool_


class FilterArrays(TypedDict, total=False):
    """One value per box, or one for all."""

    group: FilterLike | None
    mask: FilterLike | None
    owner: FilterLike | None
    world: FilterLike | None
    static: FilterLike | None
    other_group: FilterLike | None
    other_mask: FilterLike | None
    other_owner: FilterLike | None
    other_world: FilterLike | None
    other_static: FilterLike | None


class SearchOptions(FilterArrays, total=False):
    """Keyword arguments of find_pairs."""

    margin: float
    order: Order
    algorithm: Algorithm
    nan: Nan
    inverted: Inverted
    round: Round
    threads: int
    backend: Backend
    isa: Isa
