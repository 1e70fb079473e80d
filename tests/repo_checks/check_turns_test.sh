#!/usr/bin/env bash
# Every step of scripts/check runs in some turn: all turns together run the steps of --all, every turn runs
# the light ones, and CONTRIBUTING.md describes each step.
set -euo pipefail
check="$1" page="$2"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT

"$check" --list --all | sort > "$folder/all"
# More turns than exist.
for turn in {0..30}; do
  THRONG_TURN="$turn" "$check" --list | sort > "$folder/turn"
  cat "$folder/turn" >> "$folder/turns"
  [ -z "$(uniq -d "$folder/turn")" ] || { echo "turn $turn has a step twice"; exit 1; }
  if cmp -s "$folder/turn" "$folder/all"; then echo "turn $turn has all steps"; exit 1; fi
  [ "$turn" -gt 0 ] || cp "$folder/turn" "$folder/light"
  comm -12 "$folder/light" "$folder/turn" > "$folder/both"
  mv "$folder/both" "$folder/light"
done
sort -u "$folder/turns" | diff "$folder/all" - || { echo "turns and --all differ"; exit 1; }
[ "$(wc -l < "$folder/light")" -gt 5 ]
while read -r step; do
  kind=heavy
  if grep -qx "$step" "$folder/light"; then kind=light; fi
  grep -q "^| \`$step\` | $kind | " "$page" || { echo "${page##*/} has no line of the $kind step $step"; exit 1; }
done < "$folder/all"
[ "$("$check" --list asan format)" = $'asan\nformat' ]
if "$check" --list none > "$folder/said" 2>&1; then echo "an unknown step was accepted"; exit 1; fi
grep -q "no step 'none'" "$folder/said"
echo "check_turns: $(wc -l < "$folder/all") steps, $(wc -l < "$folder/light") of them in every turn"
