#include "apps/throng/report_json.hpp"

#include <fmt/format.h>

namespace throng::cli {

std::string hex(std::uint64_t value) { return fmt::format("{:016x}", value); }

void add_plan_and_times(nlohmann::ordered_json& json, const Plan& plan, double total_ms,
                        double first_ms, const StageTimes& stages) {
  json["backend"] = to_string(plan.backend);
  json["algorithm"] = to_string(plan.algorithm);
  json["isa"] = to_string(plan.isa);
  json["threads"] = plan.threads;
  json["total_ms"] = total_ms;
  json["first_ms"] = first_ms;
  json["stages_ms"] = {{"plan", stages.plan_ms},
                       {"bin", stages.bin_ms},
                       {"find", stages.find_ms},
                       {"order", stages.order_ms},
                       {"total", stages.total_ms}};
}

}  // namespace throng::cli
