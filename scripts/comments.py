"""The comments of source files and the text of pages, for scripts/check_words and scripts/check_references."""

import io
import pathlib
import re
import subprocess
import tokenize

ROOT = pathlib.Path(__file__).resolve().parent.parent

C_SUFFIXES = {".c", ".h", ".cpp", ".hpp", ".cu", ".cuh", ".rs", ".wgsl"}
HASH_SUFFIXES = {".cmake", ".sh", ".txt", ".toml", ".yml", ".yaml", ".in"}


def blank_strings(line):
    return re.sub(r'"(?:[^"\\]|\\.)*"', '""', line)


def c_comments(text):
    """(line, comment) of // and /* */ comments; strings are skipped."""
    token = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:[^"\\\n]|\\.)*"|\'(?:[^\'\\\n]|\\.)+\'', re.DOTALL)
    for match in token.finditer(text):
        if match.group().startswith(("//", "/*")):
            first = text.count("\n", 0, match.start()) + 1
            for offset, line in enumerate(match.group().split("\n")):
                yield first + offset, line


def hash_comments(text):
    for number, line in enumerate(text.splitlines(), 1):
        match = re.search(r"(?:^|\s)#(?!!)(.*)", blank_strings(line))
        if match:
            yield number, match.group(1)


def python_comments(text):
    """Comments and docstrings."""
    previous = tokenize.NEWLINE
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        is_docstring = token.type == tokenize.STRING and previous in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
        if token.type == tokenize.COMMENT or is_docstring:
            for offset, line in enumerate(token.string.split("\n")):
                yield token.start[0] + offset, line
        if token.type not in (tokenize.NL, tokenize.COMMENT):
            previous = token.type


def comments_of(path, text):
    """(line, comment) of a source file; none of a file of another kind."""
    if path.suffix in C_SUFFIXES:
        return list(c_comments(text))
    first_line = text.split("\n", 1)[0]
    if path.suffix in (".py", ".pyi") or (first_line.startswith("#!") and "python" in first_line):
        return list(python_comments(text))
    if path.suffix in HASH_SUFFIXES or (first_line.startswith("#!") and "sh" in first_line):
        return list(hash_comments(text))
    return []


def page_lines(text):
    """(line, text) of a page without its blocks of code."""
    in_code = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            in_code = not in_code
        elif not in_code:
            yield number, line


def prose_of(path):
    """(line, text) of a page or of a source file's comments; none of binary files."""
    try:
        text = path.read_text()
    except UnicodeDecodeError:
        return []
    return list(page_lines(text)) if path.suffix == ".md" else comments_of(path, text)


def git_files(*paths):
    """The files below `paths` that git tracks or does not ignore, relative to ROOT."""
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "--", *paths], cwd=ROOT, check=True,
                            capture_output=True, text=True).stdout.splitlines()
    return [name for name in listed if (ROOT / name).is_file()]
