"""The extension module (python/module.cpp). Use the package throng."""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy
from numpy.typing import NDArray

Filters: TypeAlias = tuple[Any, ...]
# Vertices, faces, and the rows of a transform or None.
MeshArrays: TypeAlias = tuple[Any, Any, tuple[float, ...] | None]
# Lower x, y, z, upper x, y, z.
Bounds: TypeAlias = tuple[float, float, float, float, float, float]
Point: TypeAlias = tuple[float, float, float]

__version__: str
has_cuda: bool
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
    """The planner's choice, and the reason."""

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
        """Number of columns, or finest cells, along each axis."""
    @property
    def expected_ns(self) -> float:
        """The planner's cost estimate."""
    @property
    def reason(self) -> str:
        """One sentence."""

class Result:
    """Counts, plan and times of a search."""

    @property
    def status(self) -> str:
        """'ok', or 'stopped' where a consumer wanted no more."""
    @property
    def found(self) -> int:
        """Number of pairs found."""
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
    def visited(self) -> int:
        """Cells, columns, records and tree nodes visited, in addition to comparisons; 0 on a GPU."""
    @property
    def plan(self) -> Plan: ...
    @property
    def times(self) -> StageTimes: ...

class MeshResult(Result):
    """Counts, plan and times of a search of triangles."""

    @property
    def candidates(self) -> int:
        """Pairs of triangles whose boxes overlap, each tested once."""
    @property
    def exact_tests(self) -> int:
        """Candidates that floating-point arithmetic could not decide."""

class SizeClass:
    """Boxes of similar largest extent."""

    @property
    def least(self) -> float:
        """Lower limit of their extent (inclusive), in world units."""
    @property
    def below(self) -> float:
        """Upper limit (exclusive); 0: boxes of no extent."""
    @property
    def boxes(self) -> int: ...
    @property
    def cells_per_box(self) -> float:
        """0 where there are no cells."""

class LargeBox:
    """One of the largest boxes."""

    @property
    def index(self) -> int: ...
    @property
    def in_second_set(self) -> bool:
        """Whether it belongs to `other`."""
    @property
    def extent(self) -> float:
        """The largest of the three, in world units."""
    @property
    def cells(self) -> int:
        """Number of cells that it touches."""

class DenseCell:
    """One of the cells with the most boxes."""

    @property
    def bounds(self) -> Bounds:
        """The outermost cells extend to infinity."""
    @property
    def boxes(self) -> int: ...

class Candidate:
    """A way to search, with its expected time."""

    @property
    def algorithm(self) -> str:
        """'all-pairs' or 'grid'."""
    @property
    def sweep_axis(self) -> int:
        """0, 1 or 2."""
    @property
    def columns(self) -> tuple[int, int, int]:
        """Of the grid, along x, y, z."""
    @property
    def expected_ns(self) -> float:
        """Expected time on one thread, ns."""

class CellClass:
    """Cells with similar numbers of boxes."""

    @property
    def least(self) -> int:
        """Lower limit of their number of boxes (inclusive)."""
    @property
    def below(self) -> int:
        """Upper limit (exclusive)."""
    @property
    def cells(self) -> int: ...
    @property
    def boxes(self) -> int:
        """Number of boxes in all of them."""

class Explanation:
    """Why a search costs what it does."""

    @property
    def result(self) -> Result:
        """Of the explained search."""
    @property
    def boxes(self) -> int:
        """Of both sets, inactive ones included."""
    @property
    def cells(self) -> int:
        """Of the grid; 0: there is no single grid for all boxes."""
    @property
    def entries(self) -> int:
        """Entries of boxes in cells: a box is in every cell that it touches."""
    @property
    def occupied(self) -> int:
        """Cells with a box in them."""
    @property
    def tests_per_pair(self) -> float:
        """Candidate pairs compared per pair found; 0: none was found."""
    @property
    def tests_per_box(self) -> float: ...
    @property
    def memory_bytes(self) -> int:
        """Held by the Finder."""
    @property
    def size_classes(self) -> list[SizeClass]:
        """By largest extent, in classes of a factor of two, the smallest first."""
    @property
    def largest(self) -> list[LargeBox]:
        """Up to ten boxes."""
    @property
    def densest(self) -> list[DenseCell]:
        """Up to ten cells."""
    @property
    def cell_classes(self) -> list[CellClass]:
        """Cells by number of boxes, in classes of a factor of two, the emptiest first; without empty
        cells.
        """
    @property
    def occupancy(self) -> NDArray[numpy.uint32]:
        """Boxes in each cell, by x, y, z; of shape (0, 0, 0) where there are no cells."""
    @property
    def grid(self) -> Bounds:
        """The region that the cells divide into equal parts."""
    @property
    def candidates(self) -> list[Candidate]:
        """Brute force and the best grid along each axis, the shortest expected time first. The first
        grid is chosen; brute force for few boxes or on request. Empty without a single plan for all boxes.
        """
    @property
    def memory(self) -> dict[str, int]:
        """Memory by purpose, in bytes."""
    @property
    def advice(self) -> list[str]:
        """Suggestions to make it faster, each a sentence with its reason."""

