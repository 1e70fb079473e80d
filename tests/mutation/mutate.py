#!/usr/bin/env python3
"""Mutation testing: breaks the library in one place at a time and checks that the tests detect it.

All mutants of mutants.txt are compiled into one library: the code of the i-th takes its mutated form
if the environment variable THRONG_MUTANT is i. So there is one build, and a mutant costs only the
tests up to the first that detects it. The tests run from the cheapest on; a mutant is killed by the
first test that fails, crashes or takes too long.

    mutate.py TREE BUILD [--only FIRST-LAST] [--suites PATTERN] [--jobs N] [--mutants FILE]
    mutate.py TREE BUILD --check

TREE is a copy of the source tree, which is modified; scripts/mutate makes BUILD from it.
"""

import argparse
import concurrent.futures
import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
HEADER = """// The active mutant; see mutate.py.
#pragma once
#include <cstdlib>
#include <type_traits>
inline const int throng_mutant =
    std::getenv("THRONG_MUTANT") ? std::atoi(std::getenv("THRONG_MUTANT")) : 0;
#define THRONG_MUTANT(i) (!std::is_constant_evaluated() && throng_mutant == (i))
"""


class Mutant:
    def __init__(self, number, file, old, new, nth, statement, line):
        self.number, self.file, self.old, self.new = number, file, old, new
        self.nth, self.statement, self.line = nth, statement, line

    def __str__(self):
        return f"{self.number:3d} {self.file}: {self.old} {'~>' if self.statement else '=>'} {self.new}"


def is_complete(code):
    """Whether it can be an expression: detects most code that would not compile before the build."""
    colons = code.replace("::", "").count(":")
    pairs = all(code.count(a) == code.count(b) for a, b in ("()", "[]", "{}"))
    return pairs and ";" not in code and code.count("?") == colons


