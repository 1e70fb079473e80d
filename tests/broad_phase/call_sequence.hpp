// Decodes bytes as valid and invalid calls on a BroadPhase, and makes the same calls on its model.
// All results must equal those of the model; invalid calls must be refused and change nothing.
#pragma once

#include <cstdint>

#include "support/bytes.hpp"

namespace throng::tests {

// Amounts compared in a sequence: objects and pairs, once per update whose full result was
// compared.
struct CallSequenceCounts {
  std::uint64_t updates = 0, boxes = 0, pairs = 0, queries = 0;
};

// Throws Difference.
CallSequenceCounts run_call_sequence(Bytes& bytes);

}  // namespace throng::tests
