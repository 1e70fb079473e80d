// The evaluation: every experiment at tiny sizes; its text matches its measurements.
#include "apps/paper/evaluation/experiments.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "apps/paper/evaluation/instructions.hpp"
#include "apps/paper/failure.hpp"

namespace throng::paper {
namespace {

Lab tiny(std::uint64_t up_to = 1000) {
  Setting setting;
  setting.quick = true;
  setting.up_to = up_to;
  return Lab(setting);
}

const Row* find(const Section& section, const std::string& what, std::uint64_t n,
                const std::string& quantity = {}) {
  for (const Row& row : section.rows) {
    if (row.what == what && row.n == n && (quantity.empty() || row.quantity == quantity))
      return &row;
  }
  return nullptr;
}

// All sections, run once.
const std::vector<Section>& sections() {
  static const std::vector<Section> all = evaluate(tiny(), {}, [](const Section&) {});
  return all;
}
const Section& section(const std::string& name) {
  for (const Section& s : sections()) {
    if (s.name == name) return s;
  }
  throw std::runtime_error("no section " + name);
}

TEST(Evaluation, TextMatchesMeasurements) {
  ASSERT_EQ(sections().size(), experiments().size());
  std::set<std::string> names;
  for (const Section& s : sections()) {
    EXPECT_TRUE(names.insert(s.name).second) << s.name;
    EXPECT_FALSE(s.title.empty()) << s.name;
    EXPECT_FALSE(s.finding.empty()) << s.name;
    EXPECT_FALSE(s.rows.empty() && s.tables.empty()) << s.name;
    for (const Row& row : s.rows) {
      // A row without a measurement gives the reason.
      EXPECT_TRUE(row.measured || !row.measured_text.empty() || !row.found.empty())
          << s.name << ": " << row.what << " " << row.n;
      if (row.measured) {
        EXPECT_TRUE(std::isfinite(*row.measured)) << s.name << ": " << row.what;
        if (row.unit == "ms") {
          EXPECT_GT(*row.measured, 0) << s.name << ": " << row.what;
        }
      }
    }
  }
  EXPECT_TRUE(disagreements(sections()).empty());
}

TEST(Evaluation, WorkedExamplesAreExact) {
  const Section& s = section("examples");
  for (const char* what : {"thread 71452, float32 root", "thread 71452, exact integers",
                           "thread 71452, Carmack, 2 steps, repaired"}) {
    ASSERT_NE(find(s, what, 1000), nullptr) << what;
    EXPECT_EQ(find(s, what, 1000)->measured_text, "(75, 303)") << what;
  }
  EXPECT_EQ(find(s, "thread 46108, Lomont, 2 steps, repaired", 1000)->measured_text, "(48, 285)");
  EXPECT_EQ(find(s, "the bit of pair 19", 7)->measured_text, "bit 3 of byte 2");
  EXPECT_EQ(find(s, "number of the last pair", 1000)->measured_text, "499499");
}

// Table 3 to its printed digits where a definition matches, and reported where none does.
TEST(Evaluation, TableThreeAgreesToItsDigits) {
  const Section s = table3(tiny(1000000));
  std::size_t agree = 0;
  for (const Row& row : s.rows) agree += row.unit == "%" && row.found.rfind("agrees", 0) == 0;
  EXPECT_EQ(agree, 15u);  // of sixteen up to a million
  const Row* odd = find(s, "Lomont, 3 steps", 1000000);
  ASSERT_NE(odd, nullptr);
  EXPECT_EQ(odd->paper_text, "0.0111");
  EXPECT_NEAR(*odd->measured, 0.0110, 1e-9);
  EXPECT_NE(odd->found.find("i = 1 .. N"), std::string::npos) << odd->found;
  EXPECT_NEAR(*find(s, "Carmack, 2 steps", 1000)->measured, 2.9, 1e-9);
  EXPECT_NEAR(*find(s, "Carmack, 4 steps beyond 3", 1000000)->measured, 0, 1e-9);
}

TEST(Evaluation, RepairLimitsAreExact) {
  const Section& s = section("repairs");
  EXPECT_EQ(*find(s, "Carmack, 2 steps, repaired", 45)->measured, 0);
  EXPECT_EQ(*find(s, "float32", 0)->measured, 4098);
  EXPECT_EQ(*find(s, "float32, radicand in floating point, repaired", 0)->measured, 5794);
  EXPECT_EQ(*find(s, "carmack, 1 step, repaired", 0)->measured, 643);
  EXPECT_EQ(find(s, "float64", 117440514)->measured_text, "wrong");
}

// Rows for each number that the paper prints for up to a thousand objects.
TEST(Evaluation, PrintedNumbersHaveACounterpart) {
  const auto pairs_of_numbers = [](const char* name) {
    std::size_t count = 0;
    for (const Row& row : section(name).rows) count += row.paper && row.measured;
    return count;
  };
  EXPECT_EQ(pairs_of_numbers("table2"),
            3u);  // mapping, lazy, their ratio; the sequential ratio is for larger n
  EXPECT_EQ(pairs_of_numbers("table5"), 8u);  // two sizes, bytes and bits, kernel and output
  EXPECT_EQ(pairs_of_numbers("table6"),
            6u);  // four stages, and the library next to the total, twice
  EXPECT_EQ(pairs_of_numbers("table7"), 4u);  // two sizes, with and without
  EXPECT_EQ(*find(section("table2"), "lazy", 1000)->paper, 0.25);
  EXPECT_EQ(*find(section("table5"), "one byte", 1000, "output")->paper, 842.75);
  EXPECT_EQ(*find(section("table7"), "with grid, X = 8", 1000)->paper, 1.840);
  EXPECT_EQ(*find(section("scenes"), "n-body, 300 spheres and 4 cones", 304)->paper, 0.41);
}

TEST(Evaluation, ReportsTheRace) {
  const Row* racy = find(section("table5"), "one bit, racy as printed", 1000, "kernel");
  const Row* exact = find(section("table5"), "one bit, ballot", 1000, "kernel");
  ASSERT_NE(racy, nullptr);
  ASSERT_NE(exact, nullptr);
  EXPECT_LT(*racy->pairs, *exact->pairs);
  EXPECT_NE(racy->found.find("loses"), std::string::npos) << racy->found;
}

TEST(Evaluation, ReportsDifferentPairs) {
  Section made("table2", "");
  Row row = plain_row("one", 10, "", "ms");
  row.checksum = 1;
  row.pairs = 1;
  made.rows.push_back(row);
  EXPECT_TRUE(disagreements({made}).empty());
  row.what = "other";
  row.checksum = 2;
  made.rows.push_back(row);
  ASSERT_EQ(disagreements({made}).size(), 1u);
  EXPECT_NE(disagreements({made})[0].find("other"), std::string::npos);
  made.rows.back().what = "other, racy";
  EXPECT_TRUE(disagreements({made}).empty());
}

TEST(Evaluation, SentencesFollowTheNumbers) {
  Row row = plain_row("", 1, "", "ms");
  EXPECT_EQ(speed_sentence(row), "");
  row.paper = 10;
  row.measured = 2;
  EXPECT_EQ(speed_sentence(row), "5.00x faster than the paper's hardware");
  EXPECT_DOUBLE_EQ(*row.ratio(), 0.2);
  row.measured = 30;
  EXPECT_EQ(speed_sentence(row), "3.00x slower than the paper's hardware");
  row.measured = 10.1;
  EXPECT_EQ(speed_sentence(row), "as fast as the paper's hardware");
}

TEST(Evaluation, UnknownExperimentIsRefused) {
  try {
    evaluate(tiny(), {"table9"}, [](const Section&) {});
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_NE(std::string(failure.what()).find("'table9'"), std::string::npos);
    EXPECT_NE(std::string(failure.what()).find("table7"), std::string::npos);
  }
}

// Tags nest correctly, and every link has its target.
TEST(Evaluation, ThePageIsWellFormedAndComplete) {
  const std::string html = page_of(tiny(), sections()).html();
  static const std::set<std::string> single = {"meta", "rect", "circle", "path", "!doctype", "!--"};
  std::vector<std::string> open;
  for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at + 1)) {
    const std::size_t end = html.find('>', at);
    ASSERT_NE(end, std::string::npos);
    std::string tag = html.substr(at + 1, end - at - 1);
    if (tag.back() == '/' || tag.rfind("!", 0) == 0) continue;
    tag = tag.substr(0, tag.find_first_of(" \n"));
    if (tag[0] == '/') {
      ASSERT_FALSE(open.empty()) << tag;
      ASSERT_EQ(open.back(), tag.substr(1));
      open.pop_back();
    } else if (single.count(tag) == 0) {
      open.push_back(tag);
    }
  }
  EXPECT_TRUE(open.empty());
  for (const Section& s : sections()) {
    EXPECT_NE(html.find("id=\"" + s.name + "\""), std::string::npos) << s.name;
    EXPECT_NE(html.find("href=\"#" + s.name + "\""), std::string::npos) << s.name;
  }
  EXPECT_EQ(html.find("http-equiv"), std::string::npos);
  EXPECT_EQ(html.find(" src="), std::string::npos) << "nothing is fetched";
  EXPECT_EQ(html.find("nan"), std::string::npos);
}

