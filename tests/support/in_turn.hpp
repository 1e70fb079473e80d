// An executor that runs all tasks on the caller, one after another: the same work in the same order
// each time.
#pragma once

#include <throng/options.hpp>

namespace throng::tests {

inline Executor in_turn(unsigned concurrency) {
  return {concurrency,
          [](void*, unsigned count, void (*task)(void*, unsigned), void* context) {
            for (unsigned i = 0; i < count; ++i) task(context, i);
          },
          nullptr};
}

}  // namespace throng::tests
