#!/usr/bin/env bash
# The include check must accept a small valid tree, and reject it after each of these single changes.
set -euo pipefail
check="$1"
tree="$(mktemp -d)"
trap 'rm -rf "$tree"' EXIT
cases=0

sound_tree() {
  rm -rf "${tree:?}"/*
  mkdir -p "$tree"/include/throng "$tree"/src/{api,base,grid/bin,mpi,cuda} "$tree"/apps/{common,scenes,paper,simulate,mpi} \
    "$tree"/tests "$tree"/adapters/bullet/throng
  echo '#include <cstddef>' > "$tree/include/throng/types.hpp"
  echo '#include <throng/types.hpp>' > "$tree/src/base/bounds.hpp"
  printf '#include <hwy/highway.h>\n#include "base/bounds.hpp"\n' > "$tree/src/grid/bin/grid.cpp"
  printf '#include <cstdio>\n#include "base/bounds.hpp"\nint n = snprintf(p, 1, "printf(");  // exit()\n' \
    > "$tree/src/api/find_pairs.cpp"
  echo '#include <throng/types.hpp>' > "$tree/apps/scenes/npy.hpp"
  printf '#include <string>\n#include <sys/wait.h>\n#include <fmt/format.h>\n#include <throng/types.hpp>\n' > "$tree/apps/common/child.hpp"
  printf '#include "base/bounds.hpp"\n#include "apps/common/child.hpp"\n#include "apps/scenes/npy.hpp"\n' > "$tree/apps/paper/search.hpp"
  printf '#include <cuda_runtime.h>\n#include <cub/cub.cuh>\n#include "apps/paper/search.hpp"\n' > "$tree/apps/paper/cuda.cu"
  printf '#include <BulletCollision/x.h>\n#include <throng/types.hpp>\n' > "$tree/adapters/bullet/throng/bullet.hpp"
  printf '#include <btBulletDynamicsCommon.h>\n#include <throng/bullet.hpp>\n' > "$tree/apps/simulate/world.hpp"
  printf '#include <mpi.h>\n#include <throng/types.hpp>\n' > "$tree/src/mpi/communicator.hpp"
  echo '#include <cub/cub.cuh>' > "$tree/src/cuda/device.cuh"
  printf '#include <cuda_runtime_api.h>\n#include "cuda/device.cuh"\n#include "base/bounds.hpp"\n' > "$tree/src/mpi/gpu.cu"
  printf '#include <mpi.h>\n#include "mpi/communicator.hpp"\n' > "$tree/apps/mpi/main.cpp"
  echo '#include "base/bounds.hpp"' > "$tree/tests/bounds_test.cpp"
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
refused include/throng/types.hpp '#include <hwy/highway.h>' 'public includes the standard library only'
refused include/throng/types.hpp '#include "base/bounds.hpp"' 'public must not include base'
refused include/throng/types.hpp '#include <iostream>' 'prints nothing'
refused src/base/bounds.hpp '#include "grid/bin/grid.cpp"' 'base must not include grid'
refused src/base/bounds.hpp '#include <unistd.h>' 'base includes the standard library'
refused src/grid/bin/grid.cpp '#include "apps/scenes/npy.hpp"' 'grid must not include apps/scenes'
refused src/grid/bin/grid.cpp '#include <sys/mman.h>' 'grid includes the standard library'
refused src/grid/bin/grid.cpp '#include "base/absent.hpp"' 'no such file'
refused src/grid/bin/grid.cpp 'void f() { std::abort(); }' 'never prints, exits or aborts'
refused src/base/bounds.hpp 'namespace throng::grid {' 'does not open namespace throng::base'
refused src/grid/bin/grid.cpp 'namespace throng::grids {' 'does not open namespace throng::grid'
refused src/api/find_pairs.cpp 'namespace throng::base {' 'does not open namespace throng('
refused src/api/find_pairs.cpp 'void f() { printf("x"); }' 'never prints, exits or aborts'
refused src/api/find_pairs.cpp 'void f() { std::cerr << 1; }' 'never prints, exits or aborts'
refused apps/scenes/npy.hpp '#include "base/bounds.hpp"' 'apps/scenes must not include base'
refused apps/scenes/npy.hpp '#include "tests/bounds_test.cpp"' 'apps/scenes must not include tests'
refused apps/scenes/npy.hpp '#include <CGAL/box_intersection_d.h>' 'only bench may include a competitor'
refused src/grid/bin/grid.cpp '#include <cuda_runtime_api.h>' 'see CUDA'
refused apps/scenes/npy.hpp '#include <mpi.h>' 'see MPI'
refused src/mpi/communicator.hpp '#include "grid/bin/grid.cpp"' 'mpi must not include grid'
refused src/mpi/communicator.hpp '#include "cuda/device.cuh"' 'only a .cu file of mpi may include cuda'
refused src/mpi/communicator.hpp '#include <cuda_runtime_api.h>' 'see CUDA'
refused src/mpi/communicator.hpp '#include <unistd.h>' 'mpi includes the standard library only'
refused apps/scenes/npy.hpp '#include <cub/device/device_scan.cuh>' 'see CUDA'
refused apps/common/child.hpp '#include "base/bounds.hpp"' 'apps/common must not include base'
refused apps/common/child.hpp '#include <CLI/CLI.hpp>' 'apps/common includes the public API, the standard library, the operating system and fmt only'
refused apps/scenes/npy.hpp '#include "apps/common/child.hpp"' 'apps/scenes must not include apps/common'
refused apps/scenes/npy.hpp '#include "apps/paper/search.hpp"' 'apps/scenes must not include apps/paper'
refused src/api/find_pairs.cpp '#include "apps/paper/search.hpp"' 'api must not include apps/paper'
refused apps/paper/search.hpp '#include "grid/bin/grid.cpp"' 'apps/paper must not include grid'
refused apps/paper/search.hpp '#include <cuda_runtime.h>' 'only a .cu file of apps/paper may include CUDA'
refused apps/paper/search.hpp '#include <cub/cub.cuh>' 'only a .cu file of apps/paper may include CUDA'
refused apps/scenes/npy.hpp '#include <fcl/broadphase/x.h>' 'see an engine'
refused tests/bounds_test.cpp '#include <LinearMath/btVector3.h>' 'see an engine'
refused apps/simulate/world.hpp '#include <embree3/rtcore.h>' 'only bench may include a competitor'
refused apps/scenes/npy.hpp '#include <throng/bullet.hpp>' 'apps/scenes must not include adapters'
refused adapters/bullet/throng/bullet.hpp '#include "base/bounds.hpp"' 'adapters must not include base'
refused adapters/bullet/throng/bullet.hpp '#include "apps/simulate/world.hpp"' 'adapters must not include apps/simulate'
echo "check_includes: $cases forbidden lines refused"
