// Bytes as calls on a BroadPhase and on its model: see broad_phase/life.hpp.
#include "broad_phase/life.hpp"
#include "fuzz/target.hpp"

namespace throng::tests {

void run(Bytes& bytes) { live(bytes); }

}  // namespace throng::tests
