"""The program: python -m throng.view FILE.npy [--save x.rrd | --serve]."""

import argparse
import os
import socket
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy

import throng
from throng.view import frames, record
from throng.view._frame import MAX_DRAWN, moving
from throng.view._record import layout

if TYPE_CHECKING:
    import rerun


class UserError(Exception):
    """An error message for the user, without a traceback."""


def load(path: str) -> Any:
    """(frames, n, 6) float32; memory-mapped if the file has that layout."""
    try:
        found: Any = numpy.load(path, mmap_mode="r", allow_pickle=False)
        if found.dtype != numpy.float32 or not found.flags.c_contiguous:
            found = throng.load_boxes(path, round="outward")
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    if found.ndim not in (2, 3) or found.shape[-1] != 6:
        raise UserError(f"{path}: found shape {found.shape}, wanted (n, 6) or (frames, n, 6)")
    return found if found.ndim == 3 else found[None]


def need_rerun() -> None:
    try:
        import rerun  # noqa: F401
    except ImportError as error:
        raise UserError('Rerun is missing (' + str(error) + '); pip install rerun-sdk, or in Throng\'s source tree pip install ".[view]"') from None


def arguments(given: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m throng.view", description="Viewer for boxes over time.")
    parser.add_argument("file", help="boxes: .npy, float32, (n, 6) or (frames, n, 6)")
    parser.add_argument("--save", metavar="FILE.rrd", help="write a recording instead of opening the viewer")
    parser.add_argument("--serve", action="store_true", help="serve the viewer to browsers, until Ctrl-C")
    parser.add_argument("--port", type=int, default=9090, help="port of the page for --serve")
    parser.add_argument("--data-port", type=int, default=9876, help="port of its data")
    parser.add_argument("--most", type=int, default=MAX_DRAWN, metavar="N", help="boxes to draw (%(default)s)")
    parser.add_argument("--margin", type=float, default=0.0, help="as for throng.find_pairs")
    return parser.parse_args(given)


def save(scene: Any, options: argparse.Namespace, stream: "rerun.RecordingStream") -> int:
    """The file gets its name when complete."""
    part = Path(options.save + ".part")
    try:
        part.touch()
        stream.save(part, default_blueprint=layout(moving(scene)))
        done = record(frames(scene, options.most, margin=options.margin), stream)
        stream.disconnect()
        os.replace(part, options.save)
    except OSError as error:
        raise UserError(f"{options.save}: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
    return done


def serve(scene: Any, options: argparse.Namespace, stream: "rerun.RecordingStream") -> None:
    import rerun as rr

    address = stream.serve_grpc(
        grpc_port=options.data_port,
        default_blueprint=layout(moving(scene)),
        server_memory_limit="50%",
        cors_allow_origin=[f"http://*:{options.port}"],
    )
    rr.serve_web_viewer(web_port=options.port, open_browser=False)
    for host in dict.fromkeys(["localhost", socket.gethostname()]):
        there = address.replace("127.0.0.1", host).replace("localhost", host)
        print(f"http://{host}:{options.port}/?url={there.replace('+', '%2B')}", flush=True)
    record(frames(scene, options.most, margin=options.margin), stream)
    print("all frames are loaded; Ctrl-C ends the server", flush=True)
    while True:
        time.sleep(1)


def main(given: list[str] | None = None) -> int:
    options = arguments(given)
    try:
        need_rerun()
        import rerun as rr

        if options.most < 1:
            raise UserError(f"--most {options.most}: wanted 1 or more")
        if options.save and options.serve:
            raise UserError("--save and --serve: give one of them")
        scene = load(options.file)
        stream = rr.RecordingStream("throng")
        if options.save:
            done = save(scene, options, stream)
            print(f"{options.save}: {done} frames; view it with: rerun {options.save}")
        elif options.serve:
            serve(scene, options, stream)
        else:
            screen = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
            if sys.platform == "linux" and not screen:
                raise UserError("there is no display; give --save FILE.rrd, or --serve")
            stream.spawn(default_blueprint=layout(moving(scene)))
            record(frames(scene, options.most, margin=options.margin), stream)
    except (UserError, ValueError, MemoryError) as error:
        print(f"throng.view: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 0 if options.serve else 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
