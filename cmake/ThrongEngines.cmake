# The physics engines that the adapters are tested with, one target each if installed: engine::bullet
# (floats), engine::bullet_float64, engine::fcl. All optional.
if(CMAKE_CROSSCOMPILING)
  return()  # libraries of this machine do not fit another
endif()
find_package(Bullet QUIET MODULE)
if(BULLET_FOUND AND NOT TARGET engine::bullet)
  add_library(engine::bullet INTERFACE IMPORTED)
  set_target_properties(engine::bullet PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${BULLET_INCLUDE_DIRS}"
    INTERFACE_LINK_LIBRARIES "${BULLET_LIBRARIES}")
endif()

# Debian has both builds in parallel; the headers are the same except for one definition.
set(throng_float64_libraries "")
foreach(part BulletDynamics BulletCollision LinearMath)
  find_library(THRONG_${part}_FLOAT64 ${part}-float64)
  list(APPEND throng_float64_libraries ${THRONG_${part}_FLOAT64})
endforeach()
if(BULLET_FOUND AND NOT throng_float64_libraries MATCHES "NOTFOUND" AND NOT TARGET engine::bullet_float64)
  add_library(engine::bullet_float64 INTERFACE IMPORTED)
  set_target_properties(engine::bullet_float64 PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${BULLET_INCLUDE_DIRS}"
    INTERFACE_COMPILE_DEFINITIONS BT_USE_DOUBLE_PRECISION
    INTERFACE_LINK_LIBRARIES "${throng_float64_libraries}")
endif()

find_package(fcl QUIET)
if(fcl_FOUND AND NOT TARGET engine::fcl)
  add_library(engine::fcl INTERFACE IMPORTED)
  set_target_properties(engine::fcl PROPERTIES INTERFACE_LINK_LIBRARIES fcl)
endif()
