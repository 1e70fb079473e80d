// The commands. Each registers its options; the function that it returns runs it.
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace throng::cli {

using Run = std::function<int()>;  // returns the exit status

Run add_pairs(CLI::App& program);
Run add_mesh(CLI::App& program);
Run add_scene(CLI::App& program);
Run add_check(CLI::App& program);
Run add_replay(CLI::App& program);
Run add_explain(CLI::App& program);
Run add_demo(CLI::App& program);

}  // namespace throng::cli
