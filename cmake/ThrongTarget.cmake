# Refuses targets that the library does not support: 32 bits except WebAssembly, which alone is tested, and big-endian ones (keys
# and files take little-endian words).
if(CMAKE_SIZEOF_VOID_P EQUAL 4 AND NOT CMAKE_SYSTEM_PROCESSOR STREQUAL "wasm32")
  message(FATAL_ERROR "Throng needs a 64-bit target, but ${CMAKE_CXX_COMPILER} compiles for 32 bits. Remove -m32, or choose a "
                      "64-bit compiler with CMAKE_CXX_COMPILER.")
endif()
if(CMAKE_CXX_BYTE_ORDER STREQUAL "BIG_ENDIAN")
  message(FATAL_ERROR "Throng needs a little-endian target, but ${CMAKE_CXX_COMPILER} compiles for a big-endian one. Choose "
                      "another target with CMAKE_CXX_COMPILER or CMAKE_CXX_COMPILER_TARGET.")
endif()
