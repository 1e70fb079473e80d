// What a fuzz target is: a function of bytes that throws Difference where something is wrong. A
// target's file includes this and defines run(). The thrown Difference ends a fuzzer's process, as
// nobody catches it there; the driver of the corpus catches it.
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
