// Numbers as people read them.
#pragma once

#include <cstdint>
#include <string>

namespace throng::report {

// Three significant digits: 0.0073, 0.78, 9.90, 147, 2920.
std::string format_ms(double ms);
// 1234567 as "1,234,567".
std::string format_count(std::uint64_t count);
// 1000, 100000, 2500000 as "1K", "100K", "2.5M"; others as format_count.
std::string format_short(std::uint64_t count);
// "640 B", "1.5 KiB", "23 MiB".
std::string format_bytes(double bytes);
// 17.3 as "17.3x".
std::string format_ratio(double ratio);

std::string escape_html(const std::string& text);

}  // namespace throng::report
