// What a fuzz target is: a function of bytes that throws Difference where something is wrong. A
// target's file defines run() alone; libFuzzer's door or the driver of the corpus calls it.
#pragma once

#include "support/bytes.hpp"

namespace throng::tests {

void run(Bytes& bytes);

}  // namespace throng::tests
