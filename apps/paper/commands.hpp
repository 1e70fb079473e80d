// The sub-commands of throng-paper. Each registers its options; the function that it returns runs
// it.
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace throng::paper {

using Run = std::function<int()>;  // returns the exit status

Run add_pairs(CLI::App& program);
// The options of the main program: the evaluation.
Run add_evaluate(CLI::App& program);

}  // namespace throng::paper
