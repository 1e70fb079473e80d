// Many worlds in one place, for contenders that know of no worlds: one search a world.
#pragma once

#include "bench/contender.hpp"

namespace throng::bench {

// Boxes are sorted by world inside the time; worlds are dealt to threads, each with a
// single-threaded contender of its own.
Entry one_world_at_a_time(const Entry& entry);

}  // namespace throng::bench
