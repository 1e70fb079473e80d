#!/usr/bin/env python3
"""Times libraries of PyPI and throng.mesh on triangle meshes.

    pip install numpy meshlib open3d python-fcl ipctk   # open3d needs libusb-1.0-0 and libgl1
    bench/mesh_libraries.py --csv FILE --machine NAME --commit HASH

A library that is not installed is left out. All libraries of a case run in turn, `--rounds` times; the CSV file has
medians, in the columns of bench/results/README.md. The first round is not counted. MeshLib may be used for other than
commercial purposes only.

The times are those of the call from arrays, or the library's own mesh, to pairs. Trees are built in the call, except where
the setting says 'tree kept'. The libraries differ in what they report: see the column `found`.
"""

import argparse
import csv
import datetime
import importlib
import os
import statistics
import sys
import time

import numpy
import throng

COLUMNS = ("machine date commit kind case objects setting library threads metric value least samples found checksum "
           "note").split()


# ---- meshes by rule: float64 vertices, int64 faces ----------------------------------------------

def grid_faces(rows, columns, wrapped=False):
    """Squares of two triangles; `wrapped` joins the last column to the first."""
    i, k = numpy.meshgrid(numpy.arange(rows - 1), numpy.arange(columns if wrapped else columns - 1), indexing="ij")
    a, b = i * columns + k, i * columns + (k + 1) % columns
    c, d = a + columns, b + columns
    return numpy.stack([a, b, c, b, d, c], axis=-1).reshape(-1, 3)


def sphere(triangles):
    """A sphere of unit radius whose vertices are moved at random by a third of an edge."""
    n = round((triangles / 2) ** 0.5)
    random = numpy.random.default_rng(1)
    u, v = numpy.meshgrid(numpy.linspace(0.05, numpy.pi - 0.05, n), numpy.arange(n) / n * 2 * numpy.pi, indexing="ij")
    p = numpy.stack([numpy.sin(u) * numpy.cos(v), numpy.sin(u) * numpy.sin(v), numpy.cos(u)], axis=-1).reshape(-1, 3)
    return p + random.uniform(-1, 1, p.shape) / n, grid_faces(n, n, wrapped=True)


def crumpled(triangles):
    """A sheet that waves of random directions fold through itself."""
    n = round((triangles / 2) ** 0.5)
    random = numpy.random.default_rng(2)
    x, y = numpy.meshgrid(numpy.linspace(0, 1, n), numpy.linspace(0, 1, n), indexing="ij")
    flat = numpy.stack([x, y], axis=-1).reshape(-1, 2)
    p = numpy.hstack([flat, 0 * flat[:, :1]])
    for _ in range(12):
        wave, phase = random.standard_normal(2) * 25, random.random() * 6
        p += numpy.outer(numpy.sin(flat @ wave + phase), random.standard_normal(3) * 0.015)
    return p, grid_faces(n, n)


def spiral(triangles):
    """A rolled-up sheet with layers half an edge apart: no pairs."""
    n = round((triangles / 2) ** 0.5)
    pitch, inner = 0.5 / (2 * numpy.pi), 3.0
    first = inner / pitch
    angle = numpy.sqrt(first**2 + 2 * numpy.arange(n) / pitch)  # one unit of arc length per vertex
    a, z = numpy.meshgrid(angle, numpy.arange(n), indexing="ij")
    r = pitch * a
    return numpy.stack([r * numpy.cos(a), r * numpy.sin(a), z], axis=-1).reshape(-1, 3), grid_faces(n, n)


def soup(triangles):
    """Triangles at random in a cube, without shared vertices."""
    random = numpy.random.default_rng(3)
    center = random.random((triangles, 1, 3))
    p = center + random.uniform(-1, 1, (triangles, 3, 3)) * 0.8 * triangles ** (-1 / 3)
    return p.reshape(-1, 3), numpy.arange(3 * triangles).reshape(-1, 3)


MESHES = {"sphere": sphere, "crumpled": crumpled, "spiral": spiral, "soup": soup}


# ---- libraries ----------------------------------------------------------------------------------

def optional(name):
    try:
        return importlib.import_module(name)
    except ImportError:
        print(f"{name} is not installed; left out", file=sys.stderr)
        return None


def version(name):
    from importlib.metadata import PackageNotFoundError, version
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


