// How many instructions a piece of work takes, on whatever machine: counted one by one.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

namespace throng::paper {

// The instructions that this processor executes for `work`, beside those of calling it. A child
// process runs it step by step under ptrace, some microseconds each: give it little to do, and
// nothing that allocates or locks. Nothing where the system has no ptrace, or refuses it.
std::optional<std::uint64_t> count_instructions(const std::function<void()>& work);

}  // namespace throng::paper
