"""The module in wasmtime: its pairs have the checksums of the library elsewhere.

python wasmtime_golden.py FOLDER LAYOUT: the folder has throng-web-cases's cases.json and cases.bin, and web/throng.wasm is
beside it; LAYOUT is layout.js of the package as JSON. Needs the packages wasmtime and numpy.
"""

import json
import struct
import sys
from pathlib import Path

import numpy
from wasmtime import Engine, Linker, Module, Store, WasiConfig

folder = Path(sys.argv[1])
layout = json.loads(sys.argv[2])

store = Store(Engine())
store.set_wasi(WasiConfig())
linker = Linker(store.engine)
linker.define_wasi()
instance = linker.instantiate(store, Module.from_file(store.engine, str(folder / "../web/throng.wasm")))
exports = instance.exports(store)
memory = exports["memory"]


def call(name, *given):
    value = exports[name](store, *given)
    return value & 0xFFFFFFFF if isinstance(value, int) else value


def read(form, at):
    return struct.unpack(form, memory.read(store, at, at + struct.calcsize(form)))[0]


def mix64(x):
    x = x + numpy.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> numpy.uint64(30))) * numpy.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> numpy.uint64(27))) * numpy.uint64(0x94D049BB133111EB)
    return x ^ (x >> numpy.uint64(31))


def checksum(pairs):
    keys = pairs[:, 0].astype(numpy.uint64) << numpy.uint64(32) | pairs[:, 1]
    return f"{int(mix64(keys).sum(dtype=numpy.uint64)):016x}"


def find(rows):
    """The pairs of boxes, (n, 6) float32."""
    at = call("malloc", rows.nbytes)
    memory.write(store, rows.tobytes(), at)
    boxes = bytearray(layout["boxes"]["bytes"])
    corners = [at + 4 * k for k in range(6)]
    struct.pack_into("<I", boxes, layout["boxes"]["count"], len(rows))
    struct.pack_into("<6I", boxes, layout["boxes"]["corner"], *corners)
    struct.pack_into("<I", boxes, layout["boxes"]["stride"], 24)
    view = call("malloc", len(boxes))
    memory.write(store, bytes(boxes), view)
    capacity = 400_000
    out = call("malloc", 8 * capacity)
    status = call("throng_find_into", finder, view, 0, out, capacity)
    assert status == 0, f"status {status}"
    found = read("<Q", call("throng_finder_result", finder) + layout["result"]["found"])
    pairs = numpy.frombuffer(bytes(memory.read(store, out, out + 8 * found)), numpy.uint32).reshape(-1, 2)
    for address in (at, view, out):
        call("free", address)
    return pairs


call("_initialize")
options = call("malloc", layout["options"]["bytes"])
call("throng_options_init_sized", options, layout["options"]["bytes"])
finder = call("throng_finder_create", options)

words = numpy.fromfile(folder / "cases.bin", numpy.float32)
golden = json.loads((folder / "cases.json").read_text())["golden"]
plain = [one for one in golden if set(one) == {"name", "boxes", "pairs", "checksum", "canonical"}]
assert len(plain) >= 15, len(plain)
for one in plain:
    start, length = one["boxes"]
    assert start % 4 == 0
    pairs = find(words[start // 4 : start // 4 + length].reshape(-1, 6))
    assert len(pairs) == one["pairs"], f"{one['name']}: {len(pairs)} pairs, wanted {one['pairs']}"
    assert checksum(pairs) == one["checksum"], one["name"]
print(f"{len(plain)} scenes in wasmtime have the checksums of the library")
