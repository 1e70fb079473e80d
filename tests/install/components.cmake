cmake_minimum_required(VERSION 3.25)  # for IN_LIST
# find_package by components: core is found; one that was not built is refused with the fix, an unknown one by
# name, and an optional one is reported as not found. HAS: the components built.
file(REMOVE_RECURSE "${WORK}")
foreach(component core cuda mpi wheels)
  file(WRITE "${WORK}/${component}/CMakeLists.txt" "cmake_minimum_required(VERSION 3.25)
project(components LANGUAGES CXX)
find_package(throng QUIET OPTIONAL_COMPONENTS ${component})
if(NOT throng_FOUND)
  message(FATAL_ERROR \"optional component refused\")
endif()
message(STATUS \"optional: '\${throng_${component}_FOUND}'\")
find_package(throng REQUIRED COMPONENTS ${component})
")
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${WORK}/${component} -B ${WORK}/${component}/build -G "${GENERATOR}"
                          -DCMAKE_PREFIX_PATH=${PREFIX} -DCMAKE_CXX_COMPILER=${CXX}
                  OUTPUT_VARIABLE said ERROR_VARIABLE said RESULT_VARIABLE failed)
  string(REGEX REPLACE "[ \n]+" " " said "${said}")  # CMake breaks lines
  if("${component}" IN_LIST HAS)
    if(failed OR NOT said MATCHES "optional: '(TRUE|ON)'")
      message(FATAL_ERROR "${component} is built, but was refused: ${said}")
    endif()
  elseif(NOT failed OR said MATCHES "optional: '(TRUE|ON)'" OR said MATCHES "optional component refused")
    message(FATAL_ERROR "${component} is not built, but was accepted: ${said}")
  elseif(NOT said MATCHES "(without its component '${component}':.*-DTHRONG_|has no component 'wheels'; there are: core)")
    message(FATAL_ERROR "${component} was refused without the fix: ${said}")
  endif()
endforeach()
