# MPI, where it is wanted and found: THRONG_MPI_FOUND tells.
set(THRONG_MPI_FOUND OFF)
if(THRONG_MPI AND NOT CMAKE_CROSSCOMPILING)
  set(MPI_CXX_SKIP_MPICXX ON)  # the C functions alone: the old C++ ones are full of warnings
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
