# Enables the CUDA language if wanted and found; sets THRONG_CUDA_FOUND. Defines the settings of all device
# code: the language standard, and floating point that is bit-identical to the host's.
set(THRONG_CUDA_FOUND OFF)
if(THRONG_CUDA STREQUAL "AUTO" OR THRONG_CUDA)
  # Must be set before the language is enabled: the compiler's default may be one that it no longer supports.
  # The architecture of the first GPU present, else that of an H200.
  if(NOT CMAKE_CUDA_ARCHITECTURES)
    execute_process(COMMAND nvidia-smi --query-gpu=compute_cap --format=csv,noheader
                    OUTPUT_VARIABLE throng_capability ERROR_QUIET RESULT_VARIABLE throng_no_gpu)
    if(NOT throng_no_gpu AND throng_capability MATCHES "^([0-9]+)\\.([0-9])")
      set(CMAKE_CUDA_ARCHITECTURES "${CMAKE_MATCH_1}${CMAKE_MATCH_2}" CACHE STRING "GPU architectures")
    else()
      set(CMAKE_CUDA_ARCHITECTURES 90 CACHE STRING "GPU architectures")
    endif()
  endif()
  if(NOT CMAKE_CUDA_RUNTIME_LIBRARY)
    set(CMAKE_CUDA_RUNTIME_LIBRARY Static)
  endif()
  include(CheckLanguage)
  include(ThrongCudaVersion)
  check_language(CUDA)
  set(throng_too_old "")
  if(CMAKE_CUDA_COMPILER)
    throng_cuda_too_old("${CMAKE_CUDA_COMPILER}" throng_too_old)
  endif()
  if(CMAKE_CUDA_COMPILER AND NOT throng_too_old)
    enable_language(CUDA)
    find_package(CUDAToolkit REQUIRED)
    set(THRONG_CUDA_FOUND ON)
    # Targets that call the CUDA runtime link this library.
    set(throng_cudart CUDA::cudart_static)
    if(CMAKE_CUDA_RUNTIME_LIBRARY STREQUAL "Shared")
      set(throng_cudart CUDA::cudart)
    endif()
  elseif(throng_too_old AND NOT THRONG_CUDA STREQUAL "AUTO")
    message(FATAL_ERROR "THRONG_CUDA is ${THRONG_CUDA}, but ${CMAKE_CUDA_COMPILER} belongs to CUDA ${throng_too_old}; "
                        "${THRONG_CUDA_OLDEST} or newer is needed. Set CMAKE_CUDA_COMPILER to a newer one, or "
                        "THRONG_CUDA=OFF.")
  elseif(throng_too_old)
    message(STATUS "throng: ${CMAKE_CUDA_COMPILER} belongs to CUDA ${throng_too_old}, ${THRONG_CUDA_OLDEST} or newer is "
                   "needed; the GPU backend is left out")
  elseif(NOT THRONG_CUDA STREQUAL "AUTO")
    message(FATAL_ERROR "THRONG_CUDA is ${THRONG_CUDA}, but no CUDA compiler was found. Put nvcc on PATH, "
                        "or set CMAKE_CUDA_COMPILER, or THRONG_CUDA=OFF.")
  else()
    message(STATUS "throng: no CUDA compiler was found; the GPU backend is left out")
  endif()
endif()

# throng_cuda_sources(TARGET sources...): adds device code to a target. Sets the standard by hand, since CMake
# 3.25 does not know that of CUDA 13.
function(throng_cuda_sources target)
  target_sources(${target} PRIVATE ${ARGN})
  set_target_properties(${target} PROPERTIES CUDA_STANDARD_REQUIRED OFF CUDA_SEPARABLE_COMPILATION OFF)
  set_property(SOURCE ${ARGN} APPEND PROPERTY COMPILE_OPTIONS
    -std=c++20 --expt-relaxed-constexpr --fmad=false --ftz=false --prec-div=true --prec-sqrt=true
    -Xcompiler=-fno-fast-math,-fno-finite-math-only,-ffp-contract=off,-Wall,-Wextra,-Wno-unknown-pragmas
    "$<$<BOOL:${THRONG_WERROR}>:-Werror=all-warnings>")
endfunction()
