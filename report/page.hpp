// One self-contained HTML file: text, tables and plots, nothing fetched from anywhere.
#pragma once

#include <string>

#include "report/plot.hpp"
#include "report/table.hpp"

namespace throng::report {

class Page {
 public:
  explicit Page(std::string title);

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  void add(const Table& table);
  void add(const Plot& plot);

  std::string html() const;

 private:
  std::string title_, body_;
};

// Writes `text` under a temporary name beside `path` and renames it when it is complete. Throws
// std::runtime_error that names the file and what went wrong; nothing is left behind then.
void write_text(const std::string& path, const std::string& text);

}  // namespace throng::report
