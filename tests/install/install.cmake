# A stale file of an earlier run must not hide one that is no longer installed.
file(REMOVE_RECURSE "${PREFIX}" "${PREFIX}.made")
# Installed to one place and moved to another: whoever uses it finds nothing at the first.
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${PREFIX}.made --config ${CONFIG}
                OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(RENAME "${PREFIX}.made" "${PREFIX}")
file(GLOB_RECURSE texts "${PREFIX}/*.cmake" "${PREFIX}/*.pc")
foreach(text IN LISTS texts)
  file(READ "${text}" words)
  if(words MATCHES "\\.made")
    message(FATAL_ERROR "${text} names the place where it was installed")
  endif()
endforeach()
# What no consumer here would miss, but a user would.
foreach(file share/doc/throng/LICENSE include/throng/throng.hpp ${PROGRAM})
  if(NOT EXISTS "${PREFIX}/${file}")
    message(FATAL_ERROR "not installed: ${file}")
  endif()
endforeach()
file(GLOB_RECURSE headers RELATIVE "${PREFIX}/include" "${PREFIX}/include/*")
foreach(header IN LISTS headers)
  if(NOT header MATCHES "^throng/[a-z_0-9]+\\.hp*$")
    message(FATAL_ERROR "installed and none of the door's: ${header}")
  endif()
endforeach()
# The benchmark is never packaged: CGAL's headers are GPL.
if(EXISTS "${PREFIX}/bin/throng-bench")
  message(FATAL_ERROR "installed: throng-bench")
endif()
