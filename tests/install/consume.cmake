# Configures, builds and tests one external project from scratch, against the installed library, or with the
# sources in THRONG_SOURCE.
file(REMOVE_RECURSE "${BINARY}")
set(languages -DCMAKE_CXX_COMPILER=${CXX} "-DCMAKE_CXX_FLAGS=${FLAGS}")
if(C)
  set(languages -DCMAKE_C_COMPILER=${C} -DEXAMPLE=${EXAMPLE})
endif()
if(THRONG_SOURCE)
  list(APPEND languages -DTHRONG_SOURCE=${THRONG_SOURCE})
endif()
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE} -B ${BINARY} -G "${GENERATOR}"
                        -DCMAKE_PREFIX_PATH=${PREFIX} ${languages} -DCMAKE_BUILD_TYPE=${CONFIG}
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CMAKE_COMMAND} --build ${BINARY} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${CTEST} --test-dir ${BINARY} --output-on-failure --no-tests=error
                COMMAND_ERROR_IS_FATAL ANY)
