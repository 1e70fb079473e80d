// A table as terminal text, CSV and HTML.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace throng::report {

class Table {
 public:
  Table(std::string title, std::vector<std::string> columns);

  // One cell per column; missing ones are empty. Throws std::invalid_argument for more.
  void add_row(std::vector<std::string> cells);
  // Adds a note below the table.
  void add_note(std::string note) { notes_.push_back(std::move(note)); }

  const std::string& title() const noexcept { return title_; }
  std::size_t rows() const noexcept { return rows_.size(); }

  // Columns aligned by spaces; numeric columns to the right. No header if no column has a name.
  std::string text() const;
  // RFC 4180: the columns' names, then the rows; no title, no notes.
  std::string csv() const;
  std::string html() const;

 private:
  std::vector<bool> numeric() const;
  bool has_header() const;  // whether a column has a name

  std::string title_;
  std::vector<std::string> columns_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::string> notes_;
};

// One field of a CSV line, quoted if necessary.
std::string escape_csv(const std::string& field);

}  // namespace throng::report
