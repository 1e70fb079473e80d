// The library's own methods, linked as it is shipped.
#pragma once

#include <optional>
#include <vector>

#include <throng/throng.hpp>

#include "bench/competitors/method.hpp"

namespace throng::bench {

// `isas`: one more method for each instruction set of this processor.
std::vector<MethodInfo> throng_methods(bool isas);
// The result of the last run of one of these methods; empty for other methods.
std::optional<Result> throng_result(const Method& method);

// The name of the default method.
inline constexpr const char* throng_name = "Throng";
// Larger cases leave out the all-pairs method.
inline constexpr std::size_t all_pairs_limit = 10000;

}  // namespace throng::bench
