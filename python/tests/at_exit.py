"""A program that ends while a daemon thread is in a call: python at_exit.py WAY. Used by test_finder.py."""

import os
import sys
import threading
import time
import types
from typing import Any

import numpy

import throng

BOXES = throng.scene("pile", 20000)[0]
MANY = throng.scene("uniform", 100000)[0]
DOUBLES = MANY.astype(float)


def narrow_phase(pairs: Any) -> None:
    for _ in range(1000):  # the interpreter may end during this call
        pass


def update(live: throng.BroadPhase) -> None:
    live.move_all(BOXES)
    live.update()
    live.move_all(BOXES + numpy.float32(0.1))
    live.update()


def calls() -> dict[str, Any]:
    finder = throng.Finder()
    live = throng.BroadPhase()
    live.add(BOXES)
    return {
        "find_pairs": lambda: throng.find_pairs(BOXES),
        "float64": lambda: throng.find_pairs(DOUBLES),
        "long": lambda: throng.find_pairs(MANY, algorithm="all-pairs"),
        "find": lambda: finder.find(BOXES),
        "consume": lambda: finder.consume(BOXES, narrow_phase),
        "consume, long": lambda: finder.consume(MANY, narrow_phase),
        "update": lambda: update(live),
        "find_hits": lambda: live.find_hits(BOXES, numpy.ones((len(BOXES), 3), numpy.float32)),
        "update_boxes": lambda: throng.update_boxes(MANY[:, :3], [throng.sphere(1)]),
        "scene": lambda: throng.scene("uniform", 100000),
    }


def for_ever(call: Any) -> None:
    while True:
        call()


class Late:
    """Searches during module teardown, when no other thread gets the lock."""

    def __init__(self) -> None:
        self.finder, self.find_pairs, self.boxes = throng.Finder(), throng.find_pairs, MANY

    def __del__(self) -> None:
        said = "consumed" if sys.is_finalizing() else "early"
        try:
            self.finder.consume(self.boxes, len)
        except RuntimeError as error:
            said = str(error)
        os.write(1, f"{len(self.find_pairs(self.boxes)) > 0}, {said}\n".encode())


if __name__ == "__main__":
    sys.modules["late"] = module = types.ModuleType("late")
    setattr(module, "late", Late())
    del module
    for _ in range(2):
        threading.Thread(target=for_ever, args=(calls()[sys.argv[1]],), daemon=True).start()
    time.sleep(0.3)
