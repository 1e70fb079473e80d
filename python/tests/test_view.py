"""throng.view: the data of a frame, the recording read back, the page in a browser."""

import base64
import html
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import types
from collections import defaultdict
from pathlib import Path
from typing import Any

import browser
import numpy
import pytest
from reference import INF, NAN, brute_force

import throng
from throng.view import show

SCENE = throng.scene("mixed", 3000, frames=3, seed=2)


def saved(path: Path, scene: Any) -> str:
    throng.save_boxes(path, scene)
    return str(path)


def as_set(pairs: Any) -> set[tuple[int, int]]:
    return {(int(i), int(j)) for i, j in pairs}


def test_frames() -> None:
    view = pytest.importorskip("throng.view")
    before: set[tuple[int, int]] | None = None
    for number, frame in enumerate(view.frames(SCENE)):
        boxes = SCENE[number]
        now = set(brute_force(boxes))
        assert as_set(frame.pairs) == now and frame.number == number
        assert as_set(frame.begun) == (now - before if before is not None else set())
        assert as_set(frame.ended) == (before - now if before is not None else set())
        assert frame.overlaps[5] == sum(5 in pair for pair in now)
        assert len(frame.shown) == len(boxes) and as_set(frame.lines(frame.pairs)) == now
        assert frame.occupancy.ndim == 2 and frame.occupancy.sum() == frame.explanation.entries
        bounds, counts = frame.cells()
        assert counts[0] == frame.explanation.densest[0].boxes == frame.occupancy.max()
        assert (counts > 0).all() and (numpy.diff(counts.astype(int)) <= 0).all()
        plan = frame.explanation.result.plan
        across = [k for k in range(3) if k != plan.sweep_axis]
        dense = numpy.array(frame.explanation.densest[0].bounds)
        columns = across + [k + 3 for k in across]
        # Bounds are float32 of the scene's size, and one of them may be 0.
        near = numpy.isclose(
            bounds[counts == counts[0]][:, columns],
            dense[columns],
            rtol=1e-3,
            atol=1e-6 * float(numpy.abs(SCENE).max()),
        )
        assert near.all(1).any()
        before = now


def test_many_boxes_are_thinned_out() -> None:
    view = pytest.importorskip("throng.view")
    boxes = throng.scene("pile", 20000)[0].copy()
    boxes[17] += numpy.float32(1)
    boxes[17, :3] -= 30
    boxes[18] = [1, 1, 1, 0, 0, 0]
    chosen = []
    for frame in view.frames([boxes, boxes], most=2000):
        assert 1800 <= len(frame.shown) <= 2000 and 17 in frame.shown and 18 not in frame.shown
        assert int(frame.overlaps.argmax()) in frame.shown
        lines = frame.lines(frame.pairs, most=50)
        assert 0 < len(lines) <= 50 and set(lines.reshape(-1)) <= set(frame.shown)
        assert as_set(lines) <= as_set(frame.pairs)
        chosen.append(frame.shown)
    assert numpy.array_equal(*chosen)


def test_infinite_and_empty() -> None:
    view = pytest.importorskip("throng.view")
    boxes = numpy.array(
        [[-INF, -INF, -INF, INF, INF, 0], [1, 1, -1, 2, 2, 5], [NAN, 0, 0, 1, 1, 1]], numpy.float32
    )
    (frame,) = view.frames([boxes])
    assert frame.shown.tolist() == [0, 1] and as_set(frame.pairs) == {(0, 1)}
    corners = frame.corners(frame.shown)
    assert numpy.isfinite(corners).all() and (corners[0, 3:] > corners[0, :3]).all()
    assert numpy.array_equal(corners[1], boxes[1])
    (nothing,) = view.frames([boxes[:0]])
    assert nothing.corners(nothing.shown).shape == (0, 6)


