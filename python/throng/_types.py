"""What arguments may be, for type checkers."""

from typing import Any, Literal, Protocol, TypeAlias

Order: TypeAlias = Literal["any", "canonical"]
Algorithm: TypeAlias = Literal["auto", "all-pairs", "grid"]
Backend: TypeAlias = Literal["auto", "cpu", "cuda", "emulated"]
Nan: TypeAlias = Literal["refuse", "inactive"]
Hits: TypeAlias = Literal["all", "first"]
Round: TypeAlias = Literal["outward"]
Isa: TypeAlias = Literal["auto", "scalar", "sse4", "avx2", "avx512", "neon"]


class Array(Protocol):
    """An array of NumPy, PyTorch, JAX, ...: whatever speaks DLPack."""

    def __dlpack__(self, *args: Any, **kwargs: Any) -> Any: ...


BoxesLike: TypeAlias = Array | tuple[Array, Array]
