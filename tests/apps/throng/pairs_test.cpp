// throng pairs: its output, text and files, for one set and two, one frame and many.
#include "tests/apps/throng/cli_test.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <utility>

namespace throng::test {
namespace {

class Pairs : public CliTest {
 protected:
  // Boxes 0, 1 and 3 in a row, each touching the next; 2 far away; 4 inverted.
  static std::vector<float> row() {
    return {0,  0,  0,  1, 1, 1, 1, 0, 0, 2, 1, 1, 90, 90, 90,
            91, 91, 91, 2, 1, 1, 3, 2, 2, 5, 5, 5, 4,  6,  6};
  }
  void write_row(const std::string& name) const { spill(at(name), npy("<f4", "5, 6", row())); }

  static std::uint64_t mix(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
  }
  static std::string checksum(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) {
    std::uint64_t sum = 0;
    for (const auto& [a, b] : pairs) sum += mix(std::uint64_t{a} << 32 | b);
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(sum));
    return text;
  }

  // The values of a pairs file, after a check of its header.
  std::vector<std::uint32_t> read_pairs(const std::string& name) const {
    const std::string bytes = slurp(at(name));
    if (bytes.size() < 10) return {};
    const std::size_t start =
        10 + static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
    const std::string header = bytes.substr(10, start - 10);
    EXPECT_NE(header.find("'<u4'"), std::string::npos) << header;
    std::vector<std::uint32_t> values((bytes.size() - start) / 4);
    if (!values.empty()) std::memcpy(values.data(), bytes.data() + start, values.size() * 4);
    std::string shape = std::to_string(values.size() / 2);
    shape.insert(0, 1, '(').append(", 2)");
    EXPECT_NE(header.find(shape), std::string::npos) << header << " wanted " << shape;
    return values;
  }
};

TEST_F(Pairs, json_has_all_fields) {
  write_row("row.npy");
  const auto j =
      json({"pairs", "--inverted", "inactive", at("row.npy"), "--repeat", "3", "--threads", "1"});
  EXPECT_EQ(j.at("n"), 5);
  EXPECT_EQ(j.at("pairs"), 2);
  EXPECT_EQ(j.at("checksum"), checksum({{0, 1}, {1, 3}}));
  EXPECT_EQ(j.at("inactive"), 1);
  EXPECT_EQ(j.at("backend"), "cpu");
  EXPECT_EQ(j.at("threads"), 1);
  EXPECT_TRUE(j.at("algorithm").is_string());
  EXPECT_TRUE(j.at("isa").is_string());
  EXPECT_GE(j.at("total_ms").get<double>(), 0);
  EXPECT_GT(j.at("first_ms").get<double>(), 0);
  EXPECT_TRUE(j.at("stages_ms").is_object());
  EXPECT_TRUE(j.at("stages_ms").contains("find"));
  EXPECT_TRUE(j.at("peak_bytes").is_number_unsigned());
  EXPECT_TRUE(j.at("comparisons").is_number_unsigned());
  EXPECT_GT(j.at("visited").get<std::uint64_t>(), 0u);
  EXPECT_NE(j.at("plan").at("reason"), "");
  EXPECT_FALSE(j.contains("frames"));
}

TEST_F(Pairs, text_output_agrees_with_json) {
  write_row("row.npy");
  const ProcessOutput output = run({"pairs", "--inverted", "inactive", at("row.npy")});
  EXPECT_EQ(output.status, 0) << output.err;
  for (const std::string& word : {std::string("5 boxes"), checksum({{0, 1}, {1, 3}})}) {
    EXPECT_NE(output.out.find(word), std::string::npos) << output.out;
  }
  EXPECT_EQ(output.err, "");  // no progress without a terminal
}

TEST_F(Pairs, chosen_algorithm_and_isa_are_used) {
  write_row("row.npy");
  for (const char* algorithm : {"all-pairs", "grid"}) {
    const auto j = json({"pairs", "--inverted", "inactive", at("row.npy"), "--algorithm", algorithm,
                         "--isa", "scalar"});
    EXPECT_EQ(j.at("algorithm"), algorithm);
    EXPECT_EQ(j.at("isa"), "scalar");
    EXPECT_EQ(j.at("pairs"), 2);
  }
}

TEST_F(Pairs, canonical_output_is_sorted_and_complete) {
  ASSERT_EQ(run({"scene", "uniform", "--objects", "5000", "-o", at("u.npy")}).status, 0);
  const auto j = json({"pairs", at("u.npy"), "-o", at("p.npy"), "--order", "canonical"});
  const auto values = read_pairs("p.npy");
  ASSERT_EQ(values.size(), 2 * j.at("pairs").get<std::size_t>());
  ASSERT_GT(values.size(), 1000u);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::size_t k = 0; k < values.size(); k += 2) pairs.emplace_back(values[k], values[k + 1]);
  for (std::size_t k = 1; k < pairs.size(); ++k) ASSERT_LT(pairs[k - 1], pairs[k]);
  EXPECT_EQ(j.at("checksum"), checksum(pairs));
}

