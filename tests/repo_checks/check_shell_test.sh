#!/usr/bin/env bash
# The shell script check must accept these lines, and reject those.
set -euo pipefail
check="$1"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
tree="$folder/tree"
mkdir "$tree"
lines=0

taken() {
  printf '%s\n' "$1" > "$tree/script"
  "$check" "$tree" > "$folder/said" || { echo "not taken: $1"; cat "$folder/said"; exit 1; }
  lines=$((lines + 1))
}
refused() {
  printf '%s\n' "$1" > "$tree/script"
  if "$check" "$tree" > /dev/null; then
    echo "not refused: $1"
    exit 1
  fi
  lines=$((lines + 1))
}

# shellcheck disable=SC2016
{
  taken 'if [ a ] && [ b ]; then echo both; fi'
  taken 'while [ a ] && [ b ]; do break; done'
  taken '[[ a && b ]]'
  taken '{ have one && have two; } || skip "one is not here"'
  taken 'here="$(cd "$here" && pwd)"'
  taken "grep -q 'a && b' file  # c && d"
  refused '[ "$sections" -ge 15 ] && [ "$links" -eq 3 ] && grep -q svg page'
  refused '  first && second'
  refused $'first &&\n  second'
  refused 'if first; then second && third; fi'
  refused 'first || { second && third; }'
}
echo "check_shell: $lines lines"
