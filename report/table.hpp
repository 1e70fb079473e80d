// A table, for a terminal, a spreadsheet and a page.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace throng::report {

class Table {
 public:
  Table(std::string title, std::vector<std::string> columns);

  // As many cells as columns; missing ones are empty. Throws std::invalid_argument for more.
  void add_row(std::vector<std::string> cells);
  // A line under the table.
  void add_note(std::string note) { notes_.push_back(std::move(note)); }

  const std::string& title() const noexcept { return title_; }
  std::size_t rows() const noexcept { return rows_.size(); }

  // Columns aligned by blanks; a column of numbers to the right.
  std::string text() const;
  // RFC 4180: the columns' names, then the rows; no title, no notes.
  std::string csv() const;
  std::string html() const;

 private:
  std::vector<bool> numeric() const;

  std::string title_;
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::string> notes_;
};

// One field of a CSV line, quoted where it must be.
std::string escape_csv(const std::string& field);

}  // namespace throng::report
