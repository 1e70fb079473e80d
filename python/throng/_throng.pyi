"""The extension module (python/module.cpp). Use the package throng."""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy
from numpy.typing import NDArray

Filters: TypeAlias = tuple[Any, Any, Any, Any, Any]

__version__: str
scene_names: tuple[str, ...]

class StageTimes:
    """How long each stage of a search took, in milliseconds."""

    @property
    def plan_ms(self) -> float:
        """Sampling, planning, splitting by world and static."""
    @property
    def bin_ms(self) -> float:
        """Reading, checking and sorting the boxes into columns."""
    @property
    def find_ms(self) -> float:
        """Finding and writing pairs."""
    @property
    def order_ms(self) -> float:
        """Sorting pairs, where order is 'canonical'."""
    @property
    def total_ms(self) -> float: ...

class Plan:
    """What the planner chose, and why."""

    @property
    def backend(self) -> str: ...
    @property
    def algorithm(self) -> str: ...
    @property
    def isa(self) -> str: ...
    @property
    def threads(self) -> int: ...
    @property
    def sweep_axis(self) -> int:
        """0, 1 or 2: the axis along which each column is swept."""
    @property
    def columns(self) -> tuple[int, int, int]:
        """How many columns, or finest cells, along each axis."""
    @property
    def expected_ns(self) -> float:
        """What the planner thought it would cost."""
    @property
    def reason(self) -> str:
        """One sentence."""

class Result:
    """What a search tells beside its pairs."""

    @property
    def status(self) -> str:
        """'ok', or 'stopped' where a consumer returned False."""
    @property
    def found(self) -> int:
        """Pairs there are."""
    @property
    def written(self) -> int:
        """Pairs returned, or handed to the consumer."""
    @property
    def inactive(self) -> int:
        """Boxes that overlap nothing: lower > upper, or a NaN where allowed."""
    @property
    def comparisons(self) -> int:
        """Candidate pairs compared (each lane of a vector counts)."""
    @property
    def plan(self) -> Plan: ...
    @property
    def times(self) -> StageTimes: ...

class Finder:
    def __init__(
        self,
        order: str,
        algorithm: str,
        backend: str,
        nan: str,
        isa: str,
        margin: float,
        threads: int,
        memory_cap: int,
        round: str | None,
        once: bool,
    ) -> None: ...
    def find(
        self, boxes: Any, other: Any, filters: Filters, other_filters: Filters
    ) -> NDArray[numpy.uint32]: ...
    def consume(
        self,
        boxes: Any,
        callback: Callable[[NDArray[numpy.uint32]], object],
        other: Any,
        filters: Filters,
        other_filters: Filters,
    ) -> None: ...
    @property
    def result(self) -> Result: ...
    @property
    def memory_bytes(self) -> int: ...

class BroadPhase:
    def __init__(self, margin: float, nan: str, threads: int, isa: str) -> None: ...
    def copy(self) -> BroadPhase: ...
    def add(self, boxes: Any, filters: Filters) -> NDArray[numpy.uint32]: ...
    def remove(self, ids: Any) -> None: ...
    def move(self, ids: Any, boxes: Any) -> None: ...
    def move_all(self, boxes: Any) -> None: ...
    def set_filters(self, ids: Any, filters: Filters) -> None: ...
    def shift_origin(self, x: float, y: float, z: float) -> None: ...
    def update(self) -> Result: ...
    def begun(self) -> NDArray[numpy.uint32]: ...
    def ended(self) -> NDArray[numpy.uint32]: ...
    def pairs(self) -> NDArray[numpy.uint32]: ...
    def find_overlaps(self, boxes: Any, filters: Filters) -> NDArray[numpy.uint32]: ...
    def is_alive(self, id: int) -> bool: ...
    @property
    def object_count(self) -> int: ...
    @property
    def pair_count(self) -> int: ...
    @property
    def id_limit(self) -> int: ...
    @property
    def slot_limit(self) -> int: ...

def scene(
    name: str, objects: int, frames: int, density: float | None, seed: int, moving: float
) -> NDArray[numpy.float32]: ...
def scene_worlds(name: str, objects: int) -> NDArray[numpy.int32] | None: ...
def load_boxes(path: str, round: str | None) -> NDArray[numpy.float32]: ...
def save_boxes(path: str, frames: list[Any]) -> None: ...
def save_pairs(path: str, pairs: Any) -> None: ...
def update_boxes(
    position: Any,
    shapes: Any,
    rotation: Any,
    displacement: Any,
    shape: Any,
    points: Any,
    margin: float,
    threads: int,
) -> NDArray[numpy.float32]: ...
def forget_threads() -> None: ...
