"""The programs that the papers quote."""

import runpy
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "python").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(path))
    if path.stem == "first_steps":
        assert sorted(capsys.readouterr().out.split("\n")) == ["", "0 touches 1", "1 touches 2"]
