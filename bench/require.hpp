// Throws if a call of the library failed.
#pragma once

#include <throng/options.hpp>

#include "apps/common/failure.hpp"
#include "apps/common/failure_text.hpp"

namespace throng::bench {

inline void require(const Result& r) {
  if (!r.ok()) throw common::Failure(common::failure_text(r, {}));
}

}  // namespace throng::bench