class Method:
    """`call` returns what the library returns; `count` its number of pairs."""

    def __init__(self, library, setting, call, count=len, prepare=None, threads=None):
        self.library, self.setting, self.call, self.count = library, setting, call, count
        self.prepare, self.threads = prepare, threads
        self.times, self.found, self.checksum = [], 0, ""


def checksum(pairs):
    """throng::pair_checksum."""
    x = pairs[:, 0].astype(numpy.uint64) << numpy.uint64(32) | pairs[:, 1].astype(numpy.uint64)
    x += numpy.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> numpy.uint64(30))) * numpy.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> numpy.uint64(27))) * numpy.uint64(0x94D049BB133111EB)
    return f"{int(numpy.sum(x ^ (x >> numpy.uint64(31)), dtype=numpy.uint64)):016x}"


def meshlib_mesh(vertices, faces):
    from meshlib import mrmeshnumpy
    return mrmeshnumpy.meshFromFacesVerts(faces.astype(numpy.int32), vertices.astype(numpy.float32))


def self_methods(vertices, faces, threads):
    floats, indices = vertices.astype(numpy.float32), faces.astype(numpy.uint32)
    finder = throng.mesh.Finder(threads=threads)
    yield Method("Throng Python", "self, float32, uint32",
                 lambda: throng.mesh.self_intersections(floats, indices, threads=threads))
    yield Method("Throng Python, Finder", "self, float32, uint32", lambda: finder.self_intersections(floats, indices))
    yield Method("Throng Python", "self, float64, int64",
                 lambda: throng.mesh.self_intersections(vertices, faces, threads=threads))
    if optional("meshlib"):
        from meshlib import mrmeshpy
        mesh = meshlib_mesh(vertices, faces)
        part = mrmeshpy.MeshPart(mesh)
        name = f"MeshLib {version('meshlib')}"
        for touching in (False, True):
            setting = f"self, float32, touching {'counts' if touching else 'does not count'}"
            yield Method(name, setting, lambda t=touching: mrmeshpy.findSelfCollidingTriangles(part, touchIsIntersection=t),
                         prepare=mesh.invalidateCaches)
        yield Method(name, "self, float32, touching counts, tree kept",
                     lambda: mrmeshpy.findSelfCollidingTriangles(part, touchIsIntersection=True))
    if len(faces) <= 20000 and optional("open3d"):
        import open3d
        mesh = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(vertices), open3d.utility.Vector3iVector(faces))
        yield Method(f"Open3D {version('open3d')}", "self, float64", mesh.get_self_intersecting_triangles)


def two_methods(a, b, threads):
    floats = [(v.astype(numpy.float32), f.astype(numpy.uint32)) for v, f in (a, b)]
    yield Method("Throng Python", "two meshes, float32, uint32",
                 lambda: throng.mesh.intersections(*floats, threads=threads))
    yield Method("Throng Python", "two meshes, float64, int64", lambda: throng.mesh.intersections(a, b, threads=threads))
    if optional("meshlib"):
        from meshlib import mrmeshpy
        meshes = [meshlib_mesh(*mesh) for mesh in (a, b)]
        parts = [mrmeshpy.MeshPart(mesh) for mesh in meshes]

        def forget():
            for mesh in meshes:
                mesh.invalidateCaches()

        yield Method(f"MeshLib {version('meshlib')}", "two meshes, float32",
                     lambda: mrmeshpy.findCollidingTriangles(*parts), prepare=forget)
    if optional("fcl"):
        import fcl

        def collide():
            objects = []
            for vertices, faces in (a, b):
                model = fcl.BVHModel()
                model.beginModel(len(faces), len(vertices))
                model.addSubModel(vertices, faces)
                model.endModel()
                objects.append(fcl.CollisionObject(model))
            result = fcl.CollisionResult()
            fcl.collide(*objects, fcl.CollisionRequest(num_max_contacts=10**7), result)
            return result.contacts

        yield Method(f"python-fcl {version('python-fcl')}", "two meshes, float64", collide, threads=1)


