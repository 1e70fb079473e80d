# Install rules by component. `core`: what a program needs at run time (of a shared library). `development`:
# headers, CMake and pkg-config files, and the static MPI library. `program`, `simulate` and `mpi`: the
# programs, by dependency. The benchmark is not installed, since its competitors have other licences.
include(CMakePackageConfigHelpers)

set(throng_config_dir "${CMAKE_INSTALL_LIBDIR}/cmake/throng")

install(TARGETS throng EXPORT throng-targets
        ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development
        LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT core NAMELINK_COMPONENT development
        RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}" COMPONENT core)
install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/throng" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}"
        COMPONENT development FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h")
install(EXPORT throng-targets NAMESPACE throng:: DESTINATION "${throng_config_dir}" COMPONENT development)
# The MPI library has its own export, so that other users need no MPI.
set(throng_mpi_built OFF)
set(throng_mpi_find_dependencies "")
if(TARGET throng_mpi)
  set(throng_mpi_built ON)
  get_target_property(throng_mpi_links throng_mpi LINK_LIBRARIES)
  if("${throng_mpi_links}" MATCHES "CUDA::cudart")
    set(throng_mpi_find_dependencies "find_dependency(CUDAToolkit)")
  endif()
  set_target_properties(throng_mpi PROPERTIES EXPORT_NAME mpi)
  install(TARGETS throng_mpi EXPORT throng-mpi-targets
          ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development)
  install(EXPORT throng-mpi-targets NAMESPACE throng:: DESTINATION "${throng_config_dir}" COMPONENT development)
endif()
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" "${PROJECT_SOURCE_DIR}/CITATION.cff"
        DESTINATION "${CMAKE_INSTALL_DOCDIR}" COMPONENT core)

# Users of a static library must link its dependencies, those of a shared one not. They are read from the
# target, so that this file cannot deviate from src/CMakeLists.txt.
get_target_property(throng_links throng LINK_LIBRARIES)
get_target_property(throng_type throng TYPE)
set(throng_find_dependencies "")
set(throng_pc_requires "")
set(throng_pc_libs "-lstdc++ -lm")
# What a C++ compiler links implicitly and a pure C project must link explicitly.
set(throng_runtime ${CMAKE_CXX_IMPLICIT_LINK_LIBRARIES})
list(FILTER throng_runtime INCLUDE REGEX "^(stdc\\+\\+|c\\+\\+|c\\+\\+abi|m)$")
list(REMOVE_DUPLICATES throng_runtime)
if("${throng_links}" MATCHES "Threads::Threads")
  string(APPEND throng_find_dependencies "find_dependency(Threads)\n")
  string(APPEND throng_pc_libs " -pthread")
endif()
if("${throng_links}" MATCHES "TBB::tbb")
  string(APPEND throng_find_dependencies "throng_require(TBB TBB::tbb \"oneTBB (Debian, Ubuntu: apt install libtbb-dev)\")\n")
  list(APPEND throng_pc_requires tbb)
endif()
if("${throng_links}" MATCHES "hwy::hwy")
  string(APPEND throng_find_dependencies "find_dependency(hwy)\n")
  list(APPEND throng_pc_requires libhwy)
endif()
if("${throng_links}" MATCHES "CUDA::(cudart[a-z_]*)")
  string(APPEND throng_find_dependencies "throng_require(CUDAToolkit CUDA::${CMAKE_MATCH_1} \"the CUDA toolkit\")\n")
  # Without the toolkit's folder, which is not the same everywhere.
  string(APPEND throng_pc_libs " -l${CMAKE_MATCH_1} -ldl -lrt -pthread")
endif()
list(JOIN throng_pc_requires " " throng_pc_requires)
if(throng_type STREQUAL "SHARED_LIBRARY")
  set(throng_find_dependencies "")
  set(throng_pc_requires "")
  set(throng_pc_libs "")
  set(throng_runtime "")
endif()

configure_package_config_file(
  "${CMAKE_CURRENT_LIST_DIR}/throng-config.cmake.in" "${PROJECT_BINARY_DIR}/throng-config.cmake"
  INSTALL_DESTINATION "${throng_config_dir}")
# Before 1.0 a minor version may change the API.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/throng-config-version.cmake"
                                 COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/throng-config.cmake"
              "${PROJECT_BINARY_DIR}/throng-config-version.cmake"
        DESTINATION "${throng_config_dir}" COMPONENT development)

if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}" OR IS_ABSOLUTE "${CMAKE_INSTALL_INCLUDEDIR}")
  set(throng_pc_prefix "${CMAKE_INSTALL_PREFIX}")
else()
  # Relative to the file itself, so that the installed tree is relocatable.
  file(RELATIVE_PATH throng_pc_prefix "/prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/prefix")
  string(REGEX REPLACE "/$" "" throng_pc_prefix "\${pcfiledir}/${throng_pc_prefix}")
endif()
set(throng_pc_libdir "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
set(throng_pc_includedir "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
if(IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
  set(throng_pc_libdir "${CMAKE_INSTALL_LIBDIR}")
endif()
if(IS_ABSOLUTE "${CMAKE_INSTALL_INCLUDEDIR}")
  set(throng_pc_includedir "${CMAKE_INSTALL_INCLUDEDIR}")
endif()
configure_file("${CMAKE_CURRENT_LIST_DIR}/throng.pc.in" "${PROJECT_BINARY_DIR}/throng.pc.install"
               @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/throng.pc.install" RENAME throng.pc
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig" COMPONENT development)

# A surrounding project makes its own packages.
if(PROJECT_IS_TOP_LEVEL)
  include(ThrongPackage)
endif()
