#include "bench/gpu/measurement.hpp"

#include <cstdio>

#include "apps/report/format.hpp"

namespace throng::bench::gpu {
namespace {

std::string count(std::uint64_t value) { return value ? std::to_string(value) : ""; }
std::string checksum_of(const Measurement& m) {
  return m.checksum_by.empty() ? "" : hex(m.checksum);
}
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

report::Table table(const std::string& title, const std::vector<Measurement>& measurements) {
  report::Table t(title, {"case", "objects", "setting", "pairs", "checksum", "median ms", "min ms",
                          "back to back ms", "pairs/box", "bytes/box", "rate", "", "note"});
  for (const Measurement& m : measurements)
    t.add_row({m.what, count(m.objects), m.setting, count(m.pairs), checksum_of(m),
               ms(m.time.median_ms), ms(m.time.min_ms), ms(m.time.back_to_back_ms),
               short_number(m.pairs_per_box), short_number(m.bytes_per_box), short_number(m.rate),
               m.rate_metric, m.note});
  return t;
}

std::vector<Row> rows(const std::vector<Measurement>& measurements) {
  std::vector<Row> all;
  for (const Measurement& m : measurements) {
    Row row;
    row.kind = "gpu-" + m.experiment;
    row.name = m.what;
    row.objects = m.objects;
    row.setting = m.setting;
    row.library = "Throng";
    row.threads = 0;
    const auto add = [&](const std::string& metric, double value) {
      if (value == 0) return;
      row.metric = metric;
      row.value = value;
      all.push_back(row);
    };
    row.least = m.time.min_ms;
    row.samples = m.time.runs;
    row.note = m.note;
    if (m.pairs) row.found = m.pairs;
    if (!m.checksum_by.empty()) row.checksum = m.checksum;
    add("ms", m.time.median_ms);
    row.least = 0;
    row.samples = 0;
    row.note.clear();
    row.found.reset();
    row.checksum.reset();
    add("back_to_back_ms", m.time.back_to_back_ms);
    add("bytes_per_box", m.bytes_per_box);
    add("driver_bytes_per_box", m.driver_bytes_per_box);
    add(m.rate_metric, m.rate);
  }
  return all;
}

}  // namespace throng::bench::gpu
