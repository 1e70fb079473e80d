// The sub-commands of throng-paper. Each adds itself to the command line; what it returns runs it.
#pragma once

#include <functional>

#include <CLI/CLI.hpp>

namespace throng::paper {

using Run = std::function<int()>;  // gives the exit status

Run add_pairs(CLI::App& program);
Run add_roots(CLI::App& program);
Run add_measure(CLI::App& program);

}  // namespace throng::paper
