include("${CMAKE_CURRENT_LIST_DIR}/host_headers.cmake")
throng_host_headers(CLI11 CLI CLI11::CLI11)