@pytest.mark.parametrize("name, objects", [("mixed", 600), ("pile", 20000), ("rods", 40000), ("uniform", 200000)])
def test_the_map_of_the_cells(name: str, objects: int) -> None:
    view = pytest.importorskip("throng.view")
    from throng.view import _heat

    (frame,) = view.frames(throng.scene(name, objects))
    chart = _heat.heat_map(frame)
    assert chart is not None and frame.explanation.cells > 1
    # Each cell's pixel shows it, or a denser one that shares the pixel.
    height, width = chart.counts.shape
    assert max(height, width) <= _heat.MAX_PIXELS and chart.counts.max() == frame.occupancy.max()
    across, up = frame.occupancy.shape
    for x, y in numpy.random.default_rng(1).integers(0, [across, up], (200, 2)):
        column = min(int((x + 0.5) / across * width), width - 1)
        row = height - 1 - min(int((y + 0.5) / up * height), height - 1)
        assert chart.counts[row, column] >= frame.occupancy[x, y]
        if across <= width and up <= height:
            assert chart.counts[row, column] == frame.occupancy[x, y]
    # The densest cell's rectangle has the last colour, and is where the map has its number.
    left, top, right, bottom = chart.rectangles(frame.cells()[0][:1])[0]
    row, column = int((top + bottom) / 2), int((left + right) / 2)
    picture = chart.picture()
    assert chart.counts[row, column] == chart.counts.max()
    assert picture[row, column].tolist() == picture[-1, -1].tolist() == _heat.SCALE[-1].tolist()
    assert picture.shape == (height + 2 * chart.strip, width, 3)
    places, words = chart.words()
    assert words[-1] == f"{frame.occupancy.max():,} boxes" and len(places) == len(words)
    assert sum(c.cells for c in frame.explanation.cell_classes) == frame.explanation.occupied
    assert sum(c.boxes for c in frame.explanation.cell_classes) == frame.explanation.entries


def test_the_scale_of_the_map() -> None:
    from throng.view._heat import EMPTY, SCALE, Scale

    for counts, least, most in (([0, 300, 320], 20, 320), ([1, 9, 900], 1, 900), ([1, 1], 1, 2), ([0], 1, 2)):
        made = Scale.of(numpy.array(counts))
        assert (made.least, made.most) == (least, most)
        shown = made.colours(numpy.array([0, least, most])).tolist()
        assert shown == [EMPTY, SCALE[0].tolist(), SCALE[-1].tolist()]
        marks = made.marks()
        assert marks[0] == least and marks[-1] == most and marks == sorted(set(marks))


def test_no_map_without_a_grid() -> None:
    view = pytest.importorskip("throng.view")
    from throng.view._heat import heat_map

    (frame,) = view.frames(throng.scene("uniform", 20))
    assert frame.explanation.cells == 0 and heat_map(frame) is None and frame.explanation.cell_classes == []


def test_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    pytest.importorskip("rerun")
    from throng.view.__main__ import main

    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    file = saved(tmp_path / "a.npy", SCENE[0])
    numpy.save(tmp_path / "flat.npy", numpy.zeros((3, 4), numpy.float32))
    for arguments, text in (
        ([str(tmp_path / "none.npy"), "--save", "x.rrd"], "none.npy: No such file"),
        ([str(tmp_path / "flat.npy"), "--save", "x.rrd"], "found shape (3, 4), wanted (n, 6)"),
        ([__file__, "--save", "x.rrd"], "test_view.py: "),
        ([file, "--save", str(tmp_path / "no" / "x.rrd")], "x.rrd: No such file or directory"),
        ([file, "--save", "x.rrd", "--most", "0"], "--most 0: wanted 1 or more"),
        ([file, "--save", "x.rrd", "--margin", "-1"], "margin: found -1.0"),
        ([file], "there is no display; give --save FILE.rrd, or --serve"),
    ):
        assert main(arguments) == 1
        assert text in capsys.readouterr().err
    assert sorted(os.listdir(tmp_path)) == ["a.npy", "flat.npy"]


