#!/usr/bin/env bash
# scripts/results_tables must pass the tree as it is, refuse changed figures, and renew them.
# results_tables_test.sh TREE
set -euo pipefail
tree="$1"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
script="$tree/scripts/results_tables"
results=bench/results
page=docs/explanation/benchmarks.md

copy() {
  rm -rf "$folder/tree"
  mkdir -p "$folder/tree/$results" "$folder/tree/docs/explanation" "$folder/tree/docs/pictures"
  cp -r "$tree/$results/." "$folder/tree/$results/"
  cp "$tree/$page" "$folder/tree/$page"
  cp "$tree/docs/pictures/speed.svg" "$folder/tree/docs/pictures/"
  printf '# Readme\n\n<!-- table: gpu-sizes -->\n<!-- /table -->\n' > "$folder/tree/README.md"
  "$script" --write "$folder/tree" > /dev/null
}
refused() {  # what changes, the message, the sed command, the file
  copy
  cp "$folder/tree/$4" "$folder/before"
  sed -i "$3" "$folder/tree/$4"
  if cmp -s "$folder/before" "$folder/tree/$4"; then
    echo "nothing changed: $1"
    exit 1
  fi
  if "$script" --check "$folder/tree" > "$folder/output" 2>&1 || ! grep -qF -- "$2" "$folder/output"; then
    echo "not refused, or without '$2': $1"
    cat "$folder/output"
    exit 1
  fi
}

"$script" --check "$tree"
copy
cmp "$tree/$page" "$folder/tree/$page"
cmp "$tree/docs/pictures/speed.svg" "$folder/tree/docs/pictures/speed.svg"
grep -q '^| 100M | 12.4 |' "$folder/tree/README.md"
"$script" --check "$folder/tree"
wrong='does not match the result files'
refused "a figure of a page" "$page: $wrong" 's/^| 100M | 12.4 /| 100M | 11.4 /' "$page"
refused "a figure of the README" "README.md: $wrong" 's/^| 100M | 12.4 /| 100M | 11.4 /' README.md
refused "a measured value" "$page: $wrong" '/gpu-scaling.*,100000000,unsorted,.*,ms,/s/12\.4207/13.4207/' "$results/h200/gpu.csv"
refused "a missing row" "$page: $wrong" '/^| 100M /d' "$page"
refused "a bar of the chart" "docs/pictures/speed.svg: $wrong" 's/<rect class="own" x="72"/<rect class="own" x="73"/' docs/pictures/speed.svg
refused "an unknown table" "no table is called 'gpu-weights'" 's/table: gpu-sizes/table: gpu-weights/' README.md
refused "an unknown machine" 'no file' 's/table: filters epyc/table: filters ryzen/' "$page"
refused "a table without an end" 'no begin or no end' '$d' README.md
# --write renews what --check refuses.
sed -i 's/^| 100M | 12.4 /| 100M | 11.4 /' "$folder/tree/$page"
printf '<!-- /table -->\n' >> "$folder/tree/README.md"
"$script" --write "$folder/tree" > /dev/null
"$script" --check "$folder/tree"
cmp "$tree/$page" "$folder/tree/$page"
# A new file of meshes appears without a change of the page.
copy
mkdir -p "$folder/tree/$results/new-machine"
row() { printf 'new-machine,2026-01-02,abc,mesh,knot,%s,self,%s,%s,%s,%s,,3,44,,\n' "$@"; }
{
  head -n 1 "$tree/$results/epyc-zen3-2core/search.csv"
  row 1000 'Throng MeshFinder' 1 search_ms 0.5
  row 1000 'Throng MeshFinder' 2 search_ms 0.25
  row 1000 'Throng MeshFinder' 1 candidates_count 2000
  row 1000 'Throng MeshFinder' 1 exact_tests_count 3
  row 1000 'Throng MeshFinder' 1 held_bytes 60000
  row 1000 'CGAL self_intersections' 1 search_ms 5
  row 1000 '"CGAL self_intersections, parallel"' 2 search_ms 2
} > "$folder/tree/$results/new-machine/mesh.csv"
if "$script" --check "$folder/tree" > /dev/null; then
  echo "a new file of meshes was not noticed"
  exit 1
fi
"$script" --write "$folder/tree" > /dev/null
grep -qF '| knot, 1K | 44 | 0.5 | 0.25 | 5 | 2 | - | 8.0x | 60 | 0.15 % |' "$folder/tree/$page"
echo "results_tables: passed"
