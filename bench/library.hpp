// Throng's own rows, linked as it is shipped.
#pragma once

#include <optional>
#include <vector>

#include <throng/throng.hpp>

#include "bench/contender.hpp"

namespace throng::bench {

// `isas`: one row for each instruction set that this processor has, beside the automatic one.
std::vector<Entry> library_entries(bool isas);
// What the last run of a library contender told; nothing for the others.
std::optional<Result> library_result(const Contender& contender);

inline constexpr const char* main_row = "Throng";
// Beyond this the brute force would only cost time.
inline constexpr std::size_t all_pairs_limit = 10000;

}  // namespace throng::bench
