// Parts that the JSON outputs of several commands share.
#pragma once

#include <cstdint>
#include <string>

#include <throng/options.hpp>

#include <nlohmann/json.hpp>

namespace throng::cli {

// 16 digits.
std::string hex(std::uint64_t value);

// Adds the backend, algorithm, instruction set, threads and times of a search.
void add_plan_and_times(nlohmann::ordered_json& json, const Plan& plan, double total_ms,
                        double first_ms, const StageTimes& stages);

}  // namespace throng::cli
