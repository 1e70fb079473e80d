// Options that `pairs` and `check` share: input files, filters, overlap rules.
#pragma once

#include <string>

#include <throng/options.hpp>

#include "apps/common/failure_text.hpp"

namespace CLI {
class App;
}

namespace throng::cli {

// One file of values per filter; empty: not given.
struct FilterFiles {
  std::string group, mask, owner, world, is_static;
};

struct InputArguments {
  std::string a, b;  // b empty: one set
  FilterFiles filters_a, filters_b;
  bool round_outward = false;
  bool nan_inactive = false;
  bool refuses_inverted = false;
  float margin = 0.0f;

  // Throws Failure where filters of a second set are given without one.
  void require_no_filters_b() const;
};

struct SearchArguments {
  std::string backend = "auto", algorithm = "auto", order = "any", isa = "auto";
  unsigned threads = 0;
};

void add_input_arguments(CLI::App& app, InputArguments& arguments);
void add_threads(CLI::App& app, unsigned& threads);
// What `--backend auto` is: the fastest; the CPU, and a GPU on request; the CPU, as is any other.
enum class AutoBackend { fastest, cpu, cpu_only };
void add_search_arguments(CLI::App& app, SearchArguments& arguments,
                          AutoBackend auto_backend = AutoBackend::fastest);

// The options that help where a search fails, for messages.
common::HintOptions to_hint_options(const SearchArguments& search);
// Throws Failure for what this build does not support.
Options to_options(const InputArguments& input, const SearchArguments& search);

}  // namespace throng::cli
