#!/usr/bin/env bash
# The include check must accept a small valid tree, and reject it after each of these single changes.
set -euo pipefail
check="$1"
tree="$(mktemp -d)"
trap 'rm -rf "$tree"' EXIT
cases=0

sound_tree() {
  rm -rf "${tree:?}"/*
  mkdir -p "$tree"/include/throng "$tree"/src/core "$tree"/src/cpu "$tree"/program "$tree"/scene "$tree"/paper "$tree"/tests \
    "$tree"/adapters/bullet/throng "$tree"/simulate "$tree"/src/mpi "$tree"/src/cuda "$tree"/ranks
  echo '#include <cstddef>' > "$tree/include/throng/types.hpp"
  echo '#include <throng/types.hpp>' > "$tree/src/core/bounds.hpp"
  printf '#include <hwy/highway.h>\n#include "core/bounds.hpp"\n' > "$tree/src/cpu/grid.cpp"
  printf '#include <cstdio>\n#include "core/bounds.hpp"\nint n = snprintf(p, 1, "printf(");  // exit()\n' \
    > "$tree/src/find_pairs.cpp"
  echo '#include <throng/types.hpp>' > "$tree/scene/npy.hpp"
  printf '#include <string>\n#include <sys/wait.h>\n#include <fmt/format.h>\n#include <throng/types.hpp>\n' > "$tree/program/child.hpp"
  printf '#include "core/bounds.hpp"\n#include "program/child.hpp"\n#include "scene/npy.hpp"\n' > "$tree/paper/search.hpp"
  printf '#include <cuda_runtime.h>\n#include <cub/cub.cuh>\n#include "paper/search.hpp"\n' > "$tree/paper/cuda.cu"
  printf '#include <BulletCollision/x.h>\n#include <throng/types.hpp>\n' > "$tree/adapters/bullet/throng/bullet.hpp"
  printf '#include <btBulletDynamicsCommon.h>\n#include <throng/bullet.hpp>\n' > "$tree/simulate/world.hpp"
  printf '#include <mpi.h>\n#include <throng/types.hpp>\n' > "$tree/src/mpi/link.hpp"
  echo '#include <cub/cub.cuh>' > "$tree/src/cuda/device.cuh"
  printf '#include <cuda_runtime_api.h>\n#include "cuda/device.cuh"\n#include "core/bounds.hpp"\n' > "$tree/src/mpi/gpu.cu"
  printf '#include <mpi.h>\n#include "mpi/communicator.hpp"\n' > "$tree/ranks/main.cpp"
  echo '#include "core/bounds.hpp"' > "$tree/tests/bounds_test.cpp"
}

refused() {  # file, added line, expected message
  sound_tree
  echo "$2" >> "$tree/$1"
  cases=$((cases + 1))
  if "$check" "$tree" > "$tree/said" 2>&1; then
    echo "not refused: $1: $2"
    exit 1
  fi
  if ! grep -qF "$3" "$tree/said"; then
    echo "refused without saying '$3': $1: $2"
    cat "$tree/said"
    exit 1
  fi
}

sound_tree
"$check" "$tree"
refused include/throng/types.hpp '#include <hwy/highway.h>' 'public_api includes the standard library only'
refused include/throng/types.hpp '#include "core/bounds.hpp"' 'public_api must not include core'
refused include/throng/types.hpp '#include <iostream>' 'prints nothing'
refused src/core/bounds.hpp '#include "cpu/grid.cpp"' 'core must not include cpu'
refused src/core/bounds.hpp '#include <unistd.h>' 'core includes the standard library only'
refused src/cpu/grid.cpp '#include "scene/npy.hpp"' 'cpu must not include scene'
refused src/cpu/grid.cpp '#include <sys/mman.h>' 'cpu includes the standard library'
refused src/cpu/grid.cpp '#include "core/absent.hpp"' 'no such file'
refused src/cpu/grid.cpp 'void f() { std::abort(); }' 'never prints, exits or aborts'
refused src/find_pairs.cpp 'void f() { printf("x"); }' 'never prints, exits or aborts'
refused src/find_pairs.cpp 'void f() { std::cerr << 1; }' 'never prints, exits or aborts'
refused scene/npy.hpp '#include "core/bounds.hpp"' 'scene must not include core'
refused scene/npy.hpp '#include "tests/bounds_test.cpp"' 'scene must not include tests'
refused scene/npy.hpp '#include <CGAL/box_intersection_d.h>' 'only bench may include a competitor'
refused src/cpu/grid.cpp '#include <cuda_runtime_api.h>' 'see CUDA'
refused scene/npy.hpp '#include <mpi.h>' 'see MPI'
refused src/mpi/communicator.hpp '#include "cpu/grid.cpp"' 'mpi must not include cpu'
refused src/mpi/communicator.hpp '#include "cuda/device.cuh"' 'only a .cu file of mpi may include cuda'
refused src/mpi/communicator.hpp '#include <cuda_runtime_api.h>' 'see CUDA'
refused src/mpi/communicator.hpp '#include <unistd.h>' 'mpi includes the standard library only'
refused scene/npy.hpp '#include <cub/device/device_scan.cuh>' 'see CUDA'
refused program/child.hpp '#include "core/bounds.hpp"' 'program must not include core'
refused program/child.hpp '#include <CLI/CLI.hpp>' 'program includes the public API, the standard library, the operating system and fmt only'
refused scene/npy.hpp '#include "program/child.hpp"' 'scene must not include program'
refused scene/npy.hpp '#include "paper/search.hpp"' 'scene must not include paper'
refused src/find_pairs.cpp '#include "paper/search.hpp"' 'api must not include paper'
refused paper/search.hpp '#include "cpu/grid.cpp"' 'paper must not include cpu'
refused paper/search.hpp '#include <cuda_runtime.h>' 'only a .cu file of paper may include CUDA'
refused paper/search.hpp '#include <cub/cub.cuh>' 'only a .cu file of paper may include CUDA'
refused scene/npy.hpp '#include <fcl/broadphase/x.h>' 'see an engine'
refused tests/bounds_test.cpp '#include <LinearMath/btVector3.h>' 'see an engine'
refused simulate/world.hpp '#include <embree3/rtcore.h>' 'only bench may include a competitor'
refused scene/npy.hpp '#include <throng/bullet.hpp>' 'scene must not include adapters'
refused adapters/bullet/throng/bullet.hpp '#include "core/bounds.hpp"' 'adapters must not include core'
refused adapters/bullet/throng/bullet.hpp '#include "simulate/world.hpp"' 'adapters must not include simulate'
echo "check_includes: $cases forbidden lines refused"
