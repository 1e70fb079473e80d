#include "apps/report/table.hpp"

#include <gtest/gtest.h>

#include "apps/report/format.hpp"

namespace throng::report {
namespace {

TEST(Csv, QuotesIfNecessary) {
  EXPECT_EQ(escape_csv("plain"), "plain");
  EXPECT_EQ(escape_csv("a,b"), "\"a,b\"");
  EXPECT_EQ(escape_csv("say \"no\""), "\"say \"\"no\"\"\"");
  EXPECT_EQ(escape_csv("two\nlines"), "\"two\nlines\"");
  EXPECT_EQ(escape_csv("return\r"), "\"return\r\"");
}

TEST(Csv, ColumnsThenRows) {
  Table t("title, not printed", {"name", "ms"});
  t.add_row({"grid, boxes", "1.5"});
  t.add_row({"short"});
  EXPECT_EQ(t.csv(), "name,ms\r\n\"grid, boxes\",1.5\r\nshort,\r\n");
}

TEST(Table, RefusesARowThatIsTooLong) {
  Table t("t", {"a"});
  EXPECT_THROW(t.add_row({"1", "2"}), std::invalid_argument);
  EXPECT_EQ(t.rows(), 0u);
}

TEST(Table, TextAlignsNumbersRightAndWordsLeft) {
  Table t("", {"name", "n"});
  t.add_row({"\xc3\xa4", "7"});  // one character in two bytes
  t.add_row({"long name", "1,000"});
  EXPECT_EQ(t.text(),
            "name           n\n"
            "----------------\n"
            "\xc3\xa4              7\n"
            "long name  1,000\n");
}

TEST(Table, SentencesWrapAlthoughTheyStartWithANumber) {
  Table t("", {"advice", "n"});
  t.add_row({"110 tests per box, where 20 to 40 are usual: boxes are long", "7"});
  EXPECT_NE(t.html().find("<td class=\"words\">110"), std::string::npos) << t.html();
  EXPECT_NE(t.html().find("<td class=\"n\">7"), std::string::npos) << t.html();
}

TEST(Table, HasNoHeaderWithoutNames) {
  Table t("facts", {"", " "});
  t.add_row({"boxes", "7"});
  EXPECT_EQ(t.text(), "facts\n--------\nboxes  7\n");
  EXPECT_EQ(t.html().find("<th"), t.html().find("<thead>")) << t.html();
}

TEST(Table, HtmlEscapes) {
  Table t("a < b & c", {"<script>"});
  t.add_row({"\"quoted\" 'x'"});
  t.add_note("x > y");
  const std::string html = t.html();
  EXPECT_NE(html.find("a &lt; b &amp; c"), std::string::npos);
  EXPECT_NE(html.find("&lt;script&gt;"), std::string::npos);
  EXPECT_NE(html.find("&quot;quoted&quot; &#39;x&#39;"), std::string::npos);
  EXPECT_NE(html.find("x &gt; y"), std::string::npos);
  EXPECT_EQ(html.find("<script>"), std::string::npos);
}

TEST(Format, Numbers) {
  EXPECT_EQ(format_count(0), "0");
  EXPECT_EQ(format_count(999), "999");
  EXPECT_EQ(format_count(1234567), "1,234,567");
  EXPECT_EQ(format_short(100000), "100K");
  EXPECT_EQ(format_short(2500000), "2.5M");
  EXPECT_EQ(format_short(4097), "4,097");
  EXPECT_EQ(format_ms(0.00734), "0.0073");
  EXPECT_EQ(format_ms(9.996), "10.0");
  EXPECT_EQ(format_ms(9.904), "9.90");
  EXPECT_EQ(format_ms(146.7), "147");
  EXPECT_EQ(format_ms(2920.4), "2920");
  EXPECT_EQ(format_ms(0), "0");
  EXPECT_EQ(format_bytes(640), "640 B");
  EXPECT_EQ(format_bytes(1536), "1.5 KiB");
  EXPECT_EQ(format_bytes(24.0 * 1024 * 1024), "24 MiB");
  EXPECT_EQ(format_ratio(17.31), "17.3x");
}

}  // namespace
}  // namespace throng::report