def test_rerun_is_missing(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    from throng.view.__main__ import main

    monkeypatch.setitem(sys.modules, "rerun", None)
    assert main(["boxes.npy", "--save", "x.rrd"]) == 1
    said = capsys.readouterr().err  # no published throng has it
    assert 'pip install rerun-sdk, or in Throng\'s source tree pip install ".[view]"' in said


def test_the_recording_read_back(tmp_path: Path) -> None:
    chunk = pytest.importorskip("rerun.chunk")
    file = saved(tmp_path / "mixed.npy", SCENE)
    command = [sys.executable, "-m", "throng.view", file, "--save", str(tmp_path / "mixed.rrd")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0 and "3 frames" in done.stdout, done.stderr
    assert sorted(os.listdir(tmp_path)) == ["mixed.npy", "mixed.rrd"]
    reader = chunk.RrdReader(tmp_path / "mixed.rrd")
    assert len(reader.recordings()) == len(reader.blueprints()) == 1
    held: dict[str, dict[int, Any]] = defaultdict(dict)
    for part in reader.stream(store=reader.recordings()[0]).to_chunks():
        rows = part.to_record_batch()
        if "frame" not in rows.schema.names:
            continue
        for name in (name for name in rows.schema.names if ":" in name):
            values = held[part.entity_path + " " + name.split(":")[1]]
            values.update(zip(rows.column("frame").to_pylist(), rows.column(name).to_pylist()))
    before: set[tuple[int, int]] = set()
    for number, boxes in enumerate(SCENE):
        halves = numpy.array(held["/world/boxes half_sizes"][number])
        centers = numpy.array(held["/world/boxes centers"][number])
        assert numpy.allclose(centers - halves, boxes[:, :3], atol=1e-4)
        assert numpy.allclose(centers + halves, boxes[:, 3:], atol=1e-4)
        pairs = set(brute_force(boxes))
        overlaps = numpy.bincount(numpy.array(sorted(pairs)).reshape(-1), minlength=len(boxes))
        # One colour per number of overlaps, and another for none.
        colours = numpy.array(held["/world/boxes colors"][number])
        for count in numpy.unique(overlaps):
            assert len(numpy.unique(colours[overlaps == count])) == 1
        assert set(colours[overlaps == 0]).isdisjoint(colours[overlaps > 0])
        middle = (boxes[:, :3] + boxes[:, 3:]) / 2
        strips = numpy.array(held["/world/pairs strips"][number])
        wanted = numpy.array([[middle[i], middle[j]] for i, j in sorted(pairs)])
        assert numpy.allclose(strips, wanted, atol=1e-4)
        began, ended = (len(pairs - before), len(before - pairs)) if number else (0, 0)
        assert began + ended > 0 or number == 0
        assert len(held["/world/begun strips"][number]) == began
        assert len(held["/world/ended strips"][number]) == ended
        for name, count in (("pairs", len(pairs)), ("begun", began), ("ended", ended)):
            assert held[f"/counts/{name} scalars"][number] == [count]
        assert 0 < held["/times/find_ms scalars"][number][0] <= held["/times/total_ms scalars"][number][0]
        explanation = throng.Finder(order="canonical").explain(boxes)
        tensor = held["/grid/occupancy data"][number][0]
        assert sum(tensor["buffer"]) == explanation.entries and max(tensor["buffer"]) == explanation.densest[0].boxes
        assert len(held["/world/cells centers"][number]) == min(explanation.occupied, 2000)
        seen = held["/grid/map buffer"][number][0], held["/grid/map format"][number][0]
        picture = numpy.frombuffer(bytes(seen[0]), numpy.uint8).reshape(seen[1]["height"], seen[1]["width"], 3)
        # At most one colour per number, plus empty cells, surroundings and scale.
        kinds = len(numpy.unique(explanation.occupancy.sum(axis=explanation.result.plan.sweep_axis)))
        above = picture[: seen[1]["height"] * 3 // 4].reshape(-1, 3)
        assert 1 <= len(numpy.unique(above, axis=0)) <= kinds + 2
        assert len(held["/grid/map/densest centers"][number]) == len(explanation.densest)
        assert len(held["/grid/map/largest centers"][number]) == len(explanation.largest)
        assert f"{explanation.densest[0].boxes:,} boxes" in held["/grid/map/words labels"][number]
        bars = held["/grid/distribution values"][number][0]["buffer"]
        assert sum(bars) == explanation.occupied and bars[-1] == explanation.cell_classes[-1].cells > 0
        for cells in explanation.cell_classes:
            assert bars[cells.least.bit_length() - 1] == cells.cells
        text = held["/lists text"][number][0]
        largest, densest = explanation.largest[0], explanation.densest[0]
        assert f"| {largest.index} | {largest.extent:.4g} |" in text and f"| {densest.boxes} |" in text
        assert f"{len(pairs):,} pairs" in text
        before = pairs


@pytest.mark.skipif(browser.PROGRAM is None, reason="no Chromium here")
def test_the_page_in_a_browser(tmp_path: Path) -> None:
    """Check the picture by eye, too: THRONG_VIEW_PICTURE names the file to keep."""
    pytest.importorskip("rerun")
    file = saved(tmp_path / "few.npy", throng.scene("mixed", 600, frames=3))
    command = [sys.executable, "-m", "throng.view", file, "--serve", "--port", "19390", "--data-port", "19376"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    console = tmp_path / "console"
    shown = browser.Browser((1200, 750), str(console))
    try:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        assert address == "http://localhost:19390/?url=rerun%2Bhttp://localhost:19376/proxy"
        shown.open(address)
        deadline = time.monotonic() + 240
        picture = b""
        # The page without a recording shows less than half of that.
        while len(picture) < 150000:
            assert time.monotonic() < deadline, f"only {len(picture)} bytes; {console.read_text()[-3000:]}"
            time.sleep(1)
            picture = shown.picture()
        if kept := os.environ.get("THRONG_VIEW_PICTURE"):
            Path(kept).write_bytes(picture)
    finally:
        shown.close()
        server.terminate()
        server.wait(20)


def data_of(page: Any) -> dict[str, Any]:
    """What the page draws."""
    text = Path(page).read_text(encoding="utf-8")
    data: dict[str, Any] = json.loads(text.partition('type="application/json">')[2].partition("</script>")[0])
    for name, kind in (("corners", "<f4"), ("index", "<u4"), ("overlaps", "<u4"), ("pairs", "<u4")):
        data[name] = numpy.frombuffer(base64.b64decode(data[name]), kind)
    return data


def test_a_page_of_boxes(tmp_path: Path) -> None:
    boxes = SCENE[0][:300].copy()
    boxes[7] = [1, 1, 1, 0, 0, 0]
    boxes[8, 0] = NAN
    clean = numpy.where(numpy.isnan(boxes).any(axis=1)[:, None], numpy.float32([1, 1, 1, 0, 0, 0]), boxes)
    pairs = brute_force(clean)
    page = show(boxes, path=tmp_path / "page.html")
    assert os.fspath(page) == str(page) == str(page.path) == str(tmp_path / "page.html")
    data = data_of(page)
    assert data["title"] == f"300 boxes, {len(pairs)} pairs; 298 boxes drawn" and not data["flat"]
    assert data["index"].tolist() == [i for i in range(300) if i not in (7, 8)]
    drawn = data["index"][data["pairs"].reshape(-1, 2)]
    assert sorted(map(tuple, drawn.tolist())) == pairs
    count = numpy.bincount(numpy.array(pairs).reshape(-1), minlength=300)
    assert data["overlaps"].tolist() == count[data["index"]].tolist()
    # The corners differ from those given by one shift and one scale, but for the large box.
    assert data["outlined"] == [0]
    corners, wanted = data["corners"].reshape(-1, 6).astype(float)[1:], clean[data["index"]].astype(float)[1:]
    sizes, wanted_sizes = corners[:, 3:] - corners[:, :3], wanted[:, 3:] - wanted[:, :3]
    scale = sizes.max() / wanted_sizes.max()
    assert numpy.allclose(sizes, wanted_sizes * scale, atol=1e-5)
    assert numpy.ptp(corners[:, :3] - wanted[:, :3] * scale, axis=0).max() < 1e-5
    assert 0.9 < numpy.abs(corners).max() <= 1.0001
    assert 1.05 < numpy.abs(data["corners"][:6]).max() < 1.15


def test_what_the_camera_shows() -> None:
    from throng.view import _frame

    boxes = numpy.float32([[k, 0, 0, k + 1, 1, 1] for k in range(10)] + [[0, 0, 0, 40, 1, 1], [-INF] * 3 + [INF, INF, 0]])
    assert _frame.is_large(boxes).tolist() == [False] * 10 + [True, True]
    low, high = _frame.bounds(boxes)
    assert (low.tolist(), high.tolist()) == ([0, 0, 0], [10, 1, 1])
    low, high = _frame.bounds(boxes[:0])
    assert (high > low).all()
    # Of many boxes, one that is far away changes nothing.
    many = numpy.concatenate([boxes[:10]] * 100)
    many[3] += numpy.float32(1e6)
    assert _frame.bounds(many)[1].tolist() == [10, 1, 1]
    # Only what moves counts, at the first, middle and last frame.
    scene = numpy.stack([boxes[:10]] * 5)
    assert _frame.moving(scene).tolist() == scene[0].tolist()
    scene[1:, 2, [2, 5]] += numpy.float32([[5], [6], [7], [8]])
    assert _frame.moving(scene)[:, 2].tolist() == [0, 6, 8]
    assert len(_frame.moving([boxes, boxes[:3]])) == len(boxes) + 3 + 3 - 3


def test_the_layout_of_the_viewer(tmp_path: Path) -> None:
    chunk = pytest.importorskip("rerun.chunk")
    import rerun

    from throng.view._record import LEGEND, layout

    boxes = numpy.float32([[k, 0, 0, k + 1, 1, 1] for k in range(10)])
    stream = rerun.RecordingStream("layout")
    stream.save(tmp_path / "layout.rrd", default_blueprint=layout(boxes))
    stream.log("world/boxes", rerun.Boxes3D(mins=boxes[:, :3], sizes=boxes[:, 3:] - boxes[:, :3]))
    stream.disconnect()
    reader = chunk.RrdReader(tmp_path / "layout.rrd")
    held: dict[str, Any] = {}
    for part in reader.stream(store=reader.blueprints()[0]).to_chunks():
        rows = part.to_record_batch()
        for name in (name for name in rows.schema.names if ":" in name):
            held[part.entity_path + " " + name] = rows.column(name).to_pylist()[0]
    hidden = {re.split("[/ ]", path.split("world/")[1])[0] for path, value in held.items() if path.endswith("EntityBehavior:visible") and value == [False]}
    assert hidden == {"pairs", "begun", "ended", "cells"}
    (target,) = [value for path, value in held.items() if path.endswith("EyeControls3D:look_target")]
    (position,) = [value for path, value in held.items() if path.endswith("EyeControls3D:position")]
    assert numpy.allclose(target, [[5, 0.5, 0.5]])
    assert 10 < numpy.linalg.norm(numpy.subtract(position, target)) < 15
    assert [LEGEND] in held.values() and "\n" not in LEGEND


def test_pages_of_other_boxes(tmp_path: Path) -> None:
    live = throng.BroadPhase()
    live.add(SCENE[0])
    live.update()
    data = data_of(show(SCENE[0], live.pairs, tmp_path / "live.html", most=400))
    assert 300 < len(data["index"]) <= 400 and data["title"].startswith(f"3,000 boxes, {live.pair_count:,} pairs; ")
    flat = [[0, 0, 1, 1], [1, 1, 2, 2]]
    data = data_of(show(flat, path=tmp_path / "flat.html"))
    assert data["flat"] and data["title"] == "2 boxes, 1 pair"
    assert data["corners"].reshape(-1, 6)[:, [0, 1, 3, 4]].tolist() == [[-1, -1, 0, 0], [0, 0, 1, 1]]
    wide = numpy.array([[-INF] * 3 + [INF, INF, 0], [-1e300] * 3 + [1e300] * 3, [5.0] * 6])
    data = data_of(show(wide, path=tmp_path / "wide.html"))
    assert numpy.isfinite(data["corners"]).all() and data["pairs"].tolist() == [0, 1, 1, 2]
    for nothing in ([], numpy.zeros((0, 6), numpy.float32)):
        assert data_of(show(nothing, path=tmp_path / "none.html"))["title"] == "0 boxes, 0 pairs"
    bad: list[tuple[Any, Any, Any, str]] = [
        (flat, [[0, 2]], 5, r"pairs: the row 0 is \[0, 2\], wanted indices below 2"),
        (flat, [[-1, 0]], 5, "pairs: the row 0"),
        (flat, [[0.0, 1.0]], 5, "pairs: found float64"),
        (flat, [0, 1], 5, r"pairs: found int64 of shape \(2,\)"),
        ([[1, 2, 3]], None, 5, r"boxes: found shape \(1, 3\)"),
        (numpy.zeros((2, 3, 6)), None, 5, r"found shape \(2, 3, 6\).*show one world: boxes\[w\]"),
        (flat, numpy.array([[0, 2**64 - 1]], numpy.uint64), 5, r"pairs: the row 0 is \[0, 18446744073709551615\]"),
        (numpy.ma.masked_less(numpy.zeros((2, 6)), 1), None, 5, "boxes: found a masked array that hides values"),
        ((numpy.zeros((2, 3)), numpy.zeros((2, 2))), None, 5, r"boxes: found corners of shapes \[\(2, 3\), \(2, 2\)\]"),
        (flat, None, 0, "most: found 0"),
    ]
    for boxes, pairs, most, text in bad:
        with pytest.raises(ValueError, match=text):
            show(boxes, pairs, tmp_path / "bad.html", most=most)
    for given, text in [(numpy.zeros((2, 6), complex), "complex128"), (numpy.full((2, 6), "1"), "<U1")]:
        with pytest.raises(TypeError, match=f"boxes: found an array of {text}, wanted float32"):
            show(given, path=tmp_path / "bad.html")
    with pytest.raises(TypeError, match="most: found 1.5, wanted an integer"):
        show(flat, path=tmp_path / "bad.html", most=1.5)  # type: ignore[arg-type]
    assert not (tmp_path / "bad.html").exists()


def test_a_page_in_a_script(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: Any) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    page = show(SCENE[0][:20])
    assert page.path.parent == tmp_path and page.path.read_text(encoding="utf-8") == page.html
    monkeypatch.setenv("DISPLAY", ":0")
    second = show(SCENE[0][:20])
    show(SCENE[0][:20], path=tmp_path / "named.html")
    assert second.path != page.path and opened[-1] == second.path.as_uri()
    if sys.platform == "linux":
        assert len(opened) == 1
    assert capfd.readouterr() == ("", "")


def test_a_page_in_a_notebook(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    page = show(SCENE[0][:20])
    assert os.listdir(tmp_path) == []
    drawn = page._repr_html_()
    assert drawn.startswith('<iframe srcdoc="') and drawn.count('"') == 4
    assert html.unescape(drawn.split('"')[1]) == page.html
    # The page loads nothing.
    assert not re.search(r"https?:|src=|href=|import\b|fetch\(", page.html)
    assert page.path.exists()


@pytest.mark.skipif(browser.PROGRAM is None, reason="no Chromium here")
def test_the_drawn_page(tmp_path: Path) -> None:
    """In a notebook's frame, on a light and on a dark screen: two boxes that overlap, and one alone."""
    boxes = [[0, 0, 0, 2, 2, 2], [1, 1, 1, 3, 3, 3], [4, 0, 0, 6, 2, 2]]
    page = show(boxes, path=tmp_path / "page.html")
    around = tmp_path / "notebook.html"
    around.write_text(f"<body>{page._repr_html_()}</body>", encoding="utf-8")
    console = tmp_path / "console"
    shown = browser.Browser((800, 520), str(console))
    try:
        shown.open(around.as_uri())
        script = (
            "(() => { const inside = document.querySelector('iframe'), c = inside?.contentDocument?.getElementById('view');"
            " if (!c || c.width < 100 || !inside.contentWindow.draw) return '';"
            " inside.contentWindow.draw(); const gl = c.getContext('webgl2'), d = new Uint8Array(4 * c.width * c.height);"
            " gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, d);"
            " return [c.width, c.height, btoa(Array.from(d, (x) => String.fromCharCode(x)).join(''))].join(' '); })()"
        )
        for scheme, paper in (("light", [250, 250, 248]), ("dark", [20, 23, 27])):
            shown.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
            deadline = time.monotonic() + 120
            while not (answer := shown.call("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")):
                assert time.monotonic() < deadline, console.read_text()[-2000:]
                time.sleep(0.5)
            width, height, text = answer.split()
            pixels = numpy.frombuffer(base64.b64decode(text), numpy.uint8).reshape(int(height), int(width), 4)[:, :, :3]
            assert (pixels[[0, 0, -1, -1], [0, -1, 0, -1]] == paper).all(), scheme
            # A face is one colour: three for the boxes that overlap one other, three for the box alone.
            colours, counts = numpy.unique(pixels.reshape(-1, 3), axis=0, return_counts=True)
            faces = colours[(counts > 1000) & (colours != paper).any(axis=1)].astype(int)
            assert len(faces) == 6 and (numpy.ptp(faces, axis=1) < 12).sum() == 3, (scheme, faces, counts)
    finally:
        shown.close()
