"""The programs that the docs quote."""

import importlib.util
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "python").glob("*.py"))
# Further packages that some of them need.
NEEDS = {"torch_tensors": "torch", "jax_arrays": "jax", "any_gpu": "wgpu"}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example(path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("webbrowser.open", lambda address: None)
    needed = NEEDS.get(path.stem)
    if needed and importlib.util.find_spec(needed) is None:
        pytest.skip(f"{needed} is not installed; {path.name} was not run")
    if needed == "wgpu":
        from throng.webgpu import GpuFinder

        try:
            GpuFinder()
        except RuntimeError as error:
            pytest.skip(f"{error}; {path.name} was not run")
    if needed:  # in a separate process: JAX starts threads, and a later test forks
        subprocess.run([sys.executable, str(path)], check=True, timeout=300)
        return
    runpy.run_path(str(path))
    if path.stem == "first_steps":
        assert sorted(capsys.readouterr().out.split("\n")) == ["", "0 touches 1", "1 touches 2"]
