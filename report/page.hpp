// One self-contained HTML file: text, tables and plots, nothing fetched from anywhere.
#pragma once

#include <string>
#include <vector>

#include "report/plot.hpp"
#include "report/table.hpp"

namespace throng::report {

class Page {
 public:
  explicit Page(std::string title);

  // With an id, it can be linked to, and stands in contents().
  void heading(const std::string& text, const std::string& id = {});
  // Here the links to all headings with an id, those that come later among them.
  void contents();
  void paragraph(const std::string& text);
  void add(const Table& table);
  void add(const Plot& plot);
  // Side by side, where there is room.
  void add(const std::vector<Plot>& plots);

  std::string html() const;

 private:
  std::string title_, body_, links_;
};

// The file appears under its name when it is complete. Throws std::runtime_error that names the
// file and what went wrong; nothing is left behind then.
void write_text(const std::string& path, const std::string& text);

}  // namespace throng::report
