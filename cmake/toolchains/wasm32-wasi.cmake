# WebAssembly with Debian's clang-22, lld-22, libc++-22-dev-wasm32, libc++abi-22-dev-wasm32, libclang-rt-22-dev-wasm32 and
# wasi-libc. Its runtime has no exceptions: a throw is a trap, so arguments must be refused by a status before. It has no threads:
# THRONG_THREADS=none.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
set(CMAKE_CXX_COMPILER clang++-22)
set(CMAKE_CXX_COMPILER_TARGET wasm32-wasi)
set(CMAKE_AR llvm-ar-22)
set(CMAKE_RANLIB llvm-ranlib-22)
set(CMAKE_EXECUTABLE_SUFFIX .wasm)
set(CMAKE_CXX_FLAGS_INIT "-fignore-exceptions -msimd128 -Wno-deprecated")
# A module whose functions are called from outside, after _initialize; no main().
set(CMAKE_EXE_LINKER_FLAGS_INIT -mexec-model=reactor)
# A static module needs none, and it would cost time.
set(CMAKE_POSITION_INDEPENDENT_CODE OFF)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(hwy_DIR "${CMAKE_CURRENT_LIST_DIR}/host-headers")
