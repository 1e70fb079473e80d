#include "apps/report/page.hpp"

#include <cstring>

#include "apps/report/format.hpp"
#include "apps/scenes/output_file.hpp"

namespace throng::report {
namespace {

// The eight colours of series are those of Okabe and Ito, distinct for people with any kind of
// colour vision: darker where the page is light, lighter where it is dark.
const char* const style = R"(
:root { color-scheme: light dark; --page: #fafaf8; --panel: #ffffff; --head: #f1f1ed; --hover: #eef4ff;
  --ink: #22262b; --muted: #59636e; --rule: #d9d9d4; --fine: #efefec; --link: #0066a8;
  --c0: #0072b2; --c1: #d55e00; --c2: #00845f; --c3: #c25a92; --c4: #b87800; --c5: #20262c;
  --c6: #767676; --c7: #8f8400; }
@media screen and (prefers-color-scheme: dark) { :root { --page: #14171b; --panel: #1b1e23; --head: #262a31;
  --hover: #232b38; --ink: #d8dde3; --muted: #9aa4af; --rule: #3a4048; --fine: #272b32; --link: #6cb6ff;
  --c0: #56b4e9; --c1: #ff8a3d; --c2: #2fc79a; --c3: #e39ac4; --c4: #f0b429; --c5: #f0f3f6;
  --c6: #a8adb4; --c7: #d6c93a; } }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--page); margin: 0; }
main { max-width: 1180px; margin: 0 auto; padding: 24px 20px 80px; overflow-wrap: break-word; }
h1 { font-size: 28px; line-height: 1.25; margin: 8px 0 16px; } h2 { font-size: 20px; margin: 36px 0 8px; }
a { color: var(--link); }
.plots { display: flex; flex-wrap: wrap; gap: 0 28px; align-items: flex-start; }
figure { margin: 14px 0 22px; min-width: 0; max-width: 100%; }
figcaption { font-weight: 600; margin-bottom: 6px; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; background: var(--panel); font-variant-numeric: tabular-nums; font-size: 13px; }
th, td { padding: 4px 10px; border-bottom: 1px solid var(--rule); text-align: left; white-space: nowrap; }
th { background: var(--head); } .n { text-align: right; }
td.words { white-space: normal; min-width: 260px; max-width: 520px; }
nav ul { columns: 2 260px; padding-left: 18px; }
tbody tr:hover { background: var(--hover); } .note { margin: 4px 0; color: var(--muted); font-size: 13px; }
.plot > .wide > svg { display: block; max-width: 100%; height: auto; background: var(--panel);
  font: 13px system-ui, sans-serif; }
.label { fill: var(--ink); } .tick { fill: var(--muted); }
.grid { stroke: var(--rule); } .fine { stroke: var(--fine); } .axis { stroke: var(--muted); fill: none; }
.line { fill: none; stroke: currentColor; } .c0, .c1, .c2, .c3, .c4, .c5, .c6, .c7 { fill: currentColor; }
.c0 { color: var(--c0); } .c1 { color: var(--c1); } .c2 { color: var(--c2); } .c3 { color: var(--c3); }
.c4 { color: var(--c4); } .c5 { color: var(--c5); } .c6 { color: var(--c6); } .c7 { color: var(--c7); }
.bound { color: var(--muted); }
.legend { list-style: none; margin: 6px 0 0; padding: 0; display: flex; flex-wrap: wrap; gap: 2px 18px;
  max-width: 520px; font-size: 13px; }
.legend svg { margin-right: 6px; } .emphasis { font-weight: 600; }
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
void Page::add(const Plot& plot) { body_ += plot.html(); }
void Page::add(const std::vector<Plot>& plots) {
  body_ += "<div class=\"plots\">\n";
  for (const Plot& plot : plots) body_ += plot.html();
  body_ += "</div>\n";
}

void Page::add(const std::vector<Bars>& plots) {
  body_ += "<div class=\"plots\">\n";
  for (const Bars& bars : plots) body_ += bars.html();
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
