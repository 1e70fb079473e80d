// A fuzz target is a function of bytes that throws Difference on a failure. Its file includes this
// one and defines run(). In a fuzzer the exception terminates the process; the driver of the corpus
// catches it.
#pragma once

#include "support/bytes.hpp"

namespace throng::tests {

void run(Bytes& bytes);

}  // namespace throng::tests

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  throng::tests::Bytes bytes(data, size);
  throng::tests::run(bytes);
  return 0;
}
