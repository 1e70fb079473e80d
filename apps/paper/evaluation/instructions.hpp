// The number of instructions of a piece of work, counted by single-stepping.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

namespace throng::paper {

// The number of instructions that this processor executes for `work`, without the call itself. A
// child process single-steps it under ptrace, a few microseconds each: keep it short, without
// allocation and locks. Nothing where the system has no ptrace, or refuses it.
std::optional<std::uint64_t> count_instructions(const std::function<void()>& work);

}  // namespace throng::paper
