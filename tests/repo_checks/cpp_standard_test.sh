#!/usr/bin/env bash
# Every public C++ header, compiled for an older standard, gives a single error that names C++17, and for
# C++17 none. throng.h is C, and compiles with any standard.
# Usage: cpp_standard_test.sh SOURCE_DIR COMPILER
set -euo pipefail
cd "$1"
compiler="$2"
workdir="$(mktemp -d)"
trap 'rm -rf "$workdir"' EXIT
count=0
for header in include/throng/*.hpp; do
  name="${header##*/}"
  echo "#include <throng/$name>" > "$workdir/it.cpp"
  for standard in c++98 c++11 c++14; do
    if "$compiler" "-std=$standard" -fsyntax-only -Iinclude "$workdir/it.cpp" > "$workdir/log" 2>&1; then
      echo "$name compiles as $standard; include throng/cpp17.hpp first"
      exit 1
    fi
    # The #error, and the failed include that stops the compilation.
    named="$(grep -c "error:.*Throng's headers need C++17" "$workdir/log" || true)"
    all="$(grep -c 'error:' "$workdir/log" || true)"
    if [ "$named" -ne 1 ] || [ "$all" -ne 2 ]; then
      echo "$name as $standard makes $all errors, $named of which name C++17; wanted 2 and 1:"
      cat "$workdir/log"
      exit 1
    fi
    count=$((count + 1))
  done
done
for standard in c++98 c++17; do
  echo '#include <throng/throng.h>' > "$workdir/it.cpp"
  "$compiler" "-std=$standard" -fsyntax-only -Iinclude "$workdir/it.cpp"
done
[ "$count" -gt 0 ]
echo "$count compilations refused by one line"
