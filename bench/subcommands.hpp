// The subcommands of throng-bench, and the options that they share.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/results.hpp"

namespace throng::bench {

// Each is given the arguments after its name. They throw common::Failure, throng::Error or any
// std::exception for bad input, and return the exit status.
int search_command(int argc, char** argv);
int moving_command(int argc, char** argv);
int queries_command(int argc, char** argv);
int filters_command(int argc, char** argv);
int doubles_command(int argc, char** argv);
int bodies_command(int argc, char** argv);
int mesh_command(int argc, char** argv);
int frames_command(int argc, char** argv);
int costs_command(int argc, char** argv);
int gpu_command(int argc, char** argv);

// --csv, --machine, --commit.
void add_output_options(CLI::App& app, OutputOptions& options);

// Options of the subcommands whose cases are fixed.
struct CaseOptions {
  OutputOptions output;
  std::string only;
  std::vector<unsigned> threads;  // by default 1 and all
  std::size_t max_objects = 0;    // 0: no limit
  int rounds = 0;                 // 0: the number of each case
  bool quick = false, competitors = true;

  bool wanted(const std::string& name) const { return name.find(only) != std::string::npos; }
  std::size_t objects(std::size_t n) const { return max_objects ? std::min(n, max_objects) : n; }
  int rounds_of(int n) const { return rounds ? rounds : n; }
};

// `only`: what a case's name is made of; empty: no such option. Parses, and completes the defaults.
// Returns true if the subcommand is to run; else `status` is the exit status.
bool parse_case_options(CLI::App& app, CaseOptions& options, const std::string& only, int argc,
                        char** argv, int& status);

}  // namespace throng::bench
