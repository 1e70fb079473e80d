// Explains a finished search.
#pragma once

#include <throng/boxes.hpp>
#include <throng/explain.hpp>
#include <throng/options.hpp>

namespace throng::grid {
class Engine;
}

namespace throng {

// `result` must be that of the engine's last search, of these boxes (b null: one set).
Explanation make_explanation(const Boxes& a, const Boxes* b, const Options& options,
                             const Result& result, const grid::Engine& engine);

}  // namespace throng
