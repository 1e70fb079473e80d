#include "apps/common/failure_text.hpp"

#include <string_view>

#include <fmt/format.h>

namespace throng::common {
namespace {

// Empty: keep the library's own hint.
std::string_view fix_hint(Status status, const HintOptions& has) {
  switch (status) {
    case Status::nan_box:
      return has.nan ? "fix them, or treat them as inactive by --nan inactive" : "fix them";
    case Status::inverted_box:
      return has.inverted ? "for empty slots use --inverted inactive" : "fix them";
    case Status::out_of_memory:
      return has.memory ? "bound it by --memory, or split the boxes" : "split the boxes";
    case Status::no_device:
      return has.backend ? "use --backend cpu; a GPU takes a build with THRONG_CUDA=ON"
                         : "a GPU takes a build with THRONG_CUDA=ON";
    case Status::device_error:
      return has.backend ? "run it again, or use --backend cpu" : "run it again";
    default:
      return {};
  }
}

}  // namespace

std::string failure_text(const Result& result, const HintOptions& has) {
  if (result.status == Status::unsupported_isa && !has.isa.empty()) {
    return fmt::format("--isa: found {}, which this processor or build does not have; use auto",
                       has.isa);
  }
  const std::string_view said = result.message[0] ? result.message : to_string(result.status);
  const std::string_view own = fix_hint(result.status, has);
  if (own.empty()) return std::string(said);
  // A message is the problem, a semicolon, and the fix.
  return fmt::format("{}; {}", said.substr(0, said.rfind("; ")), own);
}

}  // namespace throng::common
