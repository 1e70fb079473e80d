// The tables, rows and pages of throng-bench.
#include "bench/report.hpp"

#include <gtest/gtest.h>

#include "bench/throng_methods.hpp"

namespace throng::bench {
namespace {

Measurement measurement(const char* scene, std::size_t objects, const char* method, Origin origin,
                        double ms) {
  Measurement m;
  m.scene = scene;
  m.objects = objects;
  m.method = method;
  m.origin = origin;
  m.threads = 1;
  m.measured = true;
  m.agrees = true;
  m.ms = m.least_ms = ms;
  m.samples = 5;
  m.pairs = 7;
  return m;
}

// The points of a series in the plot of that title.
std::size_t points(const std::string& html, const std::string& title, const std::string& series) {
  const std::size_t plot = html.find("<figcaption>" + title + "</figcaption>");
  if (plot == std::string::npos) return 0;
  const std::string text = html.substr(plot, html.find("</figure>", plot) - plot);
  const std::size_t at = text.find("data-series=\"" + series + "\"");
  if (at == std::string::npos) return 0;
  const std::size_t path = text.find(" d=\"", at) + 4;
  std::size_t count = 0;
  for (std::size_t k = path; text[k] != '"'; ++k) count += text[k] == 'M' || text[k] == 'L';
  return count;
}

TEST(BenchPage, ACaseThatThrongWasNotMeasuredOnHasNoRatio) {
  Findings f;
  f.measurements = {measurement("pile", 1000, throng_name, Origin::throng, 1),
                    measurement("pile", 1000, "Embree", Origin::other_library, 4),
                    measurement("pile", 2000, "Embree", Origin::other_library, 9),
                    measurement("rods", 1000, "Embree", Origin::other_library, 3)};
  const std::string html = page(f).html();
  EXPECT_EQ(points(html, "pile: time per frame", "Embree"), 2u);
  EXPECT_EQ(points(html, "pile: time relative to Throng&#39;s", "Embree"), 1u);
  EXPECT_EQ(points(html, "rods: time per frame", "Embree"), 1u);
  EXPECT_EQ(points(html, "rods: time relative to Throng&#39;s", "Embree"), 0u);
  EXPECT_EQ(case_table(f, "rods", 1000).csv().find(",x"), std::string::npos);
  EXPECT_EQ(summary_table(f, 10).rows(), 1u);
}

TEST(BenchPage, WithoutAnyMeasurement) {
  Findings f;
  EXPECT_NE(page(f).html().find("</html>"), std::string::npos);
  Measurement failed = measurement("pile", 1000, "Embree", Origin::other_library, 0);
  failed.measured = false;
  failed.note = "too slow";
  f.measurements = {failed};
  EXPECT_NE(page(f).html().find("not run: too slow"), std::string::npos);
}

}  // namespace
}  // namespace throng::bench
