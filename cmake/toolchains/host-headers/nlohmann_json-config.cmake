include("${CMAKE_CURRENT_LIST_DIR}/host_headers.cmake")
throng_host_headers(nlohmann_json nlohmann nlohmann_json::nlohmann_json)
