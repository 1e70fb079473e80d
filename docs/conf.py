# The site: the pages of this folder, and the reference that Doxygen and autodoc generate from headers
# and docstrings. scripts/docs builds it, with warnings as errors.
import pathlib
import re
import sys

root = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(root / "python"))

project = "Throng"
author = "the authors of Throng"
copyright = "the authors of Throng, MIT license"
release = version = re.search(
    r'THRONG_VERSION "([^"]+)"', (root / "include/throng/version.hpp").read_text()
).group(1)

extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"Throng {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]

# The pages are GitHub Markdown: links use the slugs of headings, and relative paths.
myst_heading_anchors = 4
myst_links_external_new_tab = False
suppress_warnings = ["myst.header"]

breathe_projects = {"throng": str(root / "build/docs/doxygen/xml")}
breathe_default_project = "throng"
breathe_default_members = ("members",)
breathe_domain_by_extension = {"h": "c", "hpp": "cpp"}
cpp_id_attributes = ["THRONG_API"]
c_id_attributes = ["THRONG_API"]

# The docstrings are in Python files, so the extension module is not needed.
autodoc_mock_imports = ["throng._throng", "ipctk"]
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {"BoxesLike": "BoxesLike", "Array": "Array"}


def plain_docstring(app, what, name, obj, options, lines):
    """Docstrings are plain text: paragraphs, and `name: description` with indented lines below."""
    out = []
    for line in lines:
        term = re.match(r"^([a-z_]+(?:, [a-z_]+)*): (.*)$", line)
        if term and what in ("function", "method", "class"):
            out += ["", f"**{term.group(1)}**: {term.group(2)}"]
        else:
            out.append(line.lstrip() if out and out[-1] and line.startswith("    ") else line)
    out = [re.sub(r"\(\*(\w)", r"(\\*\1", line) for line in out]  # f(*args) is not emphasis
    # Words in quotes are code; a name that ends in _ is not a link.
    out = [re.sub(r"(?<!`)`([^`]+)`(?!`)", r"``\1``", line) for line in out]
    lines[:] = [re.sub(r"(\w)_(?!\w)", r"\1\\_", line) for line in out]


def setup(app):
    app.connect("autodoc-process-docstring", plain_docstring)