TEST(Evaluation, CsvHasAllRowsInFull) {
  const std::string csv = csv_of(sections()).csv();
  std::size_t rows = 0, lines = 0, fields = 1;
  bool quoted = false;
  for (const Section& s : sections()) rows += s.rows.size();
  for (std::size_t i = 0; i < csv.size(); ++i) {
    if (csv[i] == '"') quoted = !quoted;
    if (quoted) continue;
    if (csv[i] == ',') ++fields;
    if (csv[i] == '\n') {
      EXPECT_EQ(fields, 12u) << "line " << lines;
      fields = 1;
      ++lines;
    }
  }
  EXPECT_EQ(lines, rows + 1);
  EXPECT_EQ(
      csv.rfind("experiment,what,n,quantity,unit,device,paper,measured,ratio,pairs,checksum,found",
                0),
      0u);
}

TEST(Instructions, AreCountedOneByOne) {
  const auto count = [](std::uint64_t rounds) {
    return count_instructions([rounds] {
      volatile std::uint64_t x = 0;
      for (std::uint64_t i = 0; i < rounds; ++i) x = x + i;
    });
  };
  const auto none = count(0), few = count(100), many = count(300);
  if (!none || !few || !many) GTEST_SKIP() << "this system does not allow tracing";
  EXPECT_GE(*few - *none, 200u);
  EXPECT_NEAR(static_cast<double>(*many - *none) / static_cast<double>(*few - *none), 3, 0.1);
}

}  // namespace
}  // namespace throng::paper
