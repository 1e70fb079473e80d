#include "apps/report/page.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include <gtest/gtest.h>

namespace throng::report {
namespace {

std::size_t occurrences(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++count;
  return count;
}

Plot example() {
  Plot p;
  p.title = "time & size";
  p.x_label = "boxes";
  p.y_label = "ms";
  p.log_x = p.log_y = true;
  p.series = {{"Throng", {1e3, 1e4, 1e5}, {0.01, 0.1, 1}, true, false},
              {"a <rival>", {1e3, 1e4, 1e5}, {0.3, 5, NAN}, false, false},
              {"floor", {1e3, 1e5}, {0, 0.3}, false, true}};
  return p;
}

TEST(Plot, ShowsEverySeriesWithItsPoints) {
  const std::string html = example().html();
  EXPECT_EQ(occurrences(html, "data-series="), 3u);
  EXPECT_NE(html.find("data-series=\"Throng\""), std::string::npos);
  EXPECT_NE(html.find("data-series=\"a &lt;rival&gt;\""), std::string::npos);
  EXPECT_NE(html.find("</svg>a &lt;rival&gt;</li>"), std::string::npos) << "the legend";
  EXPECT_NE(html.find("time &amp; size"), std::string::npos);
  EXPECT_NE(html.find(">10K</text>"), std::string::npos) << "a tick";
  // Three points joined by two lines; neither NaN nor, on a logarithmic axis, 0 is drawn.
  const std::size_t at = html.find("data-series=\"Throng\"");
  EXPECT_EQ(occurrences(html.substr(at, html.find("stroke-width=", at) - at), "L"), 2u);
  EXPECT_EQ(html.find("nan"), std::string::npos);
  EXPECT_EQ(html.find("inf"), std::string::npos);
}

TEST(Plot, HigherValuesLieHigher) {
  Plot p;
  p.series = {{"s", {0, 1}, {0, 10}, false, false}};
  const std::string html = p.html();
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  const std::size_t at = html.find("d=\"", html.find("data-series"));
  ASSERT_EQ(std::sscanf(html.c_str() + at, "d=\"M%lf %lfL%lf %lf\"", &x0, &y0, &x1, &y1), 4);
  EXPECT_LT(x0, x1);
  EXPECT_GT(y0, y1);
}

TEST(Plot, DrawsAnEmptyPlot) {
  const std::string html = Plot{}.html();
  EXPECT_EQ(html.find("nan"), std::string::npos);
  EXPECT_NE(html.find("</svg>"), std::string::npos);
}

Bars three_bars() {
  return {"sizes & more", "size", "boxes", {{"1 to 2", 1000}, {"<4", 1}, {"none", 0}}};
}

TEST(Bars, AreAsTallAsTheirValues) {
  const std::string html = three_bars().html();
  EXPECT_EQ(occurrences(html, "data-bar="), 3u);
  EXPECT_NE(html.find("data-bar=\"&lt;4\""), std::string::npos);
  EXPECT_NE(html.find("sizes &amp; more"), std::string::npos);
  EXPECT_NE(html.find(">1,000</text>"), std::string::npos) << "the value";
  double heights[3] = {};
  std::size_t at = 0;
  for (double& height : heights) {
    at = html.find("height=", html.find("data-bar=", at));
    ASSERT_EQ(std::sscanf(html.c_str() + at, "height=\"%lf\"", &height), 1);
  }
  EXPECT_GT(heights[0], 100);
  EXPECT_NEAR(heights[1], heights[0] / 1000, 0.06);
  EXPECT_EQ(heights[2], 0);
  EXPECT_NE(Bars{}.html().find("</svg>"), std::string::npos) << "no bars";
}

TEST(Bars, TextIsAlignedAndFits) {
  EXPECT_EQ(bar_text(three_bars(), 27),
            "sizes & more\n"
            "  size  boxes\n"
            "1 to 2  1,000  ############\n"
            "    <4      1  #\n"
            "  none      0\n");
}

TEST(Page, IsSelfContained) {
  Page page("Results <1>");
  page.heading("One & two");
  page.paragraph("a < b");
  page.add(example());
  Table t("table", {"x"});
  t.add_row({"1"});
  page.add(t);
  const std::string html = page.html();
  EXPECT_NE(html.find("<title>Results &lt;1&gt;</title>"), std::string::npos);
  EXPECT_NE(html.find("One &amp; two"), std::string::npos);
  EXPECT_NE(html.find("a &lt; b"), std::string::npos);
  EXPECT_EQ(occurrences(html, "<figure class=\"plot\""), 1u);
  EXPECT_EQ(occurrences(html, "<table"), 1u);
  EXPECT_EQ(html.find("src="), std::string::npos);
  EXPECT_EQ(html.find("href="), std::string::npos);
}

// Of the rule `:root` that starts after `at`: names and values, "#rrggbb".
std::map<std::string, std::string> colours_after(const std::string& html, std::size_t at) {
  at = html.find(":root", at);
  const std::string rule = html.substr(at, html.find('}', at) - at);
  std::map<std::string, std::string> colours;
  for (std::size_t k = rule.find("--"); k != std::string::npos; k = rule.find("--", k + 1))
    colours[rule.substr(k + 2, rule.find(':', k) - k - 2)] = rule.substr(rule.find('#', k), 7);
  return colours;
}

// As WCAG 2 defines them.
double luminance(const std::string& colour) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double x = std::stoi(colour.substr(1 + 2 * k, 2), nullptr, 16) / 255.0;
    const double weights[] = {0.2126, 0.7152, 0.0722};
    sum += weights[k] * (x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4));
  }
  return sum;
}
double contrast(const std::string& a, const std::string& b) {
  const double x = luminance(a), y = luminance(b);
  return (std::max(x, y) + 0.05) / (std::min(x, y) + 0.05);
}

TEST(Page, HasContrastOnLightAndOnDarkScreens) {
  const std::string html = Page("page").html();
  const std::size_t dark = html.find("(prefers-color-scheme: dark)");
  ASSERT_NE(dark, std::string::npos);
  for (const std::size_t at : {std::size_t{0}, dark}) {
    auto colour = colours_after(html, at);
    EXPECT_EQ(luminance(colour.at("page")) < 0.1, at == dark);
    for (const char* behind : {"page", "panel", "head", "hover"})
      for (const char* words : {"ink", "muted", "link"})
        EXPECT_GE(contrast(colour.at(words), colour.at(behind)), 4.5) << words << ", " << behind;
    for (int k = 0; k < 8; ++k)
      for (const char* behind : {"page", "panel"}) {
        const std::string series = "c" + std::to_string(k);
        EXPECT_GE(contrast(colour.at(series), colour.at(behind)), 3) << series << ", " << behind;
      }
  }
}

TEST(WriteText, WritesWholeFilesOrNone) {
  const std::string path = "page_test.html";
  write_text(path, "hello");
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  file.close();
  EXPECT_EQ(text.str(), "hello");
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  std::filesystem::remove(path);
  try {
    write_text("no_such_folder/page.html", "x");
    FAIL() << "a folder that is not there";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("no_such_folder/page.html"), std::string::npos);
  }
}

}  // namespace
}  // namespace throng::report
