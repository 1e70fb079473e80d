// Bytes as a sequence of calls on a BroadPhase and its model: see broad_phase/life.hpp.
#include "broad_phase/life.hpp"
#include "fuzz/target.hpp"

namespace throng::tests {

void run(Bytes& bytes) { live(bytes); }

}  // namespace throng::tests
