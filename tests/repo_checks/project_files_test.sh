#!/usr/bin/env bash
# project_files_test.py must pass the repository, and fail after each of these single changes.
set -euo pipefail
test="$1" root="$2"
tree="$(mktemp -d)"
trap 'rm -rf "$tree"' EXIT
python3 "$test" "$root"
python3 -c 'import yaml' 2> /dev/null || exit 0

sound_tree() {
  rm -rf "$tree/root"
  mkdir -p "$tree/root/scripts"
  tar -C "$root" -cf - .github .pre-commit-config.yaml .devcontainer .editorconfig scripts | tar -xf - -C "$tree/root"
}
refused() {  # file, sed expression, what the message must say
  sound_tree
  sed -i "$2" "$tree/root/$1"
  if python3 "$test" "$tree/root" > "$tree/said" 2>&1; then echo "not refused: $1: $2"; exit 1; fi
  grep -qE "$3" "$tree/said" || { echo "refused without saying '$3': $1: $2"; cat "$tree/said"; exit 1; }
}
refused .github/workflows/test.yml 's|scripts/test|scripts/absent|' 'there is no scripts/absent'
refused .github/workflows/docs.yml 's|  docs:|  docs: [|' 'yaml|expected'
refused .github/workflows/docs.yml '/timeout-minutes/d' 'lacks runs-on, timeout-minutes'
refused .github/ISSUE_TEMPLATE/bug.yml 's|id: capture|id: other|' 'does not require a capture file'
refused .pre-commit-config.yaml 's|scripts/check_words|scripts/absent|' 'there is no scripts/absent'
refused .devcontainer/devcontainer.json 's|"name"|name|' 'JSON|Expecting'
refused .editorconfig 's|indent_size = 2|indent_size = 3|' 'no indent_size of 2'
echo "project_files: broken files are refused"
