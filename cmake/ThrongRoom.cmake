# What all targets of the house share: the language, warnings, bit-exact floating point, one bin/.
include(GNUInstallDirs)
include(ThrongHarden)

set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
set(CMAKE_BUILD_RPATH_USE_ORIGIN ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
# An installed program finds a shared library of ours beside it, wherever the tree is moved.
if(BUILD_SHARED_LIBS AND NOT APPLE AND NOT WIN32 AND NOT DEFINED CMAKE_INSTALL_RPATH)
  file(RELATIVE_PATH throng_from_bin "/prefix/${CMAKE_INSTALL_BINDIR}" "/prefix/${CMAKE_INSTALL_LIBDIR}")
  set(CMAKE_INSTALL_RPATH "$ORIGIN/${throng_from_bin}")
endif()

function(throng_room target)
  target_compile_features(${target} PUBLIC cxx_std_17 PRIVATE cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_STANDARD 20 CXX_EXTENSIONS OFF UNITY_BUILD OFF)
  if(MSVC)
    target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:/fp:precise;/EHsc>")
  else()
    # Whatever flags come from the tree around us: NaN and infinity are looked for, memory that runs out
    # is an exception inside, and host and device must compute the same bits, so there is no fused
    # multiply-add behind our back (last, as -fno-fast-math brings clang's default back).
    target_compile_options(${target} PRIVATE
      "$<$<COMPILE_LANGUAGE:CXX>:-Wall;-Wextra;-Wshadow;-fexceptions;-fno-fast-math;-fno-finite-math-only>"
      "$<$<COMPILE_LANGUAGE:CXX>:-fno-associative-math;-fno-reciprocal-math;-fsigned-zeros;-ffp-contract=off>"
      "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${THRONG_WERROR}>>:-Werror>")
  endif()
  if(THRONG_HARDEN)
    throng_harden(${target})
  endif()
endfunction()

# A packaged source may leave out whole rooms (the benchmark, the tests): build those that are here.
function(throng_add_room directory)
  if(EXISTS "${PROJECT_SOURCE_DIR}/${directory}/CMakeLists.txt")
    add_subdirectory("${PROJECT_SOURCE_DIR}/${directory}" "${PROJECT_BINARY_DIR}/${directory}")
  endif()
endfunction()
