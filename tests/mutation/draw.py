#!/usr/bin/env python3
"""Draws mutants at random, so that their choice does not depend on the tests.

    draw.py TREE --count 60 --seed 1 [--under base,grid,tracking,...] > mutants.txt

Writes them in the format of mutants.txt; mutate.py runs them with --mutants FILE. Method: draws a
line uniformly from all lines of code under src/ that have a change, then one of its changes uniformly.
The changes, within one line:
  in a condition of if or while, or between the semicolons of for: a comparison (< as <=, == as !=,
  ...), && and ||, + and -, * and /, << and >>, a number by one, true and false, min and max, or the
  full condition: true, or false;
  in a returned, assigned or initial value: the same, except for the full value;
  a statement that is a call, an assignment or an increment: it is removed.
Excluded: compile-time constants, comments, and code that only runs with a GPU, MPI or a file."""

import argparse
import pathlib
import random
import re
import sys

from mutate import is_complete

MODULES = "base,bodies,grid,tracking,device,api"
SKIPPED = re.compile(r"\b(constexpr|static_assert|template|using|case|operator|namespace|struct|class|enum|goto)\b|^\s*#|THRONG_|\blog\b")
SWAPS = {
    "<": ["<=", ">="], "<=": ["<", ">"], ">": [">=", "<="], ">=": [">", "<"], "==": ["!="], "!=": ["=="],
    "&&": ["||"], "||": ["&&"], "+": ["-"], "-": ["+"], "*": ["/"], "/": ["*"], "<<": [">>"], ">>": ["<<"],
    "%": ["/"], "&": ["|"], "|": ["&"],
}
BINARY = re.compile(r" (<<|>>|<=|>=|==|!=|&&|\|\||<|>|\+|-|\*|/|%|&|\|) ")
WORDS = {"true": "false", "false": "true", "min": "max", "max": "min"}


def changes_within(code):
    """All variants of `code` with one change."""
    found = []
    for m in BINARY.finditer(code):
        found += [code[:m.start(1)] + new + code[m.end(1):] for new in SWAPS[m.group(1)]]
    for m in re.finditer(r"(?<![\w.])\d+(?=[uU]?(?:ll|LL|l|L)?\b)(?![.xX'])", code):
        found.append(code[:m.start()] + str(int(m.group()) + 1) + code[m.end():])
        if int(m.group()) > 0:
            found.append(code[:m.start()] + str(int(m.group()) - 1) + code[m.end():])
    for m in re.finditer(r"\b(true|false)\b|\b(?<=std::)(min|max)\b(?=[<(])", code):
        found.append(code[:m.start()] + WORDS[m.group()] + code[m.end():])
    return found


def closing(line, at):
    """The index of the bracket that closes the one at `at`; -1: not on this line."""
    depth = 0
    for i in range(at, len(line)):
        depth += (line[i] in "([{") - (line[i] in ")]}")
        if depth == 0:
            return i
    return -1


def changes_of(line):
    """(old, new, whether they are statements) for all changes of a line."""
    code = line.split("//")[0].rstrip()
    if not code.strip() or SKIPPED.search(code) or '"' in code:
        return []
    found = []
    for m in re.finditer(r"\b(?:if|while) \(", code):
        end = closing(code, m.end() - 1)
        condition = code[m.end():end] if end > 0 else ""
        if condition and ";" not in condition and not re.search(r"[^=!<>]=[^=]", condition):
            found += [(condition, new, False) for new in [*changes_within(condition), "true", "false"]]
    m = re.search(r"\bfor \([^;]*; ([^;]+); ", code)
    if m:
        found += [(m.group(1), new, False) for new in changes_within(m.group(1))]
    m = re.search(r"\breturn ([^;{]+);", code) or re.search(r"^[^(]*[\w\])] = ([^;{=]+);$", code)
    if m:
        found += [(m.group(1), new, False) for new in changes_within(m.group(1))]
    m = re.search(r"^\s*((?!return|throw|delete|break|continue|else|do\b)[a-zA-Z_][\w.\[\]>-]*(\(.*\)| [-+*/|&^]?=(?!=) .*|\+\+|--);)$", code)
    m = m or re.search(r"^\s*((?:\+\+|--)[a-zA-Z_][\w.\[\]>-]*;)$", code)
    if m and code.count("(") == code.count(")") and "[&]" not in code and "[=]" not in code:
        found.append((m.group(1), ";", True))
    return [(old, new, s) for old, new, s in found if s or (is_complete(old) and is_complete(new))]


def files_under(tree, modules):
    src = tree / "src"
    for path in sorted(src.rglob("*.[ch]pp")):
        module = path.relative_to(src).parts[0] if path.parent != src else "api"
        if module in modules and "absent" not in path.name and not path.name.startswith("cuda_"):
            yield path


def number_of(text, old, at):
    """The number of this occurrence of `old`, as mutate.span_of counts; and the number of all."""
    pattern = r"\s+".join(re.escape(word) for word in old.split())
    starts = [m.start() for m in re.finditer(pattern, text)
              if "//" not in text[text.rfind("\n", 0, m.start()) + 1:m.start()]]
    return (starts.index(at) + 1 if at in starts else 0), len(starts)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tree", type=pathlib.Path)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--under", default=MODULES)
    arguments = parser.parse_args()
    chance = random.Random(arguments.seed)
    lines = []
    for path in files_under(arguments.tree, arguments.under.split(",")):
        text, at = path.read_text(), 0
        for line in text.splitlines(keepends=True):
            changes = changes_of(line.rstrip("\n"))
            if changes:
                lines.append((path, at, line, changes))
            at += len(line)
    drawn, taken = {}, {}
    while sum(map(len, drawn.values())) < arguments.count and lines:
        path, at, line, changes = lines.pop(chance.randrange(len(lines)))
        old, new, is_statement = chance.choice(changes)
        text = path.read_text()
        begin = at + line.index(old)
        number, count = number_of(text, old, begin)
        span = (begin, begin + len(old))
        if number == 0 or any(a < span[1] and span[0] < b for a, b in taken.get(path, [])):
            continue
        taken.setdefault(path, []).append(span)
        nth = f"[{number}] " if count > 1 else ""
        drawn.setdefault(path, []).append(f"{nth}{old} {'~>' if is_statement else '=>'} {new}")
    print(f"# Drawn by draw.py --count {arguments.count} --seed {arguments.seed} --under {arguments.under}")
    for path in sorted(drawn):
        print(f"\n@ {path.relative_to(arguments.tree / 'src')}")
        print("\n".join(drawn[path]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
