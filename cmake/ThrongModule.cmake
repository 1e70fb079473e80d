# Settings common to all targets: language, warnings, bit-exact floating point, one bin/ folder.
include(GNUInstallDirs)
include(ThrongHarden)

set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
set(CMAKE_BUILD_RPATH_USE_ORIGIN ON)
if(NOT DEFINED CMAKE_POSITION_INDEPENDENT_CODE)
  set(CMAKE_POSITION_INDEPENDENT_CODE ON)
endif()
# An installed program finds our shared library by a relative path, so that the tree is relocatable.
if(BUILD_SHARED_LIBS AND NOT APPLE AND NOT WIN32 AND NOT DEFINED CMAKE_INSTALL_RPATH)
  file(RELATIVE_PATH throng_from_bin "/prefix/${CMAKE_INSTALL_BINDIR}" "/prefix/${CMAKE_INSTALL_LIBDIR}")
  set(CMAKE_INSTALL_RPATH "$ORIGIN/${throng_from_bin}")
endif()

# A surrounding project without a build type compiles without optimization, unless its flags name a level.
set(throng_optimize "")
if(NOT MSVC AND NOT CMAKE_CXX_FLAGS MATCHES "(^| )-O")
  set(throng_optimize "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<NOT:$<BOOL:$<CONFIG>>>>:-O3;-DNDEBUG>")
endif()

if(NOT PROJECT_IS_TOP_LEVEL AND CMAKE_BUILD_TYPE STREQUAL "Debug")
  message(STATUS "throng: Debug compiles it without optimization, 13 times slower; "
                 "target_compile_options(throng PRIVATE -O2) optimizes it alone")
endif()

# Warnings that a surrounding project requests are for its own code.
set(throng_warnings -Wall -Wextra -Wshadow)
if(NOT PROJECT_IS_TOP_LEVEL AND NOT THRONG_WERROR)
  set(throng_warnings -w)
endif()

function(throng_module target)
  target_compile_features(${target} PUBLIC cxx_std_17 PRIVATE cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_STANDARD 20 CXX_EXTENSIONS OFF UNITY_BUILD OFF)
  if(MSVC)
    target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:/fp:precise;/EHsc>")
  else()
    # Overrides flags of a surrounding project: the code tests for NaN and infinity, handles out-of-memory by
    # exceptions, and needs bit-identical results on host and device, hence no fused multiply-add (last, since
    # -fno-fast-math restores clang's default).
    target_compile_options(${target} PRIVATE "${throng_optimize}"
      "$<$<COMPILE_LANGUAGE:CXX>:${throng_warnings};-fexceptions;-fno-fast-math;-fno-finite-math-only>"
      "$<$<COMPILE_LANGUAGE:CXX>:-fno-associative-math;-fno-reciprocal-math;-fsigned-zeros;-ffp-contract=off>"
      "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${THRONG_WERROR}>>:-Werror>")
  endif()
  if(THRONG_HARDEN)
    throng_harden(${target})
  endif()
endfunction()

# Source packages may omit modules (the benchmark, the tests): add those that exist.
function(throng_add_module directory)
  if(EXISTS "${PROJECT_SOURCE_DIR}/${directory}/CMakeLists.txt")
    add_subdirectory("${PROJECT_SOURCE_DIR}/${directory}" "${PROJECT_BINARY_DIR}/${directory}")
  endif()
endfunction()
