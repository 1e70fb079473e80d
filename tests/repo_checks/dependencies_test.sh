#!/usr/bin/env bash
# docs/reference/dependencies.md lists every package that the scripts install.
set -euo pipefail
root="$1" page="$1/docs/reference/dependencies.md"
# shellcheck source=/dev/null disable=SC2154
source "$root/scripts/common.sh"
missing=0
# shellcheck disable=SC2154
for package in "${check_packages[@]}" "${competitor_packages[@]}"; do
  grep -qF "\`$package\`" "$page" || { echo "docs/reference/dependencies.md does not name $package"; missing=1; }
done
[ "${#check_packages[@]}" -gt 10 ]
[ "$missing" -eq 0 ]
