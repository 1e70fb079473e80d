"""A page in headless Chromium, controlled through a pair of pipes."""

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from typing import Any

PROGRAM = shutil.which("chromium") or shutil.which("google-chrome")


class Browser:
    def __init__(self, size: tuple[int, int], console: str) -> None:
        """`console`: the file for its console output."""
        assert PROGRAM is not None
        # After its termination request the browser may still write into its cache.
        self.folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        child_in, self.to = os.pipe()
        self.back, child_out = os.pipe()
        # It reads descriptor 3 and writes descriptor 4.
        self.process = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{child_in} 4>&{child_out}', "bash", PROGRAM, "--headless=new",
             "--no-sandbox", "--remote-debugging-pipe", f"--user-data-dir={self.folder.name}",
             "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist",
             "--hide-scrollbars", "--enable-logging=stderr", f"--window-size={size[0]},{size[1]}"],
            pass_fds=(child_in, child_out), stdout=subprocess.DEVNULL, stderr=open(console, "wb"),
        )  # fmt: skip
        os.close(child_in)
        os.close(child_out)
        self.buffer = b""
        self.number = 0
        self.session: dict[str, str] = {}

    def open(self, address: str) -> None:
        target = self.call("Target.createTarget", url=address)["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self.session = {"sessionId": attached["sessionId"]}

    def picture(self) -> bytes:
        """A PNG screenshot."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def call(self, method: str, **parameters: Any) -> Any:
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters, **self.session}
        os.write(self.to, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + 150
        while time.monotonic() < deadline:
            while b"\0" in self.buffer:
                answer, _, self.buffer = self.buffer.partition(b"\0")
                reply = json.loads(answer)
                if reply.get("id") == self.number:
                    assert "result" in reply, reply
                    return reply["result"]
            if select.select([self.back], [], [], 1)[0]:
                self.buffer += os.read(self.back, 1 << 20)
        raise TimeoutError(f"no answer to {method}")

    def close(self) -> None:
        self.process.terminate()
        self.process.wait(20)
        os.close(self.to)
        os.close(self.back)
        self.folder.cleanup()
