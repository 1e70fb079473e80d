// libFuzzer's door to a target.
#include <cstdlib>
#include <iostream>

#include "fuzz/target.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    throng::tests::Bytes bytes(data, size);
    throng::tests::run(bytes);
  } catch (const throng::tests::Difference& difference) {
    std::cerr << "DIFFERENCE: " << difference.what() << std::endl;
    std::abort();
  }
  return 0;
}
