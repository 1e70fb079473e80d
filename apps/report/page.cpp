#include "apps/report/page.hpp"

#include <cstring>

#include "apps/report/format.hpp"
#include "apps/scenes/output_file.hpp"

namespace throng::report {
namespace {

const char* const style = R"(
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fafaf8; margin: 0; }
main { max-width: 1180px; margin: 0 auto; padding: 24px 20px 80px; }
h1 { font-size: 28px; margin: 8px 0 16px; } h2 { font-size: 20px; margin: 36px 0 8px; }
.plots { display: flex; flex-wrap: wrap; gap: 16px; }
svg { max-width: 100%; height: auto; border: 1px solid #e4e4e0; border-radius: 6px; }
figure { margin: 14px 0 22px; } figcaption { font-weight: 600; margin-bottom: 6px; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; background: #fff; font-variant-numeric: tabular-nums; font-size: 13px; }
th, td { padding: 4px 10px; border-bottom: 1px solid #e9e9e5; text-align: left; white-space: nowrap; }
th { background: #f1f1ed; position: sticky; top: 0; } .n { text-align: right; }
td.words { white-space: normal; min-width: 260px; max-width: 520px; }
nav ul { columns: 2; padding-left: 18px; } nav a { color: #0072b2; }
tbody tr:hover { background: #f6f8ff; } .note { margin: 4px 0; color: #555; font-size: 13px; }
)";

// Escaped text never contains it.
const char* const contents_placeholder = "<!-- contents -->";

}  // namespace

Page::Page(std::string title) : title_(std::move(title)) {}

void Page::heading(const std::string& text, const std::string& id) {
  if (id.empty()) {
    body_ += "<h2>" + escape_html(text) + "</h2>\n";
    return;
  }
  body_ += "<h2 id=\"" + escape_html(id) + "\">" + escape_html(text) + "</h2>\n";
  links_ += "<li><a href=\"#" + escape_html(id) + "\">" + escape_html(text) + "</a></li>\n";
}
void Page::contents() { body_ += contents_placeholder; }
void Page::paragraph(const std::string& text) { body_ += "<p>" + escape_html(text) + "</p>\n"; }
void Page::add(const Table& table) { body_ += table.html(); }
void Page::add(const Plot& plot) { body_ += plot.svg(); }
void Page::add(const std::vector<Plot>& plots) {
  body_ += "<div class=\"plots\">\n";
  for (const Plot& plot : plots) body_ += plot.svg();
  body_ += "</div>\n";
}

void Page::add(const std::vector<Bars>& plots) {
  body_ += "<div class=\"plots\">\n";
  for (const Bars& bars : plots) body_ += bars.svg();
  body_ += "</div>\n";
}

std::string Page::html() const {
  const std::string title = escape_html(title_);
  std::string body = body_;
  if (const std::size_t at = body.find(contents_placeholder); at != std::string::npos) {
    body.replace(at, std::strlen(contents_placeholder), "<nav><ul>\n" + links_ + "</ul></nav>\n");
  }
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         title + "</title>\n<style>" + style + "</style></head>\n<body><main>\n<h1>" + title +
         "</h1>\n" + body + "</main></body></html>\n";
}

void write_text(const std::string& path, const std::string& text) {
  scenes::OutputFile file(path);
  file.write(text.data(), text.size());
  file.commit();
}

}  // namespace throng::report
