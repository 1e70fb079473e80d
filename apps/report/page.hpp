// One self-contained HTML file: text, tables and plots; it loads nothing.
#pragma once

#include <string>
#include <vector>

#include "apps/report/plot.hpp"
#include "apps/report/table.hpp"

namespace throng::report {

class Page {
 public:
  explicit Page(std::string title);

  // With an id, links can point to it, and contents() lists it.
  void heading(const std::string& text, const std::string& id = {});
  // Inserts links to all headings with an id, later ones included.
  void contents();
  void paragraph(const std::string& text);
  void add(const Table& table);
  void add(const Plot& plot);
  // Side by side, if wide enough.
  void add(const std::vector<Plot>& plots);
  void add(const std::vector<Bars>& plots);

  std::string html() const;

 private:
  std::string title_, body_, links_;
};

// The file gets its name when complete. Throws std::runtime_error that names the file and the
// problem; then no file remains.
void write_text(const std::string& path, const std::string& text);

}  // namespace throng::report
