// The results of one experiment: rows with the paper's numbers, plots and text; and their
// conversion to a table, a CSV file and a part of a page.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/report/page.hpp"
#include "apps/report/plot.hpp"
#include "apps/report/table.hpp"

namespace throng::paper {

struct Row {
  std::string what;      // which variant or scene
  std::uint64_t n = 0;   // of objects or of roots; 0: there is none
  std::string quantity;  // "kernel", "total"; may be empty
  std::string unit;      // "ms", "%", "bytes"; empty for plain numbers and words
  std::string device;    // empty: arithmetic, the same on every machine
  std::optional<double> paper, measured;
  std::string paper_text, measured_text;         // if not a number
  std::optional<std::uint64_t> pairs, checksum;  // what was found, for comparing runs
  std::string found;                             // one sentence, from the measurement

  // measured / paper, if both exist.
  std::optional<double> ratio() const;
};

// A result of arithmetic, the same on every device.
Row plain_row(std::string what, std::uint64_t n, std::string quantity, std::string unit);

struct Section {
  Section(std::string name_, std::string title_)
      : name(std::move(name_)), title(std::move(title_)) {}

  std::string name;     // for --only and file names
  std::string title;    // heading
  std::string finding;  // one or two sentences: the result
  std::vector<std::string> words;
  std::vector<Row> rows;
  std::vector<report::Plot> plots;
  std::vector<report::Table> tables;  // printed with the rows
};

// 0.23 of unit "ms" as in the tables; "-" for nothing.
std::string show(const std::optional<double>& value, const std::string& unit);

// Columns what, n, quantity, unit, device, paper, measured, ratio, found; columns that are empty in
// all rows are left out.
report::Table table_of(const Section& section);
// All columns, numbers in full: experiment, what, n, quantity, unit, device, paper, measured,
// ratio, pairs, checksum, found.
report::Table csv_of(const std::vector<Section>& sections);
void add_to(report::Page& page, const Section& section);

// How many times faster or slower than the paper, as a sentence; empty without both numbers.
std::string speed_sentence(const Row& row);

}  // namespace throng::paper
