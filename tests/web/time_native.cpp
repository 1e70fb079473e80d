// Times searches of the native library on one thread, for web/bench/compare.mjs: reads float32
// boxes, six numbers each, and prints the milliseconds of processor time of each run.
#include <throng/throng.h>

#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

int main(int count, char** arguments) {
  const std::string isa = count == 4 ? arguments[2] : "";
  if (isa != "sse4" && isa != "scalar" && isa != "auto") {
    std::cerr << "usage: throng-web-time BOXES sse4|scalar|auto RUNS\n";
    return 2;
  }
  std::ifstream file(arguments[1], std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
  const throng_boxes boxes = throng_boxes_packed(reinterpret_cast<const throng_box*>(bytes.data()),
                                                 bytes.size() / sizeof(throng_box));
  throng_options options;
  throng_options_init(&options);
  options.threads = 1;
  options.isa = isa == "sse4"     ? THRONG_ISA_SSE4
                : isa == "scalar" ? THRONG_ISA_SCALAR
                                  : THRONG_ISA_AUTOMATIC;
  throng_finder* const finder = throng_finder_create(&options);
  const int runs = std::atoi(arguments[3]);
  for (int run = -3; run < runs; ++run) {  // three to warm up
    const std::clock_t start = std::clock();
    const throng_status status = throng_find(finder, &boxes, nullptr);
    const std::clock_t end = std::clock();
    if (status != THRONG_OK) {
      std::cerr << throng_finder_result(finder)->message << '\n';
      return 1;
    }
    if (run >= 0) std::cout << 1e3 * static_cast<double>(end - start) / CLOCKS_PER_SEC << '\n';
  }
  throng_finder_destroy(finder);
}
