#!/usr/bin/env bash
# Runs scripts/gpu_check with fake programs and checks how it reports their exit statuses.
# gpu_check_test.sh scripts/gpu_check
set -euo pipefail
unset THRONG_DATA  # recorded scenes are given by an argument here
check="$1"
folder="$(mktemp -d)"
trap 'rm -rf "$folder"' EXIT
bin="$folder/bin" out="$folder/out"
mkdir "$folder/tools"
PATH="$folder/tools:$PATH"
cases=0

# program NAME BODY
program() {
  printf '#!/usr/bin/env bash\n%s\n' "$2" > "$bin/$1"
  chmod +x "$bin/$1"
}
# shellcheck disable=SC2016  # for the programs to expand
listing='case "$*" in *--gtest_list_tests*) echo "All/Suite."; echo "  Test/cuda_grid"; exit;; esac'
# shellcheck disable=SC2016
sound_programs() {
  local name
  rm -rf "$bin" "$out"
  mkdir "$bin"
  for name in conformance_test cuda_test lattice_test paper_test; do
    program "$name" "$listing; echo '[  PASSED  ] 3 tests.'"
  done
  program throng-bench '
if [ "$*" = "gpu --device" ]; then echo "NVIDIA H200 NVL: 132 multiprocessors"; exit; fi
while [ "$#" -gt 0 ]; do
  if [ "$1" = --csv ]; then printf "experiment,what\n%s,row\n" "${part:-files}" > "$2"; fi
  if [ "$1" = --part ]; then part="$2"; fi
  shift
done
echo "measured"'
  program throng 'exit 0'
  echo 'scene,objects,frame,pairs,checksum' > "$bin/answers.csv"
  echo 'abc1234-dirty' > "$bin/stamp"
}
# A fake compute-sanitizer that runs BODY, then its program.
tool() {
  printf '#!/usr/bin/env bash\n%s\n%s\n' "$1" 'while [[ "$1" == --* ]]; do case "$1" in --tool | --error-exitcode) shift;; esac; shift; done; exec "$@"' \
    > "$folder/tools/compute-sanitizer"
  chmod +x "$folder/tools/compute-sanitizer"
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
# None of these needs GPU tools.
steps=(conformance gpu-api lattices check scaling scenes stages bodies tracking queries meshes crossover device files paper-tests paper)
rows() { cat "$out"/h200-nvl/????-??-??-abc1234-dirty.csv; }

sound_programs
expect 0 'all required checks that ran passed' "${steps[@]}"
grep -q ', 26 of 28 checks ran' "$folder/said"
[ -s "$out/gpu_check.log" ]
[ "$(rows | wc -l)" -eq 9 ]  # the header once, one row per part
grep -q 'skipped: no throng-paper' "$folder/said"
[ "$(find "$out" -type f | wc -l)" -le 8 ]
# A single part appends to existing results; data next to the programs is used.
mkdir "$bin/data"
touch "$bin/data/boxes.npy"
expect 0 '1 of 1 checks ran' files
[ "$(rows | wc -l)" -eq 10 ]
[ "$(grep -c '^####' "$out/gpu_check.log")" -eq 2 ]

sound_programs
mkdir "$folder/data"
touch "$folder/data/boxes.npy"
expect 0 'bench files' --data "$folder/data" files
[ "$(rows | grep -c '^files,row')" -gt 0 ]

program throng-bench 'echo "no GPU can be used"; exit 2'
expect 2 'no GPU to check' "${steps[@]}"
sound_programs
expect 2 "no step 'nothing'" nothing
expect 2 'is not a number' --limit soon
for broken in conformance_test cuda_test lattice_test paper_test; do
  sound_programs
  program "$broken" "$listing; echo '[  FAILED  ] one'; exit 1"
  expect 1 'FAILED: status 1' "${steps[@]}"
  # A program that cannot be loaded, has no matching tests, skips all, or is missing counts as failed.
  program "$broken" 'echo "error while loading shared libraries" >&2; exit 127'
  expect 1 'FAILED: cannot be started' "${steps[@]}"
  program "$broken" 'true'
  expect 1 'FAILED: no such tests' "${steps[@]}"
  program "$broken" "$listing; echo '[  PASSED  ] 0 tests.'; echo '[  SKIPPED ] 3 tests.'"
  expect 1 'FAILED: every test was skipped' "${steps[@]}"
  rm "$bin/$broken"
  expect 1 "FAILED: there is no $broken" "${steps[@]}"
done
sound_programs
program throng 'exit 1'
expect 1 'throng check uniform' "${steps[@]}"
rm "$bin/throng"
expect 1 'FAILED: there is no throng' "${steps[@]}"
sound_programs
program throng-paper 'echo failed; exit 3'
expect 1 'FAILED: status 3' "${steps[@]}"

# One suite of the public API; and all of them in parallel, one process each.
sound_programs
expect 0 '1 of 1 checks ran' gpu-api/GpuPersistent
expect 2 "no step 'check/all'" check/all
tool ''
together() { "${check}_together" --bin "$bin" --out "$out" --limit 100 > "$folder/said" 2>&1; }
rm -rf "$out"
together || { cat "$folder/said"; exit 1; }
grep -q 'all required checks that ran passed' "$folder/said"
grep -q 'gpu-api: GpuFaults  *ok' "$folder/said"
grep -q 'racecheck cuda_test  *ok' "$folder/said"
[ "$(cat "$out"/*-abc1234-dirty.csv | wc -l)" -eq 8 ]
[ "$(find "$out" -type f | wc -l)" -le 8 ]
program lattice_test "$listing; echo '[  FAILED  ] one'; exit 1"
if together; then echo "a failure in a parallel run is not reported"; exit 1; fi
grep -q 'failed: 1-lattices' "$folder/said"
rm "$folder/tools/compute-sanitizer"
cases=$((cases + 2))

# Ranks, if MPI is present: here a fake mpirun that runs the program once.
sound_programs
printf '#!/usr/bin/env bash\nwhile [[ "$1" == -* ]]; do shift 2; done\nexec "$@"\n' > "$folder/tools/mpirun"
chmod +x "$folder/tools/mpirun"
expect 1 'skipped: no mpirun or mpi_test' ranks
program mpi_test "echo '[  PASSED  ] 3 tests.'"
expect 0 '1 of 1 checks ran' ranks
program mpi_test "echo '[  PASSED  ] 0 tests.'"
expect 1 'FAILED: every test was skipped' ranks
program mpi_test 'exit 1'
expect 1 'FAILED: status 1' ranks

# The sanitizer: one that passes, one that finds an error, one that does not support the device.
sound_programs
tool ''
expect 0 'racecheck cuda_test' memcheck racecheck synccheck
tool '[[ "$*" != *racecheck* ]] || exit 9'
expect 1 'FAILED: status 9' memcheck racecheck synccheck
tool 'echo "Device not supported"; exit 1'
expect 0 'skipped: it refuses this device' check memcheck racecheck
program cuda_test "$listing; echo '[  PASSED  ] 0 tests.'"
tool ''
expect 1 'FAILED: every test was skipped' memcheck

# On timeout or termination, partial results are reported.
sound_programs
expect 1 'nothing ran' --limit 0 check
program throng 'case "$1" in check) sleep 30;; esac'
expect 0 'skipped: over 3 s in all' --limit 3 conformance check device
grep -q 'conformance  *ok' "$folder/said"
grep -qE 'of 5 checks ran' "$folder/said"
program throng 'case "$1" in check) touch '"$folder"'/begun; sleep 30;; esac'
"$check" --bin "$bin" --out "$out" conformance check > "$folder/said" 2>&1 &
pid="$!" status=0
for _ in {1..100}; do [ -e "$folder/begun" ] || sleep 0.1; done
kill -TERM "$pid"
wait "$pid" || status=$?
[ "$status" -eq 1 ]
grep -q 'terminated by a signal' "$folder/said"
grep -q '1 of 1 checks ran' "$folder/said"
echo "gpu_check: $cases runs"
