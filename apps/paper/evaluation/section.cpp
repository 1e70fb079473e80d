#include "apps/paper/evaluation/section.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "apps/report/format.hpp"

namespace throng::paper {
namespace {

std::string full(const std::optional<double>& value) {
  return value ? fmt::format("{:.9g}", *value) : std::string();
}

std::string paper_of(const Row& row) {
  if (!row.paper_text.empty() || !row.paper) return row.paper_text;
  return fmt::format("{:.7g}", *row.paper);  // as printed
}

std::string measured_of(const Row& row) {
  return row.measured_text.empty() ? show(row.measured, row.unit) : row.measured_text;
}

}  // namespace

std::optional<double> Row::ratio() const {
  if (!paper || !measured || *paper == 0) return {};
  return *measured / *paper;
}

Row plain_row(std::string what, std::uint64_t n, std::string quantity, std::string unit) {
  Row row;
  row.what = std::move(what);
  row.n = n;
  row.quantity = std::move(quantity);
  row.unit = std::move(unit);
  return row;
}

std::string show(const std::optional<double>& value, const std::string& unit) {
  if (!value) return "";
  const double v = *value;
  if (unit == "%") return v == 0 ? "0" : fmt::format("{:.4f}", v);
  const bool whole = v == std::floor(v) && std::fabs(v) < 0x1p53;
  const bool time = unit == "ms" || unit == "us" || unit == "ns a pair";
  if (!whole || time) return report::format_ms(v);
  return v < 0 ? fmt::format("{:.0f}", v) : report::format_count(static_cast<std::uint64_t>(v));
}

report::Table table_of(const Section& section) {
  struct Column {
    std::string name;
    std::vector<std::string> cells;
    bool used = false;
  };
  std::vector<Column> columns;
  const auto add = [&](const char* name, const auto& text, bool always = false) {
    Column column{name, {}, always};
    for (const Row& row : section.rows) {
      column.cells.push_back(text(row));
      column.used = column.used || !column.cells.back().empty();
    }
    columns.push_back(std::move(column));
  };
  add("what", [](const Row& row) { return row.what; });
  add("n", [](const Row& row) { return row.n == 0 ? "" : report::format_count(row.n); });
  add("quantity", [](const Row& row) { return row.quantity; });
  add("unit", [](const Row& row) { return row.unit; });
  add("device", [](const Row& row) { return row.device; });
  add("paper", paper_of, true);
  add("measured", measured_of, true);
  add("ratio", [](const Row& row) {
    const std::optional<double> ratio = row.ratio();
    return ratio ? report::format_ms(*ratio) : std::string();
  });
  add("found", [](const Row& row) { return row.found; });
  std::erase_if(columns, [](const Column& column) { return !column.used; });

  std::vector<std::string> names;
  names.reserve(columns.size());
  for (const Column& column : columns) names.push_back(column.name);
  report::Table table(section.title, names);
  for (std::size_t i = 0; i < section.rows.size(); ++i) {
    std::vector<std::string> cells;
    cells.reserve(columns.size());
    for (const Column& column : columns) cells.push_back(column.cells[i]);
    table.add_row(cells);
  }
  return table;
}

report::Table csv_of(const std::vector<Section>& sections) {
  report::Table table("", {"experiment", "what", "n", "quantity", "unit", "device", "paper",
                           "measured", "ratio", "pairs", "checksum", "found"});
  for (const Section& section : sections) {
    for (const Row& row : section.rows) {
      table.add_row({section.name, row.what, row.n == 0 ? "" : std::to_string(row.n), row.quantity,
                     row.unit, row.device,
                     row.paper_text.empty() ? full(row.paper) : row.paper_text,
                     row.measured_text.empty() ? full(row.measured) : row.measured_text,
                     full(row.ratio()), row.pairs ? std::to_string(*row.pairs) : "",
                     row.checksum ? fmt::format("{:016x}", *row.checksum) : "", row.found});
    }
  }
  return table;
}

void add_to(report::Page& page, const Section& section) {
  page.heading(section.title, section.name);
  if (!section.finding.empty()) page.paragraph(section.finding);
  for (const std::string& text : section.words) page.paragraph(text);
  if (!section.plots.empty()) page.add(section.plots);
  if (!section.rows.empty()) page.add(table_of(section));
  for (const report::Table& table : section.tables) page.add(table);
}

std::string speed_sentence(const Row& row) {
  const std::optional<double> ratio = row.ratio();
  if (!ratio || *ratio <= 0) return "";
  if (*ratio > 0.9 && *ratio < 1.1) return "as fast as the paper's hardware";
  return *ratio < 1 ? report::format_ratio(1 / *ratio) + " faster than the paper's hardware"
                    : report::format_ratio(*ratio) + " slower than the paper's hardware";
}

}  // namespace throng::paper
