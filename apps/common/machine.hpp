// The machine that produced a result.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace throng::common {

unsigned hardware_threads();
// "AMD EPYC 9654 96-Core Processor"; "unknown" where the system does not report it.
std::string processor_name();
// ("processor", "..."), ("hardware threads", "2"), ...: processor, memory, compiler, system, load,
// date.
std::vector<std::pair<std::string, std::string>> machine_description();

// The value of "key : value" in a file of /proc; empty if absent.
std::string proc_field(const std::string& file, const std::string& key);

}  // namespace throng::common
