# Cross build for 64-bit ARM with Debian's cross compiler; tests run under qemu-user.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -L /usr/aarch64-linux-gnu)
# Libraries of the host cannot be used: no oneTBB (THRONG_THREADS=std); Highway as headers only.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(hwy_DIR "${CMAKE_CURRENT_LIST_DIR}/host-headers")
