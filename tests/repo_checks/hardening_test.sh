#!/usr/bin/env bash
# scripts/check_hardening must accept a program compiled like the packages, and report each missing protection
# of one that was not.
set -euo pipefail
check="$1" hard="$2" soft="$3"
"$check" "$hard"
if said="$("$check" "$soft")"; then
  echo "a program without hardening was accepted"
  exit 1
fi
for fault in 'no stack protection' 'fixed address' 'stay writable' 'bound late' 'is executable'; do
  grep -q "$fault" <<< "$said" || { echo "not reported: $fault"; echo "$said"; exit 1; }
done
if "$check" "$hard.missing" > /dev/null; then echo "a missing file was accepted"; exit 1; fi
