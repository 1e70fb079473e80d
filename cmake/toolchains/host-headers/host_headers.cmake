# Libraries of the host that a cross compiler can use, since they are headers alone. They are in /usr/include, which it
# must not search otherwise, hence a link to one folder.
macro(throng_host_headers package folder target)
  if(EXISTS /usr/include/${folder})
    file(MAKE_DIRECTORY "${CMAKE_BINARY_DIR}/host-headers/${folder}")
    file(CREATE_LINK /usr/include/${folder} "${CMAKE_BINARY_DIR}/host-headers/${folder}/${folder}" SYMBOLIC)
    if(NOT TARGET ${target})
      add_library(${target} INTERFACE IMPORTED)
      target_include_directories(${target} SYSTEM INTERFACE "${CMAKE_BINARY_DIR}/host-headers/${folder}")
    endif()
  else()
    set(${package}_FOUND FALSE)
  endif()
endmacro()
