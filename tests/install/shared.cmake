# Builds the preset `library` as a shared library, installs it, and runs the consumers against it. With a compiler cache
# nothing is compiled again.
file(REMOVE_RECURSE "${WORK}")
execute_process(COMMAND ${CMAKE_COMMAND} --preset library -S ${ROOT} -B ${WORK}/build -DBUILD_SHARED_LIBS=ON
                        -DTHRONG_THREADS=${THREADS} -DTHRONG_WERROR=${WERROR} -DCMAKE_CXX_COMPILER=${CXX} "-DCMAKE_CXX_FLAGS=${FLAGS}"
                WORKING_DIRECTORY ${ROOT} OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK}/build COMMAND_ERROR_IS_FATAL ANY)
file(GLOB programs "${WORK}/build/bin/throng*")
if(programs)
  message(FATAL_ERROR "the preset builds programs: ${programs}")
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -DBUILD=${WORK}/build -DPREFIX=${WORK}/prefix -DCONFIG=Release
                        -P ${CMAKE_CURRENT_LIST_DIR}/install.cmake COMMAND_ERROR_IS_FATAL ANY)
# Nothing but the library itself is required of a user.
file(READ "${WORK}/prefix/${LIBDIR}/cmake/throng/throng-config.cmake" config)
file(READ "${WORK}/prefix/${LIBDIR}/pkgconfig/throng.pc" pc)
if(config MATCHES "\n(find_dependency|throng_require)\\(" OR pc MATCHES "Requires.private: *[a-z]")
  message(FATAL_ERROR "a shared library requires packages: ${config} ${pc}")
endif()
set(PREFIX "${WORK}/prefix")
set(OUTPUT "${WORK}/by_pkg_config")
include(${CMAKE_CURRENT_LIST_DIR}/pkg_config.cmake)
foreach(consumer cpp17 cpp20 c)
  set(languages -DCXX=${CXX} "-DFLAGS=${FLAGS}")
  if(consumer STREQUAL "c")
    if(NOT C)
      continue()
    endif()
    set(languages -DC=${C} -DEXAMPLE=${EXAMPLE})
  endif()
  execute_process(COMMAND ${CMAKE_COMMAND} -DSOURCE=${SOURCES}/${consumer} -DBINARY=${WORK}/${consumer} -DPREFIX=${PREFIX}
                          "-DGENERATOR=${GENERATOR}" -DCONFIG=Release -DCTEST=${CTEST} ${languages}
                          -P ${CMAKE_CURRENT_LIST_DIR}/consume.cmake COMMAND_ERROR_IS_FATAL ANY)
endforeach()
