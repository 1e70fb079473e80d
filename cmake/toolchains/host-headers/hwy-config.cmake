include("${CMAKE_CURRENT_LIST_DIR}/host_headers.cmake")
throng_host_headers(hwy hwy hwy::hwy)
