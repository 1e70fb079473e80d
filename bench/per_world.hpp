// Many worlds in one place, for methods that do not support worlds: one search per world.
#pragma once

#include "bench/competitors/method.hpp"

namespace throng::bench {

// Boxes are sorted by world inside the measured time. Worlds are distributed over the threads, each
// with its own single-threaded method.
MethodInfo one_world_at_a_time(const MethodInfo& method);

}  // namespace throng::bench
