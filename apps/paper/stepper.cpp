#include "apps/paper/stepper.hpp"

#include <fmt/format.h>

#include "apps/paper/failure.hpp"
#include "apps/paper/host.hpp"
#include "apps/paper/mapping_timing.hpp"
#include "apps/paper/root_timing.hpp"
#include "apps/paper/steps.hpp"
#include "apps/report/format.hpp"

namespace throng::paper {

void require_memory(std::uint64_t bytes, std::uint64_t limit, const std::string& what,
                    const std::string& remedy) {
  if (bytes <= limit) return;
  throw TooLarge(fmt::format("{} takes {} bytes, and {} are allowed; {}", what,
                             report::format_count(bytes), report::format_count(limit), remedy));
}

std::unique_ptr<Stepper> make_host_stepper(const Job& job) { return make_stepper<HostDevice>(job); }

RootTime time_roots_on_host(RootKind kind, int steps, std::uint64_t count, int repeat,
                            unsigned threads) {
  HostDevice device(threads);
  return time_roots(device, kind, steps, count, repeat);
}

MappingTime time_mapping_on_host(const Variant& variant, std::uint64_t n, int repeat,
                                 unsigned threads) {
  HostDevice device(threads);
  return time_mapping(device, variant, n, repeat);
}

}  // namespace throng::paper
