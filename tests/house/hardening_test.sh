#!/usr/bin/env bash
# scripts/check_hardening takes a program that was compiled as packages are, and refuses one that was
# not, for each thing that it lacks.
set -euo pipefail
check="$1" hard="$2" soft="$3"
"$check" "$hard"
if said="$("$check" "$soft")"; then
  echo "a program without any hardening was taken"
  exit 1
fi
for fault in 'guards its stack' 'fixed address' 'stay writable' 'bound late' 'can be executed'; do
  grep -q "$fault" <<< "$said" || { echo "not told: $fault"; echo "$said"; exit 1; }
done
if "$check" "$hard.missing" > /dev/null; then echo "a file that is not there was taken"; exit 1; fi