def read_mutants(path):
    mutants, file = [], None
    for line_number, line in enumerate(path.read_text().splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        if line.startswith("@ "):
            file = line[2:].strip()
            continue
        nth = re.match(r"\[(\d+)\] ", line)
        body = line[nth.end():] if nth else line
        statement = " ~> " in body
        old, new = body.split(" ~> " if statement else " => ")
        if not statement and not (is_complete(old) and is_complete(new)):
            raise SystemExit(f"mutants.txt:{line_number}: '{line}' is not an expression; statements need ~>")
        mutants.append(Mutant(len(mutants) + 1, file, old.strip(), new.strip(),
                              int(nth.group(1)) if nth else 0, statement, line_number))
    return mutants


def span_of(text, mutant):
    """The span of its code: (begin, end)."""
    pattern = r"\s+".join(re.escape(word) for word in mutant.old.split())
    found = [m for m in re.finditer(pattern, text)
             if "//" not in text[text.rfind("\n", 0, m.start()) + 1:m.start()]]
    where = f"mutants.txt:{mutant.line}: '{mutant.old}' occurs {len(found)} times in {mutant.file}"
    if mutant.nth > len(found) or (mutant.nth == 0 and len(found) != 1):
        raise SystemExit(where)
    return found[max(mutant.nth, 1) - 1].span()


def render(text, begin, end, places):
    """The code from begin to end with its mutants, nested ones included."""
    inner = {p: group for p, group in places.items()
             if begin <= p[0] and p[1] <= end and p != (begin, end)}
    code, at = "", begin
    for place in sorted(inner, key=lambda p: (p[0], -p[1])):
        if place[1] <= at:
            continue  # inside the previous one
        if place[0] < at:
            raise SystemExit(f"mutants.txt:{inner[place][0].line}: overlaps another's code in part")
        code += text[at:place[0]] + render(text, *place, inner)
        at = place[1]
    code += text[at:end]
    for m in places.get((begin, end), []):
        if m.statement:
            code = f"if (THRONG_MUTANT({m.number})) {{ {m.new} }} else {{ {code} }}"
        else:
            code = f"(THRONG_MUTANT({m.number}) ? ({m.new}) : ({code}))"
    return code


def apply(tree, mutants):
    """Writes all mutants of each file into the tree."""
    for file in sorted({m.file for m in mutants}):
        path = tree / "src" / file
        text = path.read_text()
        places = {}
        for m in (m for m in mutants if m.file == file):
            places.setdefault(span_of(text, m), []).append(m)
        path.write_text(render(text, 0, len(text), places))
    (tree / "src" / "mutant.hpp").write_text(HEADER)


def suites(build):
    """The tests, the cheapest first: a name, the modules whose mutants they are for, a command, and a
    limit in processor seconds, at least ten times the usual."""
    bin_ = build / "bin"
    soak = [bin_ / "throng-soak", "--report-seconds", "1e9", "--folder", ""]
    found = []

    def add(name, modules, limit, command):
        found.append((name, modules.split(), [str(word) for word in command], limit))

    def test(name, modules, limit, program, chosen):
        add(name, modules, limit,
            [bin_ / program, "--gtest_brief=1", "--gtest_fail_fast", "--gtest_filter=" + chosen])

    test("core", "base", 20, "base_test", "-BodyBounds*:Margin*")
    test("margins", "base", 40, "base_test", "Margin*")
    test("cpu", "grid", 20, "grid_test", "*")
    test("planning", "base device", 20, "device_test", "Planning*:Binning*:PairKeys*:Workspace*:CellSort*:Worlds*")
    test("tiny", "base grid", 30, "conformance_test",
         "All/Exact.TinySets/*scalar_1_any:All/Invalid.*/grid_scalar_1_any:-*auto*")
    test("tiny, emulated", "base device", 30, "conformance_test",
         "All/Exact.TinySets/emulated*_1_canonical:All/Invalid.*/emulated*_1_any:"
         "All/Filter.Static*/emulated_grid*_1_any")
    test("bounds of bodies", "base", 40, "base_test", "BodyBounds*")
    test("bodies", "base", 180, "conformance_test", "*UpdateBoxes*")
    test("sinks", "grid", 60, "conformance_test",
         "All/Consume.*/grid_scalar_3_*:All/Capacity.*/grid_scalar_3_any:StopThat*:-*MorePairs*")
    test("engine", "device", 120, "device_test", "DiscreteEngine*")
    test("boxes that move", "grid", 20, "broad_phase_test", "BroadPhaseMoves*")
    test("live", "tracking", 20, "tracking_test", "*")
    test("calls", "tracking api", 120, "broad_phase_test", "-*Soak*:*SameEverywhere*")
    test("cost of moving", "tracking", 60, "comparisons_test", "*MovingComparisons*:Comparisons*")
    add("soak", "base grid tracking", 30, [*soak, "--rounds", "300", "--seed", "3"])
    add("soak of emulated", "base device", 40,
        [*soak, "--rounds", "150", "--seed", "4", "--emulated", "1"])
    test("exact", "base grid", 200, "conformance_test",
         "All/Exact.*/grid_scalar_1_any:All/Exact.*/grid_avx512_1_any:"
         "All/CellScaleOfMany.*/grid_scalar_1_any:All/Filter.*/grid_scalar_1_any")
    test("comparisons", "grid", 60, "comparisons_test", "*/uniform_10000:*/mixed_10000:*/clusters_10000")
    test("objects on a device", "device", 120, "device_test", "-DiscreteEngine*")
    test("emulated", "base device", 400, "conformance_test", "*emulated_*_1_any:-*MorePairs*:*CellScale*")
    test("explain", "api grid", 40, "conformance_test", "Explain*")
    test("options of C", "api", 120, "conformance_test", "CApi*:COptions*:CStatus*:CLayout*:CUpdateBoxes*")
    test("flat with not flat", "grid", 60, "conformance_test", "All/Flat.*/grid_scalar_1_any:All/Flat.*/all_pairs_scalar_1_any")
    test("embedding", "device grid", 200, "embedding_test", "*")
    test("signs", "signs", 200, "mesh_test", "*Orient*:ScaledInteger*")
    test("exact signs", "signs", 600, "mesh_exact_test", "*Orient*")
    test("integers and distances", "distance", 600, "mesh_exact_test", "ExactInteger*:CommonUnit*:TrianglesWithin*")
    test("known distances", "distance", 200, "mesh_test", "TrianglesWithin*")
    test("descriptions", "describe", 600, "mesh_exact_test", "DescribeIntersection*:ExactInteger*:CommonUnit*")
    test("known descriptions", "describe", 100, "mesh_test", "DescribeIntersection*:KnownCases*:CMesh.Describe*")
    test("meshes on a device", "device_mesh", 600, "mesh_test", "DeviceMesh*")
    test("boxes for contact", "contact", 100, "mesh_exact_test", "ContactBoxes*")
    test("contact", "contact", 600, "mesh_test", "*Contact*")
    test("exact triangles", "mesh", 600, "mesh_exact_test", "*Kinds*:PlaneFilter*")
    test("meshes", "mesh", 600, "mesh_test", "-*Orient*:ScaledInteger*:*Contact*:DeviceMesh*")
    test("meshes on a host device", "mesh", 600, "mesh_test", "DeviceMesh*")
    test("large", "grid base", 300, "large_test", "*")
    test("conformance", "grid", 400, "conformance_test", "*_1_any:*auto*:CApi*:*grid_scalar_3_*:-*emulated*")
    add("soak of many boxes", "base device grid tracking", 300, [*soak, "--rounds", "60", "--seed", "6", "--many", "1"])
    add("long soak", "base device grid tracking", 400, [*soak, "--rounds", "4000", "--seed", "5"])
    return found


def mesh_modules(file):
    """Of code for meshes: which of their tests concern it; else none."""
    if file == "api/c_mesh_views.hpp":
        return {"mesh", "contact"}
    if "contact" in file or file.startswith("mesh/vertex_rings"):
        return {"contact"}
    if "describe" in file:
        return {"describe"}
    if file.startswith("device/mesh"):
        return {"device_mesh"}
    if re.match("mesh/(orient|expansion|scaled_integer)", file):
        return {"signs", "mesh"}
    if re.match("mesh/(distance|double_double)", file):
        return {"distance", "mesh"}
    if file == "mesh/exact_integer.hpp":
        return {"distance", "describe"}
    return {"mesh"} if "mesh" in file else set()


def tests_of_module(mutant, tests):
    """The tests of the mutant's module, and of those that share its code."""
    modules = {mutant.file.split("/")[0]}
    modules = mesh_modules(mutant.file) or modules
    if modules & {"base", "grid", "bodies"}:
        modules = {"base", "grid"}
    if mutant.file.startswith("device/plan/"):
        modules.add("base")
    if mutant.file in ("base/ray.hpp", "base/swept_box.hpp", "base/block_bitmap.hpp"):  # only queries use these
        modules = {"tracking"}
    return [test for test in tests if modules & set(test[1])]


def limit_time(seconds):
    """Limits processor time, so that a busy machine kills no mutant."""
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))


