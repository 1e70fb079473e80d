// Minimizes a failing input and writes a test case of it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "support/cases.hpp"
#include "support/configs.hpp"

namespace throng::tests {

// Minimizes bytes that still fail: removes chunks, then zeroes bytes. `fails` must hold for
// `bytes`.
std::vector<std::uint8_t> minimize_bytes(
    std::vector<std::uint8_t> bytes,
    const std::function<bool(const std::vector<std::uint8_t>&)>& fails);

// The same for a case: removes boxes, filters and options, and simplifies numbers.
Case minimize_case(Case c, const std::function<bool(const Case&)>& fails);

// The source of a GoogleTest of the case with one configuration; floats in hexadecimal.
std::string as_test(const Case& c, const Config& config, const std::string& name);

}  // namespace throng::tests
