"""Argument types, for type checkers."""

from typing import Any, Literal, Protocol, TypeAlias, TypedDict

from numpy.typing import NDArray

Order: TypeAlias = Literal["any", "canonical"]
Algorithm: TypeAlias = Literal["auto", "all-pairs", "grid"]
Backend: TypeAlias = Literal["auto", "cpu", "cuda", "emulated"]
Nan: TypeAlias = Literal["refuse", "inactive"]
Inverted: TypeAlias = Literal["refuse", "inactive"]
Hits: TypeAlias = Literal["all", "first"]
Round: TypeAlias = Literal["outward", "exact"]
ResultKind: TypeAlias = Literal["auto", "numpy", "same"]
Isa: TypeAlias = Literal["auto", "scalar", "sse4", "avx2", "avx512", "neon"]


class Array(Protocol):
    """An array of NumPy, PyTorch, JAX, ...: any DLPack producer."""

    def __dlpack__(self, *args: Any, **kwargs: Any) -> Any: ...


BoxesLike: TypeAlias = Array | tuple[Array, Array]
NumpyBoxes: TypeAlias = NDArray[Any] | tuple[NDArray[Any], NDArray[Any]]


class FilterArrays(TypedDict, total=False):
    """One value per box."""

    group: Array | None
    mask: Array | None
    owner: Array | None
    world: Array | None
    static: Array | None
    other_group: Array | None
    other_mask: Array | None
    other_owner: Array | None
    other_world: Array | None
    other_static: Array | None


class SearchOptions(FilterArrays, total=False):
    """Keyword arguments of find_pairs."""

    margin: float
    order: Order
    algorithm: Algorithm
    nan: Nan
    inverted: Inverted
    round: Round | None
    threads: int
    backend: Backend
    isa: Isa
