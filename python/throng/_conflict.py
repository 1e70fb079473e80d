"""The project `throng` on PyPI is another one, and installs files of the same names as ours."""

import os
import sys
import warnings


def other_project(folders: list[str]) -> str | None:
    """The path of its metadata, if it is installed in one of these folders."""
    for folder in folders:
        try:
            names = os.listdir(folder or ".")
        except OSError:
            continue
        for name in names:
            if name.startswith("throng-") and name.endswith((".dist-info", ".egg-info")):
                return os.path.join(folder, name)
    return None


def warn_of_other_project() -> None:
    found = other_project(sys.path)
    if found is None:
        return
    warnings.warn(
        f"the distribution 'throng' is installed ({found}): another project with the same import name "
        "as 'throng-collision', or an older version of ours. Files of one may have replaced those of the other; "
        "pip uninstall throng throng-collision, then pip install throng-collision",
        RuntimeWarning,
        stacklevel=3,
    )
