// From a search that is done to what is told of it.
#pragma once

#include <throng/boxes.hpp>
#include <throng/explain.hpp>
#include <throng/options.hpp>

namespace throng::cpu {
class Engine;
}

namespace throng {

// `result` is that of a search of these boxes (b null: one set) by this engine, its last one.
Explanation describe(const Boxes& a, const Boxes* b, const Options& options, const Result& result,
                     const cpu::Engine& engine);

}  // namespace throng
