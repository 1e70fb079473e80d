#!/usr/bin/env python3
"""Converts the plain comments of a header, // and /* */, to Doxygen comments.

A comment before a declaration, or after it on the same line, documents it. A comment that continues
below at the same column belongs to it. The first comment is that of the file. Lines that are indented
by two blanks or more are verbatim. Private parts of classes are left out: breathe would show them.
"""

import re
import sys

WHOLE = re.compile(r"^(\s*)// ?(.*)$")
PRIVATE = re.compile(r"^ private:\n(?:(?!\};).*\n)*", re.M)  # up to the brace that ends the class
BEHIND = re.compile(r"^(\s*[^\s/].*?)(\s*)// ?(.*)$")


def plain(text: str) -> str:
    """Escapes Doxygen commands, HTML and links; text in backquotes is code."""
    text = re.sub(r"([@<>#\\])", r"\\\1", text)
    return re.sub(r"`([^`]+)`", r"<tt>\1</tt>", text)


def cpp(lines: list[str]) -> list[str]:
    out = []
    first = True  # the first comment of the file
    column = -1  # of a comment after a declaration, which can continue below
    verbatim = False
    for line in lines:
        line = re.sub(r"\s*// ?NOLINT.*$", "", line)
        # The page of the reference sets the namespace once for all headers.
        line = re.sub(r"^namespace throng::(\w+) \{", r"namespace \1 {", line)
        line = re.sub(r"^(namespace throng \{|\}  // namespace throng)$", "", line)
        whole, behind = WHOLE.match(line), BEHIND.match(line)
        if verbatim and not (whole and whole.group(2).startswith("  ")):
            out.append("/// \\endverbatim")
            verbatim = False
        if whole and len(whole.group(1)) == column:
            out.append(f"{whole.group(1)}///< {plain(whole.group(2))}")
            continue
        column = -1
        if whole:
            indent, text = whole.groups()
            if first:
                out.append("/// \\file")
                first = False
            if text.startswith("  ") and not verbatim:
                out.append(f"{indent}/// \\verbatim")
                verbatim = True
            out.append(f"{indent}/// {text if verbatim else plain(text)}")
        elif behind and behind.group(1).lstrip()[0] not in "#}":
            column = len(behind.group(1)) + len(behind.group(2))
            out.append(f"{behind.group(1)}  ///< {plain(behind.group(3))}")
        else:
            out.append(line)
    return out


def c(text: str) -> str:
    def shown(match: re.Match[str]) -> str:
        before, inside = match.groups()
        behind = before.strip() != "" and not before.strip().startswith("#")
        begin = "/** \\file\n" if match.start() == 0 else "/**<" if behind else "/**"
        return f"{before}{begin}{plain(inside)}*/"

    return re.sub(r"^([^\n]*?)/\*(.*?)\*/", shown, text, flags=re.M | re.S)


def main() -> None:
    name = sys.argv[1]
    with open(name, encoding="utf-8") as file:
        text = file.read()
    text = PRIVATE.sub("", text)
    sys.stdout.write(c(text) if name.endswith(".h") else "\n".join(cpp(text.split("\n"))))


main()
