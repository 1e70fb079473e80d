#!/usr/bin/env python3
"""Parses .github, .pre-commit-config.yaml, .devcontainer and .editorconfig, and checks that the scripts they run exist.

    project_files_test.py ROOT
"""

import configparser
import json
import pathlib
import re
import sys

try:
    import yaml
except ImportError:
    print("skipped: python3 has no yaml module (package python3-yaml)")
    sys.exit(0)

SCRIPT = re.compile(r"(?:^|[\s;&|])(scripts/\w+)")


def scripts_of(node):
    """The scripts that `run` and `entry` values start."""
    if isinstance(node, dict):
        for key, value in node.items():
            if key in ("run", "entry", "postCreateCommand") and isinstance(value, str):
                yield from SCRIPT.findall(value)
            else:
                yield from scripts_of(value)
    elif isinstance(node, list):
        for value in node:
            yield from scripts_of(value)


def check(root):
    """Faults of the files under `root`."""
    faults = []
    scripts = []
    workflows = sorted((root / ".github/workflows").glob("*.yml"))
    for path in workflows:
        workflow = yaml.safe_load(path.read_text())
        # YAML 1.1 reads the key `on` as true.
        if not ({True, "on"} & workflow.keys()) or not workflow.get("jobs"):
            faults.append(f"{path}: no trigger or no job")
            continue
        for name, job in workflow["jobs"].items():
            if "runs-on" not in job or "timeout-minutes" not in job or not job.get("steps"):
                faults.append(f"{path}: job {name} lacks runs-on, timeout-minutes or steps")
        scripts += [(path, script) for script in scripts_of(workflow)]
    forms = [path for path in sorted((root / ".github/ISSUE_TEMPLATE").glob("*.yml")) if path.name != "config.yml"]
    for path in forms:
        form = yaml.safe_load(path.read_text())
        fields = {field.get("id"): field for field in form.get("body", [])}
        if not form.get("name") or not form.get("description"):
            faults.append(f"{path}: no name or description")
        if not fields.get("capture", {}).get("validations", {}).get("required"):
            faults.append(f"{path}: does not require a capture file")
    yaml.safe_load((root / ".github/ISSUE_TEMPLATE/config.yml").read_text())
    pre_commit = root / ".pre-commit-config.yaml"
    scripts += [(pre_commit, script) for script in scripts_of(yaml.safe_load(pre_commit.read_text()))]
    container = root / ".devcontainer/devcontainer.json"
    scripts += [(container, script) for script in scripts_of(json.loads(container.read_text()))]
    editor = configparser.ConfigParser()
    editor.read_string("[global]\n" + (root / ".editorconfig").read_text())
    if editor.get("*", "indent_size", fallback="") != "2":
        faults.append(f"{root / '.editorconfig'}: no indent_size of 2 for all files")
    faults += [f"{path}: there is no {script}" for path, script in scripts if not (root / script).is_file()]
    if len(workflows) < 3 or len(forms) < 2 or len(scripts) < 8:
        faults.append(f"{root}: {len(workflows)} workflows, {len(forms)} issue forms, {len(scripts)} scripts were found")
    return faults, len(workflows) + len(forms) + 4


def main():
    faults, files = check(pathlib.Path(sys.argv[1]))
    print("\n".join(faults) or f"project_files: {files} files parsed")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