TEST_F(Pairs, several_frames_are_listed_and_summed) {
  std::vector<float> two = row();
  std::vector<float> second = row();
  second[6] = 1.5f;  // box 1 moves away from box 0
  two.insert(two.end(), second.begin(), second.end());
  spill(at("two.npy"), npy("<f4", "2, 5, 6", two));
  const auto j =
      json({"pairs", "--inverted", "inactive", at("two.npy"), "-o", at("p.npy"), "--repeat", "2"});
  EXPECT_EQ(j.at("n"), 5);
  ASSERT_EQ(j.at("frames").size(), 2u);
  EXPECT_EQ(j.at("frames")[0].at("pairs"), 2);
  EXPECT_EQ(j.at("frames")[1].at("pairs"), 1);
  EXPECT_EQ(j.at("frames")[1].at("checksum"), checksum({{1, 3}}));
  EXPECT_TRUE(j.at("frames")[1].at("total_ms").is_number());
  EXPECT_EQ(j.at("pairs"), 3);
  EXPECT_EQ(j.at("checksum"), checksum({{0, 1}, {1, 3}, {1, 3}}));
  EXPECT_EQ(read_pairs("p.npy").size(), 6u);
}

TEST_F(Pairs, two_sets_with_filters_of_each) {
  write_row("a.npy");
  spill(at("b.npy"),
        npy("<f4", "2, 6", std::vector<float>{0.5f, 0, 0, 1.5f, 1, 1, 3, 2, 2, 4, 4, 4}));
  auto j = json({"pairs", "--inverted", "inactive", at("a.npy"), at("b.npy")});
  EXPECT_EQ(j.at("n"), 5);
  EXPECT_EQ(j.at("n_b"), 2);
  EXPECT_EQ(j.at("checksum"), checksum({{0, 0}, {1, 0}, {3, 1}}));
  spill(at("wa.npy"), npy("<i4", "5,", std::vector<std::int32_t>{7, 8, 7, -1, 7}));
  spill(at("wb.npy"), npy("<i4", "2,", std::vector<std::int32_t>{7, 3}));
  j = json({"pairs", "--inverted", "inactive", at("a.npy"), at("b.npy"), "--world", at("wa.npy"),
            "--world-b", at("wb.npy")});
  EXPECT_EQ(j.at("checksum"), checksum({{0, 0}, {3, 1}}));
}

TEST_F(Pairs, every_filter_of_one_set) {
  write_row("row.npy");
  using U = std::vector<std::uint32_t>;
  using I = std::vector<std::int32_t>;
  spill(at("group.npy"), npy("<u4", "5,", U{1, 1, 1, 4, 1}));
  spill(at("mask.npy"), npy("<u4", "5,", U{1, 1, 1, 1, 1}));
  spill(at("owner.npy"), npy("<i4", "5,", I{3, 3, 0, -1, 0}));
  spill(at("static.npy"), npy("|u1", "5,", std::vector<std::uint8_t>{0, 1, 1, 9, 1}));
  EXPECT_EQ(json({"pairs", "--inverted", "inactive", at("row.npy"), "--group", at("group.npy"),
                  "--mask", at("mask.npy")})
                .at("checksum"),
            checksum({{0, 1}}));
  EXPECT_EQ(json({"pairs", "--inverted", "inactive", at("row.npy"), "--owner", at("owner.npy")})
                .at("checksum"),
            checksum({{1, 3}}));
  EXPECT_EQ(json({"pairs", "--inverted", "inactive", at("row.npy"), "--static", at("static.npy")})
                .at("checksum"),
            checksum({{0, 1}}));
}

TEST_F(Pairs, margin_and_nan_and_rounding) {
  std::vector<double> boxes = {0, 0, 0, 1, 1, 1, 1.25, 0, 0, 2, 1, 1, 0, 0, NAN, 9, 9, 9};
  spill(at("d.npy"), npy("<f8", "3, 6", boxes));
  EXPECT_EQ(json({"pairs", at("d.npy"), "--nan", "inactive"}).at("pairs"), 0);
  const auto j = json({"pairs", at("d.npy"), "--nan", "inactive", "--margin", "0.125"});
  EXPECT_EQ(j.at("pairs"), 1);
  EXPECT_EQ(j.at("inactive"), 1);
  boxes[6] = 1.0000000001;  // not a float; its outward rounding touches box 0
  spill(at("d.npy"), npy("<f8", "3, 6", boxes));
  refuses({"pairs", at("d.npy"), "--nan", "inactive"}, {"d.npy", "float64", "float32"});
  EXPECT_EQ(json({"pairs", at("d.npy"), "--nan", "inactive", "--round", "outward"}).at("pairs"), 1);
}

