// The largest block of memory that this thread has asked for.
#pragma once

#include <cstddef>

void forget_blocks() noexcept;
std::size_t largest_block() noexcept;
