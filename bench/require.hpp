// Throws if a call of the library failed.
#pragma once

#include <throng/options.hpp>

#include "program/failure.hpp"
#include "program/failure_text.hpp"

namespace throng::bench {

inline void require(const Result& r) {
  if (!r.ok()) throw program::Failure(program::failure_text(r, {}));
}

}  // namespace throng::bench
