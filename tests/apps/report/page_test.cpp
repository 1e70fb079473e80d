#include "apps/report/page.hpp"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
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
  const std::string svg = example().svg();
  EXPECT_EQ(occurrences(svg, "data-series="), 3u);
  EXPECT_NE(svg.find("data-series=\"Throng\""), std::string::npos);
  EXPECT_NE(svg.find("data-series=\"a &lt;rival&gt;\""), std::string::npos);
  EXPECT_NE(svg.find(">a &lt;rival&gt;</text>"), std::string::npos) << "the legend";
  EXPECT_NE(svg.find("time &amp; size"), std::string::npos);
  EXPECT_NE(svg.find(">10K</text>"), std::string::npos) << "a tick";
  // Three points joined by two lines; neither NaN nor, on a logarithmic axis, 0 is drawn.
  const std::size_t at = svg.find("data-series=\"Throng\"");
  EXPECT_EQ(occurrences(svg.substr(at, svg.find("stroke=", at) - at), "L"), 2u);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(Plot, HigherValuesLieHigher) {
  Plot p;
  p.series = {{"s", {0, 1}, {0, 10}, false, false}};
  const std::string svg = p.svg();
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  const std::size_t at = svg.find("d=\"", svg.find("data-series"));
  ASSERT_EQ(std::sscanf(svg.c_str() + at, "d=\"M%lf %lfL%lf %lf\"", &x0, &y0, &x1, &y1), 4);
  EXPECT_LT(x0, x1);
  EXPECT_GT(y0, y1);
}

TEST(Plot, DrawsAnEmptyPlot) {
  const std::string svg = Plot{}.svg();
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_NE(svg.find("</svg>"), std::string::npos);
}

Bars three_bars() {
  return {"sizes & more", "size", "boxes", {{"1 to 2", 1000}, {"<4", 1}, {"none", 0}}};
}

TEST(Bars, AreAsTallAsTheirValues) {
  const std::string svg = three_bars().svg();
  EXPECT_EQ(occurrences(svg, "data-bar="), 3u);
  EXPECT_NE(svg.find("data-bar=\"&lt;4\""), std::string::npos);
  EXPECT_NE(svg.find("sizes &amp; more"), std::string::npos);
  EXPECT_NE(svg.find(">1,000</text>"), std::string::npos) << "the value";
  double heights[3] = {};
  std::size_t at = 0;
  for (double& height : heights) {
    at = svg.find("height=", svg.find("data-bar=", at));
    ASSERT_EQ(std::sscanf(svg.c_str() + at, "height=\"%lf\"", &height), 1);
  }
  EXPECT_GT(heights[0], 100);
  EXPECT_NEAR(heights[1], heights[0] / 1000, 0.06);
  EXPECT_EQ(heights[2], 0);
  EXPECT_NE(Bars{}.svg().find("</svg>"), std::string::npos) << "no bars";
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
  EXPECT_EQ(occurrences(html, "<svg"), 1u);
  EXPECT_EQ(occurrences(html, "<table"), 1u);
  EXPECT_EQ(html.find("src="), std::string::npos);
  EXPECT_EQ(html.find("href="), std::string::npos);
}

TEST(WriteText, WritesWholeFilesOrNone) {
  const std::string path = "page_test.html";
  write_text(path, "hello");
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
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