// An inverted box is an error unless declared an empty slot, in memory and in slabs.
TEST_F(Pairs, inverted_boxes_are_refused) {
  write_row("row.npy");
  for (const bool capped : {false, true}) {
    std::vector<std::string> arguments = {"pairs", at("row.npy"), "-o", at("p.npy")};
    if (capped) arguments.insert(arguments.end(), {"--memory", "64M"});
    refuses(arguments, {"row.npy: 1 of 5 boxes have lower > upper, the first is box 4; for empty "
                        "slots use --inverted inactive"});
    EXPECT_EQ(slurp(at("p.npy")), "");
    arguments.insert(arguments.end(), {"--inverted", "inactive"});
    EXPECT_EQ(run(arguments).status, 0);
    std::filesystem::remove(at("p.npy"));
  }
  refuses({"pairs", at("row.npy"), at("row.npy")}, {"box 4", "the first set"});
  refuses({"pairs", at("row.npy"), "--inverted", "maybe"}, {"maybe"});
  // In VTK's order.
  spill(at("vtk.npy"), npy("<f4", "2, 6", std::vector<float>{5, 6, 1, 2, 0, 1, 7, 8, 2, 3, 0, 1}));
  refuses({"pairs", at("vtk.npy")}, {"xmin, xmax, ymin"});
  // Commands that inspect boxes accept them.
  EXPECT_EQ(run({"check", at("row.npy")}).status, 0);
  EXPECT_EQ(run({"explain", at("row.npy")}).status, 0);
}

TEST_F(Pairs, two_dimensions_and_corners_apart) {
  std::vector<float> flat, corners = row();
  corners.resize(24);
  for (std::size_t i = 0; i < 24; ++i)
    if (i % 3 != 2) flat.push_back(corners[i]);
  spill(at("flat.npy"), npy("<f4", "4, 4", flat));
  spill(at("pairs.npy"), npy("<f4", "4, 2, 2", flat));
  spill(at("corners.npy"), npy("<f4", "4, 2, 3", corners));
  for (const char* name : {"flat.npy", "pairs.npy", "corners.npy"}) {
    const auto j = json({"pairs", at(name)});
    EXPECT_EQ(j.at("n"), 4) << name;
    EXPECT_EQ(j.at("checksum"), checksum({{0, 1}, {1, 3}})) << name;
  }
}

TEST_F(Pairs, memory_cap_finds_the_same) {
  ASSERT_EQ(run({"scene", "pile", "--objects", "20K", "-o", at("p.npy")}).status, 0);
  const auto free = json({"pairs", at("p.npy")});
  const auto capped = json({"pairs", at("p.npy"), "--memory", "64M", "-o", at("pairs.npy")});
  EXPECT_EQ(capped.at("pairs"), free.at("pairs"));
  EXPECT_EQ(capped.at("checksum"), free.at("checksum"));
  const auto values = read_pairs("pairs.npy");
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::size_t k = 0; k < values.size(); k += 2) pairs.emplace_back(values[k], values[k + 1]);
  EXPECT_EQ(free.at("checksum"), checksum(pairs));
  refuses({"pairs", at("p.npy"), "--memory", "100"}, {"p.npy", "bytes"});
}

TEST_F(Pairs, no_boxes_and_one_box) {
  spill(at("none.npy"), npy("<f4", "0, 6", std::vector<float>{}));
  spill(at("one.npy"), npy("<f4", "1, 6", std::vector<float>{0, 0, 0, 1, 1, 1}));
  EXPECT_EQ(json({"pairs", at("none.npy"), "-o", at("p.npy")}).at("pairs"), 0);
  EXPECT_EQ(read_pairs("p.npy").size(), 0u);
  EXPECT_TRUE(exists("p.npy"));
  EXPECT_EQ(json({"pairs", at("one.npy")}).at("pairs"), 0);
}

TEST_F(Pairs, known_results_of_real_data) {
  const char* data = std::getenv("THRONG_DATA");
  if (!data) GTEST_SKIP() << "THRONG_DATA is not set";
  struct KnownResult {
    const char* file;
    std::size_t n, pairs;
    const char* checksum;
  };
  for (const KnownResult& expected_result :
       {KnownResult{"bounds01", 288, 650, "12029a319c1d783f"},
        KnownResult{"bounds02", 4221, 14969, "8a5b4278ca3373ad"},
        KnownResult{"cloth-funnel", 55864, 805888, "9e35f6c6f96859f1"}}) {
    const auto j = json({"pairs", std::string(data) + "/" + expected_result.file + ".npy"});
    EXPECT_EQ(j.at("n"), expected_result.n) << expected_result.file;
    EXPECT_EQ(j.at("pairs"), expected_result.pairs) << expected_result.file;
    EXPECT_EQ(j.at("checksum"), expected_result.checksum) << expected_result.file;
  }
}

}  // namespace
}  // namespace throng::test
