#!/usr/bin/env bash
# scripts/gpu_check with programs that only pretend: what it makes of their endings.
# gpu_check_test.sh scripts/gpu_check
set -euo pipefail
unset THRONG_DATA  # recorded scenes are given by an argument here
check="$1"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
bin="$folder/bin" out="$folder/out"
mkdir "$bin"
cases=0

# program NAME BODY
program() {
  printf '#!/usr/bin/env bash\n%s\n' "$2" > "$bin/$1"
  chmod +x "$bin/$1"
}
# shellcheck disable=SC2016  # for the programs to expand
sound_programs() {
  local test='case "$*" in *--gtest_list_tests*) echo "All/Suite."; echo "  Test/cuda_grid";; esac'
  local name
  rm -f "$bin"/*
  for name in conformance_test cuda_test guest_test lattice_test; do program "$name" "$test"; done
  program throng-bench-gpu '
while [ "$#" -gt 0 ]; do
  [ "$1" = --csv ] && printf "experiment,what\n%s,row\n" "${part:-files}" > "$2"
  [ "$1" = --part ] && part="$2"
  shift
done
echo "goal: 0.1 reached"'
  program throng 'exit 0'
  echo 'scene,objects,frame,pairs,checksum' > "$bin/answers.csv"
}
# expect STATUS WORDS ARGUMENT...
expect() {
  local wanted="$1" words="$2" status=0
  shift 2
  cases=$((cases + 1))
  "$check" --bin "$bin" --out "$out" "$@" > "$folder/said" 2>&1 || status=$?
  if [ "$status" -ne "$wanted" ] || ! grep -qF -- "$words" "$folder/said"; then
    echo "status $status instead of $wanted, or without '$words': $*"
    cat "$folder/said"
    exit 1
  fi
}
# Neither of these needs a GPU's tools.
steps=(conformance door guest check scaling scenes stages machine files paper)

sound_programs
expect 0 'all that must hold does' "${steps[@]}"
[ -s "$out/gpu_check.log" ]
[ "$(wc -l < "$out/bench.csv")" -eq 5 ]  # the columns once, a row a part
grep -q 'skipped: no throng-paper' "$out/gpu_check.log"
[ "$(find "$out" -type f | wc -l)" -le 8 ]

mkdir "$folder/data" && touch "$folder/data/boxes.npy"
expect 0 'bench files' --data "$folder/data" files
grep -q '^files,row' "$out/bench.csv"

program throng-bench-gpu 'echo "no GPU can be used"; exit 2'
expect 2 'no GPU to check' "${steps[@]}"
sound_programs
expect 2 "no step 'nothing'" nothing
# shellcheck disable=SC2016
for broken in conformance_test cuda_test lattice_test; do
  sound_programs
  program "$broken" 'case "$*" in *--gtest_list_tests*) echo "  Test/cuda_grid"; exit;; esac; echo "[  FAILED  ] one"; exit 1'
  expect 1 'FAILED: status 1' "${steps[@]}"
done
sound_programs
program throng 'exit 1'
expect 1 'throng check uniform' "${steps[@]}"
sound_programs
program throng-paper 'echo failed; exit 3'
expect 1 'FAILED: status 3' "${steps[@]}"
sound_programs
rm "$bin/lattice_test" "$bin/throng"
expect 0 'skipped: no lattice_test' "${steps[@]}"
sound_programs
program guest_test 'true'
expect 0 'skipped: no such tests' guest
echo "gpu_check: $cases runs"
