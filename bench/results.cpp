#include "bench/results.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <iterator>

#include <fmt/format.h>

#include <throng/version.hpp>

#include "apps/common/machine.hpp"
#include "apps/common/median.hpp"
#include "apps/report/format.hpp"
#include "apps/report/page.hpp"
#include "apps/scenes/output_file.hpp"

namespace throng::bench {
namespace {

std::string today() {
  char date[16];
  const std::time_t now = std::time(nullptr);
  std::strftime(date, sizeof date, "%Y-%m-%d", std::gmtime(&now));
  return date;
}

// "AMD EPYC 9654" on 2 hardware threads is "amd-epyc-9654-2".
std::string machine_name() {
  std::string name;
  for (const char c : common::processor_name()) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u))
      name += static_cast<char>(std::tolower(u));
    else if (!name.empty() && name.back() != '-')
      name += '-';
  }
  if (!name.empty() && name.back() != '-') name += '-';
  return name + std::to_string(common::hardware_threads());
}

// Integers in full, other values with six significant digits; empty if there is no value.
std::string number(double value) {
  const bool integer = value == std::floor(value) && std::fabs(value) < 1e15;
  return integer ? fmt::format("{:.0f}", value) : fmt::format("{:.6g}", value);
}
std::string number_or_empty(double value) { return value == 0 ? "" : number(value); }

std::string readable(const Row& r) {
  const auto ends_in = [&](const std::string& unit) {
    return r.metric.size() > unit.size() &&
           r.metric.compare(r.metric.size() - unit.size(), unit.size(), unit) == 0;
  };
  if (ends_in("_bytes")) return report::format_bytes(r.value);
  if (ends_in("_count")) return report::format_count(static_cast<std::uint64_t>(r.value));
  return report::format_ms(r.value);
}

}  // namespace

void set_samples(Row& row, const std::vector<double>& samples) {
  if (samples.empty()) return;
  row.value = common::median(samples);
  row.least = *std::min_element(samples.begin(), samples.end());
  row.samples = samples.size();
}

std::string csv(const std::vector<Row>& rows, const OutputOptions& options) {
  const std::string machine = options.machine.empty() ? machine_name() : options.machine;
  const std::string commit = options.commit.empty() ? THRONG_VERSION : options.commit;
  const std::string date = today();
  std::string text =
      "machine,date,commit,kind,case,objects,setting,library,threads,metric,value,least,samples,"
      "found,checksum,note\n";
  for (const Row& r : rows) {
    const std::string fields[] = {machine,
                                  date,
                                  commit,
                                  r.kind,
                                  r.name,
                                  std::to_string(r.objects),
                                  r.setting,
                                  r.library,
                                  std::to_string(r.threads),
                                  r.metric,
                                  number(r.value),
                                  number_or_empty(r.least),
                                  r.samples ? std::to_string(r.samples) : "",
                                  r.found ? std::to_string(*r.found) : "",
                                  r.checksum ? fmt::format("{:016x}", *r.checksum) : "",
                                  r.note};
    for (const std::string& field : fields) {
      text += report::escape_csv(field);
      text += &field == std::end(fields) - 1 ? '\n' : ',';
    }
  }
  return text;
}

report::Table table(const std::string& title, const std::vector<Row>& rows) {
  std::vector<std::string> metrics;
  for (const Row& r : rows)
    if (std::find(metrics.begin(), metrics.end(), r.metric) == metrics.end())
      metrics.push_back(r.metric);
  std::vector<std::string> columns = {"case", "objects", "setting", "library", "threads"};
  columns.insert(columns.end(), metrics.begin(), metrics.end());
  columns.emplace_back("found");
  report::Table t(title, columns);
  std::vector<std::vector<std::string>> lines;
  for (const Row& r : rows) {
    const std::vector<std::string> key = {r.name, report::format_short(r.objects), r.setting,
                                          r.library, r.threads ? std::to_string(r.threads) : ""};
    const bool same = !lines.empty() && std::equal(key.begin(), key.end(), lines.back().begin());
    if (!same) {
      lines.push_back(key);
      lines.back().resize(columns.size());
    }
    const auto column = std::find(metrics.begin(), metrics.end(), r.metric) - metrics.begin();
    lines.back()[key.size() + static_cast<std::size_t>(column)] = readable(r);
    if (r.found) lines.back().back() = report::format_count(*r.found);
  }
  for (std::vector<std::string>& line : lines) t.add_row(std::move(line));
  return t;
}

Results::Results(OutputOptions options) : options_(std::move(options)) {
  scenes::check_outputs({{"--csv", options_.csv}});
}

void Results::show(const std::string& title) {
  const std::vector<Row> fresh(rows_.begin() + static_cast<std::ptrdiff_t>(shown_), rows_.end());
  shown_ = rows_.size();
  if (!fresh.empty()) fmt::print("{}\n", table(title, fresh).text());
  std::fflush(stdout);
  if (!options_.csv.empty()) report::write_text(options_.csv, csv(rows_, options_));
}

}  // namespace throng::bench
