# Highway as headers only: those of the host's package fit every processor. They are in /usr/include, which a
# cross compiler must not search otherwise, hence the link.
find_path(throng_highway_root hwy/highway.h PATHS /usr/include NO_CMAKE_FIND_ROOT_PATH)
if(NOT throng_highway_root)
  set(hwy_FOUND FALSE)
  return()
endif()
file(MAKE_DIRECTORY "${CMAKE_BINARY_DIR}/highway")
file(CREATE_LINK "${throng_highway_root}/hwy" "${CMAKE_BINARY_DIR}/highway/hwy" SYMBOLIC)
add_library(hwy::hwy INTERFACE IMPORTED)
target_include_directories(hwy::hwy SYSTEM INTERFACE "${CMAKE_BINARY_DIR}/highway")
