# The oldest supported toolkit: cudaStreamGetDevice was added in 12.8.
set(THRONG_CUDA_OLDEST 12.8)

# throng_cuda_too_old(COMPILER OUT): sets OUT to the version of an nvcc that is too old, else to "".
function(throng_cuda_too_old compiler out)
  set(${out} "" PARENT_SCOPE)
  execute_process(COMMAND "${compiler}" --version OUTPUT_VARIABLE said ERROR_QUIET)
  if(said MATCHES "release ([0-9]+\\.[0-9]+)" AND CMAKE_MATCH_1 VERSION_LESS THRONG_CUDA_OLDEST)
    set(${out} "${CMAKE_MATCH_1}" PARENT_SCOPE)
  endif()
endfunction()
