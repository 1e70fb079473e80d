# A stale file of an earlier run must not hide one that is no longer installed.
file(REMOVE_RECURSE "${PREFIX}" "${PREFIX}.made")
# Installed to one place and moved to another, so that references to the first place fail.
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${PREFIX}.made --config ${CONFIG}
                OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(RENAME "${PREFIX}.made" "${PREFIX}")
file(GLOB_RECURSE texts "${PREFIX}/*.cmake" "${PREFIX}/*.pc")
foreach(text IN LISTS texts)
  file(READ "${text}" words)
  if(words MATCHES "\\.made")
    message(FATAL_ERROR "${text} contains the install prefix")
  endif()
endforeach()
# Files that no consumer here uses, but users need.
foreach(file share/doc/throng/LICENSE include/throng/throng.hpp ${PROGRAM})
  if(NOT EXISTS "${PREFIX}/${file}")
    message(FATAL_ERROR "not installed: ${file}")
  endif()
endforeach()
file(GLOB_RECURSE headers RELATIVE "${PREFIX}/include" "${PREFIX}/include/*")
foreach(header IN LISTS headers)
  if(NOT header MATCHES "^throng/[a-z_0-9]+\\.hp*$")
    message(FATAL_ERROR "installed, but not a public header: ${header}")
  endif()
endforeach()
# The benchmark is never packaged: CGAL's headers are GPL.
if(EXISTS "${PREFIX}/bin/throng-bench")
  message(FATAL_ERROR "installed: throng-bench")
endif()
