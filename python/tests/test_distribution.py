"""The name of the distribution, and the other project that has the same import name."""

import importlib.metadata
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from throng import _conflict


def test_the_other_project_is_noticed(tmp_path: Path) -> None:
    both, ours = tmp_path / "both", tmp_path / "ours"
    for folder in (both, ours):
        (folder / "throng_collision-0.1.0.dist-info").mkdir(parents=True)
    missing = str(tmp_path / "missing")
    assert _conflict.other_project([missing, str(ours)]) is None
    (both / "throng-0.0.10.dist-info").mkdir()
    found = _conflict.other_project([missing, str(ours), str(both)])
    assert found == str(both / "throng-0.0.10.dist-info")


@pytest.mark.parametrize("there", [False, True])
def test_the_import_warns(tmp_path: Path, there: bool) -> None:
    if there:
        (tmp_path / "throng-0.0.10.dist-info").mkdir()
    code = f"import sys; sys.path.append({str(tmp_path)!r}); import throng"
    command = [sys.executable, "-W", "error::RuntimeWarning", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert (done.returncode != 0) == there, done.stderr
    if there:
        for text in ("throng-0.0.10.dist-info", "pip uninstall throng throng-collision"):
            assert text in done.stderr


def test_the_installed_distribution() -> None:
    try:
        there = importlib.metadata.distribution("throng-collision")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("throng-collision is not installed here")
    assert there.version == __import__("throng").__version__
    assert "numpy" in str(there.requires)


def test_a_wheel_of_the_other_project(tmp_path: Path) -> None:
    """A wheel with its layout, installed over this package by pip, is noticed where ours comes last."""
    wheel = tmp_path / "throng-0.0.1-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as file:
        file.writestr("throng/errors.py", "")
        file.writestr("throng-0.0.1.dist-info/METADATA", "Metadata-Version: 2.1\nName: throng\nVersion: 0.0.1\n")
        file.writestr("throng-0.0.1.dist-info/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        file.writestr("throng-0.0.1.dist-info/RECORD", "throng/errors.py,,\n")
    command = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-index", "--target", str(tmp_path / "site"), str(wheel)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    if "No module named pip" in done.stderr:
        pytest.skip("no pip here")
    assert done.returncode == 0, done.stderr
    assert _conflict.other_project([str(tmp_path / "site")]) is not None
