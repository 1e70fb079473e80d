// Makes a failing input small, and a ready test case of it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "support/cases.hpp"
#include "support/configs.hpp"

namespace throng::tests {

// The fewest and smallest bytes found that still fail: chunks are taken out, then bytes made zero.
// `fails` must hold for `bytes`.
std::vector<std::uint8_t> minimise_bytes(
    std::vector<std::uint8_t> bytes,
    const std::function<bool(const std::vector<std::uint8_t>&)>& fails);

// The same for a case: boxes are taken out, filters and options given up, numbers made plain.
Case minimise_case(Case c, const std::function<bool(const Case&)>& fails);

// A GoogleTest of the case by one configuration, with floats in hexadecimal: a file to compile.
std::string as_test(const Case& c, const Config& config, const std::string& name);

}  // namespace throng::tests
