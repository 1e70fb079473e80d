// The subcommands. Each add_ function registers one; the function that it returns runs it, on every
// rank.
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace throng::mpi_app {

using Run = std::function<void()>;

Run add_pairs(CLI::App& program);
Run add_bench(CLI::App& program);
Run add_model(CLI::App& program);

}  // namespace throng::mpi_app
