// What throng-paper can be asked for. Each adds itself to the command line; what it returns runs
// it.
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace throng::paper {

using Run = std::function<int()>;  // gives the exit status

Run add_pairs(CLI::App& program);
// The options of the program itself: the evaluation.
Run add_evaluate(CLI::App& program);

}  // namespace throng::paper