def contact_scene(vertices):
    """A crumpled sheet, each of whose vertices moves by about an edge."""
    t0, faces = crumpled(2 * vertices)
    n = round(len(t0) ** 0.5)
    t0 *= n
    step = numpy.random.default_rng(4).standard_normal((len(t0), 3)) * 0.3
    both = numpy.sort(numpy.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    keys = numpy.unique(both[:, 0] * len(t0) + both[:, 1])
    return t0, t0 + step, numpy.stack([keys // len(t0), keys % len(t0)], axis=1), faces


def contact_methods(t0, t1, edges, faces, radius, threads):
    def total(found):
        return len(found.edge_edge) + len(found.vertex_face)

    small = edges.astype(numpy.uint32), faces.astype(numpy.uint32)
    finder = throng.mesh.ContactFinder(threads=threads)
    yield Method("Throng Python", "contact, arrays",
                 lambda: throng.mesh.contact_candidates(t0, t1, *small, radius, threads=threads), total)
    yield Method("Throng Python, ContactFinder", "contact, arrays", lambda: finder.find(t0, t1, *small, radius), total)
    if not optional("ipctk"):
        return
    import ipctk
    from throng import ipc
    ipctk.set_num_threads(threads)
    # ipctk's edges are those of its own order.
    edges, faces = edges.astype(numpy.int32), faces.astype(numpy.int32)
    mesh = ipctk.CollisionMesh(t0, edges, faces)
    start, end = numpy.asfortranarray(t0), numpy.asfortranarray(t1)

    def candidates_by(broad_phase):
        candidates = ipctk.Candidates()
        candidates.build(mesh, start, end, radius, broad_phase)
        return candidates

    def count(candidates):
        return len(candidates)

    own = ipc.BroadPhase(accepts_all=True, threads=threads)
    yield Method("Throng Python, ipc.BroadPhase", "contact, ipctk.Candidates", lambda: candidates_by(own), count)
    for name in ("LBVH", "HashGrid"):
        broad_phase = getattr(ipctk, name)()
        yield Method(f"ipctk {version('ipctk')} {name}", "contact, ipctk.Candidates", lambda b=broad_phase: candidates_by(b), count)


# ---- measurement --------------------------------------------------------------------------------

def measure(case, objects, methods, rounds, threads):
    methods = list(methods)
    for round_ in range(rounds + 1):
        for method in methods:
            if method.prepare:
                method.prepare()
            started = time.perf_counter()
            found = method.call()
            elapsed = 1e3 * (time.perf_counter() - started)
            if round_ == 0:
                method.found = method.count(found)
                if isinstance(found, numpy.ndarray):
                    method.checksum = checksum(found)
            else:
                method.times.append(elapsed)
            del found
    for method in methods:
        median = statistics.median(method.times)
        used = threads if method.threads is None else method.threads
        print(f"{case:10} {objects:9,} {method.setting:45} {method.library:32} {median:10.2f} ms "
              f"{method.found:11,} pairs", file=sys.stderr, flush=True)
        yield {"kind": "mesh-libraries", "case": case, "objects": objects, "setting": method.setting,
               "library": method.library, "threads": used, "metric": "search_ms", "value": f"{median:.4g}",
               "least": f"{min(method.times):.4g}", "samples": len(method.times), "found": method.found,
               "checksum": method.checksum}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--csv", help="file; default: the standard output")
    parser.add_argument("--machine", default="this")
    parser.add_argument("--commit", default=throng.__version__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--scale", type=float, default=1.0, help="factor on the number of triangles")
    parser.add_argument("--note", default="", help="text for the column note, such as what else ran")
    parser.add_argument("--only", nargs="*", help="cases: " + ", ".join([*MESHES, "two-spheres", "contact"]))
    options = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):  # for libraries without an option
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[: options.threads])

    def wanted(case):
        return not options.only or case in options.only

    rows = []
    for case, triangles in (("sphere", 5000), ("sphere", 70000), ("crumpled", 1000000), ("spiral", 1000000), ("soup", 100000)):
        if wanted(case):
            vertices, faces = MESHES[case](int(triangles * options.scale))
            rows += measure(case, len(faces), self_methods(vertices, faces, options.threads), options.rounds, options.threads)
    if wanted("two-spheres"):
        vertices, faces = sphere(int(70000 * options.scale))
        other = vertices + [0.5, 0.25, 0.125]
        methods = two_methods((vertices, faces), (other, faces), options.threads)
        rows += measure("two-spheres", 2 * len(faces), methods, options.rounds, options.threads)
    if wanted("contact"):
        scene = contact_scene(int(250000 * options.scale))
        methods = contact_methods(*scene, 0.05, options.threads)
        rows += measure("contact", len(scene[0]), methods, options.rounds, options.threads)
    today = datetime.datetime.now(datetime.timezone.utc).date()
    with open(options.csv, "w", newline="") if options.csv else sys.stdout as stream:
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({"machine": options.machine, "date": today, "commit": options.commit, **row, "note": options.note})


if __name__ == "__main__":
    main()
