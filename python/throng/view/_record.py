"""Frames as a Rerun recording."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy
from numpy.typing import NDArray

from throng.view._frame import Frame, Pairs, bounds
from throng.view._heat import BACKGROUND, MAX_LABELS, SCALE, heat_map, mixed

if TYPE_CHECKING:
    import rerun

# Number of overlaps with the last colour: the scale is the same for all frames and files.
FULL = 32
NO_OVERLAP = [120, 120, 130]
BEGAN, ENDED, PAIR = [80, 220, 100], [235, 80, 70], [150, 170, 255]
# On the map: outlines of the densest cells and of the largest boxes, labels.
DENSE, LARGE, WORDS = [15, 16, 18], [255, 255, 255], [200, 200, 205]
LEGEND = f"Overlaps per box: grey 0, blue 1, green 8, yellow {FULL} or more"
STAGES = "plan_ms", "bin_ms", "find_ms", "order_ms", "total_ms"
COUNTS = "pairs", "begun", "ended"


def colours(overlaps: NDArray[Any]) -> NDArray[numpy.uint8]:
    """(n, 3): grey for none, else by the logarithm of the number."""
    at = numpy.log2(numpy.clip(overlaps, 1, FULL)) / numpy.log2(FULL)
    return numpy.where(overlaps[:, None] > 0, mixed(at), NO_OVERLAP).astype(numpy.uint8)


def layout(shown: NDArray[Any]) -> "rerun.blueprint.Blueprint":
    """The layout of the viewer. `shown`: the boxes (n, 6) at which the camera looks."""
    import rerun.blueprint as bp

    low, high = bounds(shown)
    middle = (low + high) / 2
    # So far that a sphere around them is inside the view.
    away = 1.1 * max(float(numpy.linalg.norm(high - low)), 1e-6)
    hidden = bp.EntityBehavior(visible=False)
    return bp.Blueprint(
        bp.Horizontal(
            bp.Spatial3DView(
                origin="/world",
                name=LEGEND,
                overrides={f"world/{name}": hidden for name in ("pairs", "begun", "ended", "cells")},
                eye_controls=bp.EyeControls3D(
                    position=middle + away * numpy.array([0.55, -0.75, 0.36]), look_target=middle, eye_up=[0, 0, 1]
                ),
            ),
            bp.Vertical(
                bp.Horizontal(
                    bp.Tabs(
                        bp.Spatial2DView(
                            origin="/grid", contents="/grid/map/**", name="Boxes per cell", background=BACKGROUND
                        ),
                        bp.TensorView(origin="/grid/occupancy", name="Numbers"),
                        active_tab=0,
                    ),
                    bp.BarChartView(
                        origin="/grid/distribution",
                        name="Occupancy (log2)",
                        plot_legend=bp.PlotLegend(visible=False),
                    ),
                    column_shares=[5, 4],
                ),
                bp.TextDocumentView(origin="/lists", name="Largest, densest"),
                bp.Horizontal(
                    bp.TimeSeriesView(origin="/counts", name="Pairs"),
                    bp.TimeSeriesView(origin="/times", name="ms per stage"),
                ),
                row_shares=[5, 4, 3],
            ),
            column_shares=[3, 2],
        ),
        bp.TimePanel(timeline="frame", state="collapsed", play_state="following"),
        bp.SelectionPanel(state="hidden"),
        bp.BlueprintPanel(state="collapsed"),
    )


def record(frames: Iterable[Frame], stream: "rerun.RecordingStream") -> int:
    """Logs frames, and returns their number. Entities: world/boxes, world/pairs, world/begun,
    world/ended, world/cells, grid/map (with densest, largest, words), grid/occupancy,
    grid/distribution, counts/*, times/*, lists; on the timeline `frame`.
    """
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
            stream.log(f"times/{name}", rr.Scalars(getattr(frame.explanation.result.times, name)))
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
            fill_mode="solid",
        ),
    )
    for name, colour in (("pairs", PAIR), ("begun", BEGAN), ("ended", ENDED)):
        pairs: Pairs = frame.lines(getattr(frame, name))
        ends = frame.corners(pairs.reshape(-1))
        middle = ((ends[:, :3] + ends[:, 3:]) / 2).reshape(-1, 2, 3).astype(numpy.float32)
        width = -0.5 if name == "pairs" else -1.25  # negative: screen pixels
        stream.log(f"world/{name}", rr.LineStrips3D(middle, colors=[colour], radii=width))


def _grid(stream: "rerun.RecordingStream", frame: Frame) -> None:
    import rerun as rr

    chart = heat_map(frame)
    if chart is None:
        for name in ("world/cells", "grid"):
            stream.log(name, rr.Clear(recursive=True))
        return
    bounds, counts = frame.cells()
    stream.log(
        "world/cells",
        rr.Boxes3D(
            mins=bounds[:, :3],
            sizes=bounds[:, 3:] - bounds[:, :3],
            colors=chart.scale.colours(counts),
            fill_mode="majorwireframe",
        ),
    )
    stream.log("grid/map", rr.Image(chart.picture()))
    densest = chart.rectangles(bounds[: len(frame.explanation.densest)])
    largest = chart.rectangles(frame.corners([box.index for box in frame.explanation.largest]))
    for name, where, colour in (("densest", densest, DENSE), ("largest", largest, LARGE)):
        stream.log(
            f"grid/map/{name}",
            rr.Boxes2D(mins=where[:, :2], sizes=where[:, 2:] - where[:, :2], colors=[colour], radii=-0.5),
        )
    said = counts[: MAX_LABELS if len(counts) <= MAX_LABELS else 1]
    where = chart.rectangles(bounds[: len(said)])
    places, words = chart.words()
    places = numpy.concatenate([places, (where[:, :2] + where[:, 2:]) / 2])
    shades = [WORDS] * len(words) + [DENSE] * len(said)
    words += [f"{count:,}" for count in said]
    stream.log("grid/map/words", rr.Points2D(places, radii=0, labels=words, colors=shades, show_labels=True))
    stream.log("grid/occupancy", rr.Tensor(frame.occupancy, dim_names=frame.axes))
    classes = frame.explanation.cell_classes
    # A class without cells has a bar of height 0.
    bars = numpy.zeros(max(c.least for c in classes).bit_length(), numpy.int64)
    bars[[c.least.bit_length() - 1 for c in classes]] = [c.cells for c in classes]
    stream.log("grid/distribution", rr.BarChart(bars, color=SCALE[3].tolist()))


def lists(frame: Frame) -> str:
    """A frame's summary as Markdown."""
    explanation, plan = frame.explanation, frame.explanation.result.plan
    text = [
        f"{len(frame.boxes):,} boxes, {len(frame.shown):,} of them drawn; {len(frame.pairs):,} pairs, "
        f"{len(frame.begun):,} began, {len(frame.ended):,} ended. {plan.algorithm}: {plan.reason}; "
        f"{explanation.tests_per_box:.1f} tests per box.",
        "",
        f"{LEGEND}. Hidden until the panel on the left shows them: lines for pairs, green for begun, red for "
        "ended ones; cells. On the map: boxes per cell, by the scale below it; black: the densest cells; "
        "white: the largest boxes.",
        "",
        "| largest boxes | extent | overlaps | cells |",
        "|---|---|---|---|",
    ]
    for box in explanation.largest:
        overlaps = frame.overlaps[box.index]
        text.append(f"| {box.index} | {box.extent:.4g} | {overlaps} | {box.cells} |")
    if explanation.densest:
        text += ["", "| densest cells, from | to | boxes |", "|---|---|---|"]
    for cell in explanation.densest:
        ends = ["  ".join(f"{x:.4g}" for x in cell.bounds[k : k + 3]) for k in (0, 3)]
        text.append(f"| {ends[0]} | {ends[1]} | {cell.boxes} |")
    if explanation.cell_classes:
        text += ["", "| boxes in a cell | cells | boxes in them |", "|---|---|---|"]
    for cells in explanation.cell_classes:
        text.append(f"| {cells.least:,} to {cells.below - 1:,} | {cells.cells:,} | {cells.boxes:,} |")
    text += ["", *(f"- {advice}" for advice in explanation.advice)]
    return "\n".join(text)