class Finder:
    def __init__(
        self,
        order: str,
        algorithm: str,
        backend: str,
        nan: str,
        inverted: str,
        isa: str,
        margin: float,
        threads: int,
        memory_cap: int,
        round: str,
        once: bool,
    ) -> None: ...
    def find(
        self,
        boxes: Any,
        other: Any,
        filters: Filters,
        other_filters: Filters,
        stream: int,
        to_host: bool,
    ) -> Any: ...
    def consume(
        self,
        boxes: Any,
        callback: Callable[[NDArray[numpy.uint32]], object],
        other: Any,
        filters: Filters,
        other_filters: Filters,
    ) -> None: ...
    def explain(
        self, boxes: Any, other: Any, filters: Filters, other_filters: Filters
    ) -> Explanation: ...
    @property
    def result(self) -> Result: ...
    @property
    def memory_bytes(self) -> int: ...

class MeshFinder:
    def __init__(
        self,
        order: str,
        algorithm: str,
        backend: str,
        isa: str,
        threads: int,
        memory_cap: int,
        once: bool,
    ) -> None: ...
    def find(
        self,
        mesh: MeshArrays,
        other: MeshArrays | None,
        distance: float | None,
        filters: Filters,
        other_filters: Filters,
    ) -> NDArray[numpy.uint32]: ...
    def consume(
        self,
        mesh: MeshArrays,
        callback: Callable[[NDArray[numpy.uint32]], object],
        other: MeshArrays | None,
        distance: float | None,
        filters: Filters,
        other_filters: Filters,
    ) -> None: ...
    @property
    def result(self) -> MeshResult: ...
    @property
    def memory_bytes(self) -> int: ...

class ContactFinder:
    def __init__(self, order: str, isa: str, threads: int) -> None: ...
    def find(
        self,
        vertices_t0: Any,
        vertices_t1: Any,
        edges: Any,
        faces: Any,
        radius: float,
        dimension: int | None,
        rings: int,
        group: Any,
        mask: Any,
    ) -> tuple[NDArray[numpy.uint32], NDArray[numpy.uint32], NDArray[numpy.uint32]]: ...
    @property
    def result(self) -> Result: ...
    @property
    def memory_bytes(self) -> int: ...

class BroadPhase:
    def __init__(
        self, margin: float, nan: str, inverted: str, threads: int, isa: str
    ) -> None: ...
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
    def pairs_of(self, id: int | None) -> NDArray[numpy.uint32]: ...
    def find_overlaps(self, boxes: Any, filters: Filters) -> NDArray[numpy.uint32]: ...
    def find_hits(
        self, boxes: Any, by: Any, which: str, filters: Filters
    ) -> tuple[NDArray[numpy.uint32], NDArray[numpy.float64]]: ...
    def raycast(
        self,
        origin: list[float],
        direction: list[float],
        max_distance: float,
        layer_mask: int,
        world: int,
    ) -> tuple[int, float, Point, Point] | None: ...
    def is_alive(self, id: int) -> bool: ...
    def box(self, id: int) -> NDArray[numpy.float32]: ...
    def filter(self, id: int) -> tuple[int, int, int, int, bool]: ...
    @property
    def object_count(self) -> int: ...
    @property
    def pair_count(self) -> int: ...
    @property
    def id_limit(self) -> int: ...
    @property
    def slot_limit(self) -> int: ...

class BroadPhaseQuery:
    def __init__(self, nan: str, inverted: str, threads: int, isa: str) -> None: ...
    def find_overlaps(
        self, objects: BroadPhase, boxes: Any, filters: Filters
    ) -> NDArray[numpy.uint32]: ...
    def find_hits(
        self, objects: BroadPhase, boxes: Any, by: Any, which: str, filters: Filters
    ) -> tuple[NDArray[numpy.uint32], NDArray[numpy.float64]]: ...

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
def describe_intersections(
    pairs: Any, mesh: MeshArrays, other: MeshArrays | None, threads: int
) -> tuple[NDArray[numpy.uint8], NDArray[numpy.uint8], NDArray[numpy.float64]]: ...
def boxes_of_lists(boxes: Any, name: str) -> Any: ...
def forget_threads() -> None: ...
def expect_leaks() -> None: ...
