#include "bench/gpu/row.hpp"

#include <cstdio>

#include "report/format.hpp"

namespace throng::bench::gpu {
namespace {

// Enough digits to compute with; empty for nothing.
std::string number(double value) {
  if (value == 0) return "";
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}
std::string count(std::uint64_t value) { return value ? std::to_string(value) : ""; }
std::string sum_of(const Row& r) { return r.checksum_by.empty() ? "" : hex(r.checksum); }
std::string ms(double value) { return value > 0 ? report::format_ms(value) : ""; }
std::string short_number(double value) {
  if (value == 0) return "";
  char text[32];
  std::snprintf(text, sizeof text, value < 10 ? "%.2f" : "%.1f", value);
  return text;
}

}  // namespace

std::string hex(std::uint64_t checksum) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(checksum));
  return text;
}

report::Table table(const std::string& title, const std::vector<Row>& rows) {
  report::Table t(title, {"what", "objects", "order", "pairs", "checksum", "median ms", "min ms",
                          "in a row ms", "pairs/box", "bytes/box", "rate", "", "note"});
  for (const Row& r : rows)
    t.add_row({r.what, count(r.objects), r.order, count(r.pairs), sum_of(r), ms(r.time.median_ms),
               ms(r.time.min_ms), ms(r.time.in_a_row_ms), short_number(r.pairs_per_box),
               short_number(r.bytes_per_box), short_number(r.rate), r.rate_unit, r.note});
  return t;
}

std::string csv(const std::vector<Row>& rows) {
  report::Table t("", {"experiment", "what", "objects", "order", "pairs", "checksum", "checksum_by",
                       "median_ms", "min_ms", "in_a_row_ms", "pairs_per_box", "bytes_per_box",
                       "driver_bytes_per_box", "rate", "rate_unit", "runs", "device", "note"});
  for (const Row& r : rows)
    t.add_row({r.experiment, r.what, std::to_string(r.objects), r.order, std::to_string(r.pairs),
               sum_of(r), r.checksum_by, number(r.time.median_ms), number(r.time.min_ms),
               number(r.time.in_a_row_ms), number(r.pairs_per_box), number(r.bytes_per_box),
               number(r.driver_bytes_per_box), number(r.rate), r.rate_unit, count(r.time.runs),
               r.device, r.note});
  return t.csv();
}

}  // namespace throng::bench::gpu
