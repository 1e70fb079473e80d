#!/usr/bin/env bash
# check_references must accept names of existing files in comments and pages, and refuse each of these others.
set -euo pipefail
root="$1"
command -v git > /dev/null || { echo "skipped: git is not here"; exit 0; }
tree="$(mktemp -d)"
trap 'rm -rf "$tree"' EXIT
mkdir -p "$tree"/{scripts,src/base,tests/base,docs}
cp "$root/scripts/check_references" "$root/scripts/comments.py" "$tree/scripts/"
touch "$tree/CHANGELOG.md"
git -C "$tree" init -q
lines=0

sound_tree() {
  printf '// See bounds.hpp, base/bounds.hpp and tests/base/bounds_test.cpp; windows.h.\n' > "$tree/src/base/bounds.hpp"
  printf '// Tests bounds.hpp.\nconst char* s = "none.cpp";  // https://a.b/none.cpp\n' > "$tree/tests/base/bounds_test.cpp"
  printf '[bounds](../src/base/bounds.hpp), `bounds_test.cpp`.\n\n```\nc++ none.cpp\n```\n' > "$tree/docs/page.md"
  printf '#!/bin/sh\n# Reads page.md and *.cpp.\n' > "$tree/scripts/run"
}
refused() {  # file, added line, name
  sound_tree
  printf '%s\n' "$2" >> "$tree/$1"
  lines=$((lines + 1))
  if "$tree/scripts/check_references" > "$tree/said"; then echo "not refused: $1: $2"; exit 1; fi
  grep -qx "$1:[0-9]*: no such file: $3" "$tree/said" || { echo "$3 is not reported:"; cat "$tree/said"; exit 1; }
}

sound_tree
"$tree/scripts/check_references" > "$tree/said" || { cat "$tree/said"; exit 1; }
grep -q ' 0 of them' "$tree/said"
refused src/base/bounds.hpp '// See box.hpp.' box.hpp
refused src/base/bounds.hpp '// See grid/bounds.hpp.' grid/bounds.hpp
refused src/base/bounds.hpp '// See bounds_test.cpp.' bounds_test.cpp  # of another part
refused tests/base/bounds_test.cpp '/* docs/none.md */' docs/none.md
refused docs/page.md 'It is in box.hpp.' box.hpp
refused docs/page.md '`src/base/box.hpp`' src/base/box.hpp
refused docs/page.md '[there](none.md)' none.md
refused scripts/run '# as none.sh does' none.sh
rm "$tree/src/base/bounds.hpp"
if "$tree/scripts/check_references" > "$tree/said"; then echo "a removed file is not missed"; exit 1; fi
echo "check_references: $lines names refused"
