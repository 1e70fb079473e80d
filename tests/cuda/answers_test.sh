#!/usr/bin/env bash
# `throng-bench gpu` compares its results with a file of expected answers: the CPU part, which needs no GPU.
# answers_test.sh PROGRAM ANSWERS.csv
set -euo pipefail
program="$1" kept="$2"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
cases=0

# expect STATUS WORDS ARGUMENT...: requires that exit status and the words in the output.
expect() {
  local wanted="$1" words="$2" status=0
  shift 2
  cases=$((cases + 1))
  "$program" gpu "$@" > "$folder/said" 2>&1 || status=$?
  if [ "$status" -ne "$wanted" ] || ! grep -qF -- "$words" "$folder/said"; then
    echo "status $status instead of $wanted, or without '$words': $*"
    cat "$folder/said"
    exit 1
  fi
}
by_cpu=(--part scaling --part stages --most 10000 --threads 1 --cpu-answers)

expect 0 '10000 boxes, frame 3' "${by_cpu[@]}" "$folder/a.csv"
[ "$(wc -l < "$folder/a.csv")" -eq 9 ]  # two sizes of four frames, and the header
expect 0 '8 answers compared with those expected, 0 differ' "${by_cpu[@]}" "$folder/b.csv" --expect "$folder/a.csv"
cmp "$folder/a.csv" "$folder/b.csv"
# The results at the time of writing.
expect 0 '8 answers compared with those expected, 0 differ' "${by_cpu[@]}" "$folder/b.csv" --expect "$kept"
expect 0 'worlds, 524288 boxes' --part scenes --least 500000 --most 600000 --cpu-answers "$folder/b.csv" --expect "$kept"

changed() {  # the sed command
  sed "$1" "$folder/a.csv" > "$folder/changed.csv"
  ! cmp -s "$folder/a.csv" "$folder/changed.csv"
}
changed '3s/,\([0-9]*\),\([0-9a-f]*\)$/,1\1,\2/'
expect 1 'DISAGREEMENT' "${by_cpu[@]}" "$folder/b.csv" --expect "$folder/changed.csv"
changed '3s/.$//; 3s/$/g/; 3s/g$/0/; 4s/[0-9a-f]\{4\}$/0000/'
expect 1 'DISAGREEMENT' "${by_cpu[@]}" "$folder/b.csv" --expect "$folder/changed.csv"
changed 's/uniform/another/'
expect 1 'no case is in the file of answers' "${by_cpu[@]}" "$folder/b.csv" --expect "$folder/changed.csv"
changed '5s/.$/x/'
expect 2 'line 5' "${by_cpu[@]}" "$folder/b.csv" --expect "$folder/changed.csv"
changed '1s/scene/boxes/'
expect 2 'first line' "${by_cpu[@]}" "$folder/b.csv" --expect "$folder/changed.csv"
expect 2 'absent.csv' "${by_cpu[@]}" "$folder/b.csv" --expect "$folder/absent.csv"
expect 2 'no part is called' --part nothing
expect 2 'absent.npy' --files "$folder/absent.npy" --cpu-answers "$folder/b.csv"

# Without a GPU it reports that; with one it measures and finds the same.
if "$program" gpu --device > /dev/null 2>&1; then
  expect 0 '4 answers compared with those expected, 0 differ' --part stages --part scaling --most 1000 \
    --budget 0.01 --csv "$folder/rows.csv" --expect "$folder/a.csv"
  grep -q ',gpu-scaling,"uniform, density 2",1000,unsorted,Throng,0,ms,.*,2093,b4b08056e8db5d6e,' "$folder/rows.csv"
else
  expect 2 'no GPU can be used' --part scaling --most 1000
fi
echo "throng-bench gpu: $cases calls"
