#!/usr/bin/env bash
# check_words must count private words in comments, docstrings and docs, and none in code, strings and code blocks.
set -euo pipefail
root="$1"
command -v git > /dev/null || { echo "skipped: git is not here"; exit 0; }
tree="$(mktemp -d)"
trap 'rm -rf "$tree"' EXIT
mkdir -p "$tree/scripts"
cp "$root/scripts/check_words" "$root/scripts/comments.py" "$root/scripts/private_words.txt" "$tree/scripts/"
git -C "$tree" init -q
plain="$(printf 'word %.0s' {1..6000})"

# counted EXPECTED FILE: the file's content comes from stdin.
counted() {
  rm -f "$tree"/page.md "$tree"/code.cpp "$tree"/code.py "$tree"/script.sh
  printf '%s\n' "$plain" > "$tree/page.md"
  cat > "$tree/$2"
  "$tree/scripts/check_words" "$2" > "$tree/said" || true
  grep -q "check_words: $1 private words" "$tree/said" || { echo "not $1 in $2:"; cat "$tree/said"; exit 1; }
}
counted 2 code.cpp <<< $'int asked = 1;  // it tells whoever\nconst char* s = "asked // told";\n'
counted 1 code.cpp <<< $'/* a\n   yardstick */ int twin;\n'
counted 2 code.py <<< $'def f(asked):\n    """Tells it."""\n    x = "told"  # asked\n'
counted 1 script.sh <<< $'#!/bin/sh\necho asked # mended\n'
counted 1 page.md <<< $'It is told.\n\n```\nasked\n```\n`asked`\n'
# Above the limit the whole check fails, below it passes.
printf '%s\n' "$plain" > "$tree/page.md"
rm -f "$tree/code.cpp" "$tree/code.py" "$tree/script.sh"
"$tree/scripts/check_words" > "$tree/said"
echo 'It is told, and asked.' >> "$tree/page.md"
if "$tree/scripts/check_words" > "$tree/said"; then echo "two in six thousand passed"; exit 1; fi
echo "check_words: words are counted where they should be"
