"""Frames as a Rerun recording."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy
from numpy.typing import NDArray

from throng.view._frame import Frame, Pairs

if TYPE_CHECKING:
    import rerun

# Overlaps from which on a box has the last colour: the scale is the same for all frames and files.
FULL = 64
# More boxes than this are drawn as edges alone.
FILLED = 20_000
# From few to many.
SCALE = numpy.array(
    [[68, 60, 140], [59, 110, 150], [40, 160, 140], [110, 205, 90], [253, 231, 37], [255, 120, 60]]
)
ALONE = [120, 120, 130]
BEGAN, ENDED, PAIR = [80, 220, 100], [235, 80, 70], [150, 170, 255]
STAGES = "plan_ms", "bin_ms", "find_ms", "order_ms", "total_ms"
COUNTS = "pairs", "begun", "ended"


def colours(overlaps: NDArray[Any]) -> NDArray[numpy.uint8]:
    """(n, 3): grey for none, then by the logarithm of how many."""
    at = numpy.log2(numpy.clip(overlaps, 1, FULL)) / numpy.log2(FULL) * (len(SCALE) - 1)
    stops = numpy.arange(len(SCALE))
    mixed = numpy.stack([numpy.interp(at, stops, SCALE[:, k]) for k in range(3)], axis=-1)
    return numpy.where(overlaps[:, None] > 0, mixed, ALONE).astype(numpy.uint8)


def layout() -> "rerun.blueprint.Blueprint":
    """What stands where in the viewer."""
    import rerun.blueprint as bp

    return bp.Blueprint(
        bp.Horizontal(
            bp.Spatial3DView(origin="/world", name="Boxes, pairs, cells"),
            bp.Vertical(
                bp.TensorView(origin="/grid/occupancy", name="Boxes a cell"),
                bp.TextDocumentView(origin="/lists", name="Largest, densest"),
                bp.TimeSeriesView(origin="/counts", name="Pairs"),
                bp.TimeSeriesView(origin="/times", name="ms a stage"),
                row_shares=[3, 4, 2, 2],
            ),
            column_shares=[3, 2],
        ),
        bp.TimePanel(timeline="frame", state="collapsed", play_state="following"),
        bp.SelectionPanel(state="hidden"),
        bp.BlueprintPanel(state="hidden"),
    )


def record(frames: Iterable[Frame], stream: "rerun.RecordingStream") -> int:
    """Logs frames, and tells how many. Entities: world/boxes, world/pairs, world/begun,
    world/ended, world/cells, grid/occupancy, counts/*, times/*, lists; by the timeline `frame`."""
    import rerun as rr

    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for name in COUNTS:
        stream.log(f"counts/{name}", rr.SeriesLines(names=name), static=True)
    for name in STAGES:
        stream.log(f"times/{name}", rr.SeriesLines(names=name), static=True)
    done = 0
    for frame in frames:
        stream.set_time("frame", sequence=frame.number)
        _world(stream, frame)
        _grid(stream, frame)
        for name in COUNTS:
            stream.log(f"counts/{name}", rr.Scalars(len(getattr(frame, name))))
        for name in STAGES:
            stream.log(f"times/{name}", rr.Scalars(getattr(frame.told.result.times, name)))
        stream.log("lists", rr.TextDocument(lists(frame), media_type=rr.MediaType.MARKDOWN))
        done += 1
    return done


def _world(stream: "rerun.RecordingStream", frame: Frame) -> None:
    import rerun as rr

    corners = frame.corners(frame.shown)
    stream.log(
        "world/boxes",
        rr.Boxes3D(
            mins=corners[:, :3],
            sizes=corners[:, 3:] - corners[:, :3],
            colors=colours(frame.overlaps[frame.shown]),
            fill_mode="transparentfillmajorwireframe" if len(corners) <= FILLED else "majorwireframe",
        ),
    )
    for name, colour in (("pairs", PAIR), ("begun", BEGAN), ("ended", ENDED)):
        pairs: Pairs = frame.lines(getattr(frame, name))
        ends = frame.corners(pairs.reshape(-1))
        middle = ((ends[:, :3] + ends[:, 3:]) / 2).reshape(-1, 2, 3).astype(numpy.float32)
        width = -0.5 if name == "pairs" else -1.25  # negative: pixels of the screen
        stream.log(f"world/{name}", rr.LineStrips3D(middle, colors=[colour], radii=width))


def _grid(stream: "rerun.RecordingStream", frame: Frame) -> None:
    import rerun as rr

    if frame.told.cells == 0:
        for name in ("world/cells", "grid/occupancy"):
            stream.log(name, rr.Clear(recursive=False))
        return
    bounds, counts = frame.cells()
    heat = colours(FULL * counts.astype(numpy.float64) / counts.max())
    stream.log(
        "world/cells",
        rr.Boxes3D(
            mins=bounds[:, :3],
            sizes=bounds[:, 3:] - bounds[:, :3],
            colors=heat,
            fill_mode="majorwireframe",
        ),
    )
    stream.log("grid/occupancy", rr.Tensor(frame.occupancy, dim_names=frame.axes))


def lists(frame: Frame) -> str:
    """What a frame has to tell in words, as Markdown."""
    told, plan = frame.told, frame.told.result.plan
    text = [
        f"{len(frame.boxes):,} boxes, {len(frame.shown):,} of them drawn; {len(frame.pairs):,} pairs, "
        f"{len(frame.begun):,} began, {len(frame.ended):,} ended. {plan.algorithm}: {plan.reason}; "
        f"{told.tests_per_box:.1f} tests a box.",
        "",
        f"Boxes: grey overlaps none, blue 1, green some 10, yellow 30, orange {FULL} or more. Lines: pairs; "
        "green ones began, red ones ended.",
        "",
        "| largest boxes | extent | overlaps | cells |",
        "|---|---|---|---|",
    ]
    for box in told.largest:
        overlaps = frame.overlaps[box.index]
        text.append(f"| {box.index} | {box.extent:.4g} | {overlaps} | {box.cells} |")
    if told.densest:
        text += ["", "| densest cells, from | to | boxes |", "|---|---|---|"]
    for cell in told.densest:
        ends = ["  ".join(f"{x:.4g}" for x in cell.bounds[k : k + 3]) for k in (0, 3)]
        text.append(f"| {ends[0]} | {ends[1]} | {cell.boxes} |")
    text += ["", *(f"- {advice}" for advice in told.advice)]
    return "\n".join(text)