def kill(mutant, tests, folder):
    """(the killer or None, how, seconds)"""
    environment = dict(os.environ, THRONG_MUTANT=str(mutant), THRONG_CONFIGS="all")
    start = time.time()
    for name, _, command, limit in tests:
        try:
            done = subprocess.run(command, env=environment, cwd=folder, timeout=20 * limit,
                                  preexec_fn=lambda: limit_time(limit),
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        except subprocess.TimeoutExpired:
            return name, "hung", time.time() - start
        if done.returncode != 0:
            how = ("hung" if done.returncode == -signal.SIGXCPU
                   else "crashed" if done.returncode < 0 else "failed")
            return name, how, time.time() - start
    return None, "survived", time.time() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tree", type=pathlib.Path)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--apply", action="store_true", help="write the mutants into the tree, then stop")
    parser.add_argument("--check", action="store_true", help="check that the tree contains all of them, then stop")
    parser.add_argument("--only", default="1-1000000", help="FIRST-LAST, or numbers: 3,17,20")
    parser.add_argument("--suites", default=".*", help="only tests whose name starts with this pattern")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--mutants", type=pathlib.Path, default=HERE / "mutants.txt")
    arguments = parser.parse_args()
    mutants = read_mutants(arguments.mutants)
    if arguments.apply:
        apply(arguments.tree, mutants)
        print(f"{len(mutants)} mutants")
        return 0
    if arguments.check:
        for m in mutants:
            span_of((arguments.tree / "src" / m.file).read_text(), m)
        return 0
    arguments.build = arguments.build.resolve()
    tests = [test for test in suites(arguments.build) if re.match(arguments.suites, test[0])]
    folder = arguments.build / "mutation"
    folder.mkdir(exist_ok=True)
    if "-" in arguments.only:
        first, last = map(int, arguments.only.split("-"))
        chosen = [m for m in mutants if first <= m.number <= last]
    else:
        chosen = [m for m in mutants if str(m.number) in arguments.only.split(",")]
    tests = [test for test in tests if any(test in tests_of_module(m, tests) for m in chosen)]
    killer, how, seconds = kill(0, tests, folder)
    if killer:
        raise SystemExit(f"without a mutant, the tests fail: {killer} {how}")
    print(f"no mutant: all tests pass, in {seconds:.0f} s", flush=True)
    survivors = []
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        results = pool.map(lambda m: kill(m.number, tests_of_module(m, tests), folder), chosen)
        for mutant, (killer, how, seconds) in zip(chosen, results):
            by = f"by {killer}" if killer else ""
            print(f"{how:8s} {seconds:6.1f} s  {mutant}  {by}", flush=True)
            if not killer:
                survivors.append(mutant)
    killed = len(chosen) - len(survivors)
    print(f"{len(chosen)} mutants, {killed} killed: {100 * killed / max(len(chosen), 1):.1f} %; survivors:")
    for mutant in survivors:
        print(mutant)
    return 0


if __name__ == "__main__":
    sys.exit(main())
