// The largest block of memory that this thread has allocated.
#pragma once

#include <cstddef>

void forget_blocks() noexcept;
std::size_t largest_block() noexcept;
