"""Ctrl-C, 0.2 s into a much longer call."""

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

MAX_SECONDS = 10.0  # seconds until it must have ended


@contextmanager
def ctrl_c() -> Iterator[None]:
    """The body must end soon, by KeyboardInterrupt."""
    timer = threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT))
    # Background jobs of a shell ignore that signal.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    started = time.monotonic()
    try:
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            yield
        assert time.monotonic() - started < MAX_SECONDS
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)
