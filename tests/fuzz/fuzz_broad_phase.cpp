// Bytes as a sequence of calls on a BroadPhase and its model: see broad_phase/call_sequence.hpp.
#include "broad_phase/call_sequence.hpp"
#include "fuzz/target.hpp"

namespace throng::tests {

void run(Bytes& bytes) { run_call_sequence(bytes); }

}  // namespace throng::tests
