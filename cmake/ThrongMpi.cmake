# Finds MPI if wanted; sets THRONG_MPI_FOUND.
set(THRONG_MPI_FOUND OFF)
if(THRONG_MPI AND NOT CMAKE_CROSSCOMPILING)
  set(MPI_CXX_SKIP_MPICXX ON)  # only the C API: the old C++ bindings cause many warnings
  find_package(MPI 3.0 QUIET COMPONENTS CXX)
  if(MPI_CXX_FOUND)
    set(THRONG_MPI_FOUND ON)
  elseif(THRONG_MPI STREQUAL "AUTO")
    message(STATUS "throng: no MPI was found; the search across ranks and throng-mpi are left out "
                   "(package libopenmpi-dev)")
  else()
    message(FATAL_ERROR "THRONG_MPI is ${THRONG_MPI}, but no MPI was found. Install one (package "
                        "libopenmpi-dev), or set THRONG_MPI=OFF.")
  endif()
endif()

# Open MPI needs special flags for more ranks than cores.
set(THRONG_OPEN_MPI OFF)
if(THRONG_MPI_FOUND)
  execute_process(COMMAND ${MPIEXEC_EXECUTABLE} --version OUTPUT_VARIABLE throng_mpiexec_version ERROR_VARIABLE throng_mpiexec_version)
  if(throng_mpiexec_version MATCHES "Open ?MPI|OpenRTE")
    set(THRONG_OPEN_MPI ON)
  endif()
endif()

# throng_mpi_test(NAME RANKS PROGRAM arguments...): a test that runs a program on RANKS ranks, which share the
# cores.
function(throng_mpi_test name ranks)
  set(mpiexec_options ${MPIEXEC_NUMPROC_FLAG} ${ranks})
  if(THRONG_OPEN_MPI)
    list(PREPEND mpiexec_options --oversubscribe --bind-to none)
  endif()
  add_test(NAME ${name} COMMAND ${MPIEXEC_EXECUTABLE} ${mpiexec_options} ${ARGN})
  # Allow root, for containers.
  set_tests_properties(${name} PROPERTIES LABELS mpi TIMEOUT 300 PROCESSORS 2
    ENVIRONMENT "OMPI_ALLOW_RUN_AS_ROOT=1;OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1")
endfunction()
