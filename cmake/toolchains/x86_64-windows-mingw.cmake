# Cross build for 64-bit Windows with Debian's mingw-w64; tests run under wine.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR AMD64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(CMAKE_CROSSCOMPILING_EMULATOR wine)
# Programs need none of the compiler's libraries.
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
# Libraries of the host cannot be used: no oneTBB (THRONG_THREADS=std), no Cairo; some are headers alone.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH /usr/x86_64-w64-mingw32)
foreach(package hwy fmt CLI11 nlohmann_json)
  set(${package}_DIR "${CMAKE_CURRENT_LIST_DIR}/host-headers")
endforeach()
set(ENV{PKG_CONFIG_LIBDIR} /usr/x86_64-w64-mingw32/lib/pkgconfig)
