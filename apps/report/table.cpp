#include "apps/report/table.hpp"

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "apps/report/format.hpp"

namespace throng::report {
namespace {

// Characters on screen: bytes of UTF-8 that do not continue one.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

std::string padded(const std::string& text, std::size_t to, bool right) {
  const std::string padding(to - std::min(to, width(text)), ' ');
  return right ? padding + text : text + padding;
}

// Sentences may wrap, other cells may not.
bool is_sentence(const std::string& text) { return width(text) > 48; }

bool looks_numeric(const std::string& text) {
  if (is_sentence(text)) return false;  // "110 tests per box, where 20 to 40 are usual: ..."
  return std::isdigit(static_cast<unsigned char>(text[0])) ||
         ((text[0] == '-' || text[0] == '+' || text[0] == '.') &&
          (text.size() == 1 || std::isdigit(static_cast<unsigned char>(text[1]))));
}

}  // namespace

Table::Table(std::string title, std::vector<std::string> columns)
    : title_(std::move(title)), columns_(std::move(columns)) {}

void Table::add_row(std::vector<std::string> cells) {
  if (cells.size() > columns_.size()) {
    throw std::invalid_argument("table '" + title_ + "': a row of " + std::to_string(cells.size()) +
                                " cells for " + std::to_string(columns_.size()) + " columns");
  }
  cells.resize(columns_.size());
  rows_.push_back(std::move(cells));
}

std::vector<bool> Table::numeric() const {
  std::vector<bool> result(columns_.size());
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    bool any = false, all = true;
    for (const auto& row : rows_) {
      if (row[c].empty()) continue;
      any = true;
      all = all && looks_numeric(row[c]);
    }
    result[c] = any && all;
  }
  return result;
}

bool Table::has_header() const {
  return std::any_of(columns_.begin(), columns_.end(), [](const std::string& column) {
    return column.find_first_not_of(' ') != std::string::npos;
  });
}

std::string Table::text() const {
  std::vector<std::size_t> widths;
  for (const auto& column : columns_) widths.push_back(width(column));
  for (const auto& row : rows_)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], width(row[c]));
  const std::vector<bool> right = numeric();

  std::string out = title_.empty() ? "" : title_ + "\n";
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (c != 0) text += "  ";
      text += padded(cells[c], widths[c], right[c]);
    }
    text.erase(text.find_last_not_of(' ') + 1);
    out += text + "\n";
  };
  const bool headed = has_header();
  if (headed) line(columns_);
  std::size_t total = columns_.empty() ? 0 : 2 * (columns_.size() - 1);
  for (const std::size_t w : widths) total += w;
  if (headed || !title_.empty()) out += std::string(total, '-') + "\n";
  for (const auto& row : rows_) line(row);
  for (const auto& note : notes_) out += "  " + note + "\n";
  return out;
}

std::string escape_csv(const std::string& field) {
  if (field.find_first_of(",\"\r\n") == std::string::npos) return field;
  std::string out = "\"";
  for (const char c : field) {
    if (c == '"') out += '"';
    out += c;
  }
  out += '"';
  return out;
}

std::string Table::csv() const {
  std::string out;
  const auto line = [&](const std::vector<std::string>& cells) {
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (c != 0) out += ',';
      out += escape_csv(cells[c]);
    }
    out += "\r\n";
  };
  line(columns_);
  for (const auto& row : rows_) line(row);
  return out;
}

std::string Table::html() const {
  const std::vector<bool> right = numeric();
  std::string out = "<figure class=\"table\">\n";
  if (!title_.empty()) out += "<figcaption>" + escape_html(title_) + "</figcaption>\n";
  out += "<div class=\"wide\"><table>\n<thead>";
  const auto line = [&](const std::vector<std::string>& cells, const char* tag) {
    out += "<tr>";
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const char* kind = is_sentence(cells[c]) ? " class=\"words\">"
                         : right[c]            ? " class=\"n\">"
                                               : ">";
      out += std::string("<") + tag + kind + escape_html(cells[c]) + "</" + tag + ">";
    }
    out += "</tr>\n";
  };
  if (has_header()) line(columns_, "th");
  out += "</thead>\n<tbody>\n";
  for (const auto& row : rows_) line(row, "td");
  out += "</tbody></table></div>\n";
  for (const auto& note : notes_) out += "<p class=\"note\">" + escape_html(note) + "</p>\n";
  return out + "</figure>\n";
}

}  // namespace throng::report
