// Refused input: the messages, and the files left on disk.
#include <throng/cuda.hpp>

#include "support/sanitized.hpp"
#include "tests/apps/throng/cli_test.hpp"

#include <cmath>
#include <cstdint>

namespace throng::test {
namespace {

class BadInput : public CliTest {
 protected:
  static std::vector<float> boxes(std::size_t n) {
    std::vector<float> values;
    for (std::size_t i = 0; i < n; ++i) {
      const float x = static_cast<float>(i);
      values.insert(values.end(), {x, 0, 0, x + 1, 1, 1});
    }
    return values;
  }
  void write_good(std::size_t n = 10) const {
    spill(at("good.npy"), npy("<f4", std::to_string(n) + ", 6", boxes(n)));
  }
};

TEST_F(BadInput, missing_file) {
  refuses({"pairs", at("nowhere.npy")}, {"nowhere.npy"});
  refuses({"check", at("nowhere.npy")}, {"nowhere.npy"});
  refuses({"pairs", folder_.string()}, {folder_.string()});
}

TEST_F(BadInput, empty_short_truncated_and_garbage) {
  write_good();
  const std::string good = slurp(at("good.npy"));
  for (const std::size_t size : {std::size_t{0}, std::size_t{4}, std::size_t{9}, std::size_t{60},
                                 std::size_t{128}, good.size() - 1}) {
    spill(at("cut.npy"), good.substr(0, size));
    refuses({"pairs", at("cut.npy")}, {"cut.npy"});
  }
  std::string garbage;
  for (int i = 0; i < 4000; ++i) garbage += static_cast<char>(i * 37 + i / 7);
  spill(at("garbage.npy"), garbage);
  refuses({"pairs", at("garbage.npy")}, {"garbage.npy"});
  spill(at("header.npy"), good.substr(0, 10) + garbage);
  refuses({"pairs", at("header.npy")}, {"header.npy"});
}

TEST_F(BadInput, wrong_type_and_shape) {
  const std::vector<std::int32_t> whole(60);
  spill(at("int.npy"), npy("<i4", "10, 6", whole));
  refuses({"pairs", at("int.npy")}, {"int.npy", "i4", "float32"});
  spill(at("flat.npy"), npy("<f4", "60,", boxes(10)));
  refuses({"pairs", at("flat.npy")}, {"flat.npy", "60", "(n, 6)"});
  spill(at("seven.npy"), npy("<f4", "10, 7", std::vector<float>(70)));
  refuses({"pairs", at("seven.npy")}, {"seven.npy", "7", "(n, 6)"});
}

TEST_F(BadInput, a_header_that_claims_2_to_the_40_takes_no_memory) {
  const std::vector<float> few = boxes(10);
  spill(at("claim.npy"), npy("<f4", "1099511627776, 6", few));
  Limits limits;
#if !THRONG_SANITIZED                             // which itself takes terabytes of address space
  limits.address_space = std::uint64_t{4} << 30;  // 24 TiB does not fit
#endif
  refuses({"pairs", at("claim.npy")}, {"claim.npy"}, limits);
  spill(at("claim.npy"), npy("<f4", "1099511627776, 1099511627776, 6", few));
  refuses({"pairs", at("claim.npy")}, {"claim.npy"}, limits);
}

TEST_F(BadInput, nan_boxes_with_index_and_count) {
  auto values = boxes(10);
  values[7 * 6 + 2] = NAN;
  values[9 * 6 + 5] = NAN;
  spill(at("nan.npy"), npy("<f4", "10, 6", values));
  for (const char* command : {"pairs", "check", "explain"}) {
    refuses({command, at("nan.npy")}, {"nan.npy: 2 boxes have a NaN, the first is box 7; fix them, "
                                       "or treat them as inactive by --nan inactive\n"});
  }
  EXPECT_EQ(run({"pairs", at("nan.npy"), "--nan", "inactive"}).status, 0);
}

TEST_F(BadInput, filters_of_wrong_length_type_or_range) {
  write_good(10);
  spill(at("short.npy"), npy("<u4", "9,", std::vector<std::uint32_t>(9)));
  refuses({"pairs", at("good.npy"), "--group", at("short.npy")}, {"short.npy", "9", "10"});
  spill(at("float.npy"), npy("<f4", "10,", std::vector<float>(10)));
  refuses({"pairs", at("good.npy"), "--owner", at("float.npy")}, {"float.npy", "f4"});
  std::vector<std::int32_t> worlds(10);
  worlds[4] = -2;
  spill(at("world.npy"), npy("<i4", "10,", worlds));
  refuses({"pairs", at("good.npy"), "--world", at("world.npy")}, {"world.npy", "-2", "4"});
  std::vector<std::int64_t> large(10);
  large[3] = std::int64_t{1} << 40;
  spill(at("large.npy"), npy("<i8", "10,", large));
  refuses({"pairs", at("good.npy"), "--mask", at("large.npy")}, {"large.npy", "1099511627776"});
  refuses({"pairs", at("good.npy"), "--mask", at("nowhere.npy")}, {"nowhere.npy"});
  spill(at("ten.npy"), npy("<u4", "10,", std::vector<std::uint32_t>(10)));
  refuses({"pairs", at("good.npy"), "--mask-b", at("ten.npy")}, {"-b", "second"});
}

TEST_F(BadInput, two_sets_of_different_frames) {
  spill(at("two.npy"), npy("<f4", "2, 5, 6", boxes(10)));
  spill(at("five.npy"), npy("<f4", "5, 2, 6", boxes(10)));
  refuses({"pairs", at("two.npy"), at("five.npy")}, {"five.npy", "5", "2"});
}

TEST_F(BadInput, options) {
  write_good();
  if (!cuda::available().ok())
    refuses({"pairs", at("good.npy"), "--backend", "cuda"},
            {"--backend cuda: ", "GPU", "; use --backend cpu"});
  for (const char* command : {"pairs", "check", "explain"})
    for (const char* margin : {"-1", "1e39", "nan", "inf", "2m"})
      refuses({command, at("good.npy"), "--margin", margin},
              {"--margin: found '" + std::string(margin) + "', wanted 0 to 3.4e38\n"});
  for (const char* share : {"2", "-1", "nan", "half"})
    refuses({"scene", "uniform", "--objects", "5", "--moving", share, "-o", at("x.npy")},
            {"--moving: found '" + std::string(share) + "', wanted 0 to 1\n"});
  refuses({"pairs", at("good.npy"), "--algorithm", "magic"}, {"magic"});
  refuses({"pairs", at("good.npy"), "--memory", "lots"}, {"lots", "bytes"});
  refuses({"pairs", at("good.npy"), "--memory", "-5"}, {"-5"});
  refuses({"pairs", at("good.npy"), "--repeat", "0"}, {"--repeat: found '0', wanted 1 to 1000000"});
  refuses({"pairs", at("good.npy"), "--repeat", "2M"},
          {"--repeat: found '2M', wanted 1 to 1000000"});
  refuses({"pairs", at("good.npy"), "--threads", "-1"},
          {"--threads: found '-1', wanted 0 to 4294967295"});
  refuses({"demo", "--threads", "x"}, {"--threads: found 'x', wanted 0 to 4294967295"});
  refuses({"check", at("good.npy"), "--frames", "0"},
          {"--frames: found '0', wanted 1 to 1000000000"});
  EXPECT_EQ(run({"pairs", at("good.npy"), "--repeat", "1e1", "--threads", "1"}).status, 0);
  refuses({"pairs"}, {"A"});
  refuses({"juggle"}, {"juggle"});
  refuses({"--foo"}, {"throng: found '--foo', wanted --help, --version or a command: demo, pairs"});
  refuses({"scene", "volcano", "--objects", "10", "-o", at("x.npy")}, {"volcano", "uniform"});
  refuses({"scene", "uniform", "--objects", "many", "-o", at("x.npy")}, {"many"});
  refuses({"scene", "uniform", "--objects", "0", "-o", at("x.npy")}, {"0"});
  refuses({"scene", "uniform", "--objects", "5", "--moving", "2", "-o", at("x.npy")}, {"2"});
  refuses({"scene", "uniform", "--objects", "5", "--frames", "17M", "-o", at("x.npy")},
          {"--frames: found '17M', wanted 1 to 16777216"});
  for (const char* density : {"-3", "0", "1e300", "inf", "nan", "1e-10", "much"}) {
    refuses({"scene", "uniform", "--objects", "5", "--density", density, "-o", at("x.npy")},
            {"--density: found '" + std::string(density) + "', wanted 1e-9 to 1000000\n"});
  }
  for (const char* seed : {"-1", "18446744073709551616"}) {
    refuses({"scene", "uniform", "--objects", "5", "--seed", seed, "-o", at("x.npy")},
            {"--seed: found '" + std::string(seed) + "', wanted 0 to 18446744073709551615\n"});
  }
  EXPECT_FALSE(exists("x.npy"));
}

TEST_F(BadInput, outputs_that_are_inputs) {
  write_good();
  spill(at("world.npy"), npy("<i4", "10,", std::vector<std::int32_t>(10)));
  const std::string before = slurp(at("good.npy")) + slurp(at("world.npy"));
  refuses({"pairs", at("good.npy"), "-o", at("good.npy")},
          {"found the file of A as that of -o, too; wanted another name"});
  refuses({"pairs", at("good.npy"), "-o", at("none/../good.npy")}, {"the file of A"});
#ifndef _WIN32  // where links need a right
  std::filesystem::create_symlink("good.npy", at("link.npy"));
  refuses({"pairs", at("link.npy"), "-o", at("good.npy")}, {"the file of A"});
  refuses({"pairs", at("good.npy"), "-o", at("link.npy")}, {"the file of A"});
  refuses({"pairs", at("link.npy"), at("good.npy"), "-o", at("good.npy")}, {"the file of A"});
#endif
  refuses({"pairs", at("good.npy"), "--world", at("world.npy"), "-o", at("world.npy")},
          {"the file of --world as that of -o"});
  refuses({"explain", at("good.npy"), "--html", at("good.npy")}, {"the file of A", "--html"});
  EXPECT_EQ(slurp(at("good.npy")) + slurp(at("world.npy")), before);
}

TEST_F(BadInput, empty_arguments) {
  write_good();
  refuses({"pairs", at("good.npy"), "-o", ""}, {"--output: found an empty argument"});
  refuses({"pairs", at("good.npy"), "--world", ""}, {"--world: found an empty argument"});
  refuses({"pairs", at("good.npy"), "--world="}, {"--world"});
  refuses({"pairs", ""}, {"A: found an empty argument"});
  refuses({"demo", "-o", ""}, {"--output: found an empty argument"});
  refuses({"scene", "uniform", "--objects", "", "-o", at("x.npy")}, {"--objects"});
}

#ifdef __linux__
TEST_F(BadInput, isa_of_another_kind_of_processor) {
  write_good();
#if defined(__x86_64__)
  refuses({"pairs", at("good.npy"), "--isa", "neon"}, {"--isa: found neon, ", "; use auto\n"});
#else
  refuses({"pairs", at("good.npy"), "--isa", "avx2"}, {"--isa: found avx2, ", "; use auto\n"});
#endif
}

TEST_F(BadInput, output_in_missing_folder_or_full_disk) {
  write_good(4000);
  refuses({"pairs", at("good.npy"), "-o", at("no/such/folder/p.npy")}, {"no/such/folder/p.npy"});
  refuses({"scene", "uniform", "--objects", "100", "-o", at("no/u.npy")}, {"no/u.npy"});
  Limits limits;
  limits.file_size = 8192;  // acts like a full disk
  const std::size_t before = files();
  refuses({"pairs", at("good.npy"), "-o", at("p.npy")}, {"p.npy"}, limits);
  refuses({"pairs", at("good.npy"), "-o", at("p.npy"), "--memory", "64M"}, {"p.npy"}, limits);
  refuses({"scene", "uniform", "--objects", "1000", "-o", at("u.npy")}, {"u.npy"}, limits);
  EXPECT_EQ(files(), before) << "something is left behind";
  // The older file stays.
  spill(at("p.npy"), "old");
  refuses({"pairs", at("good.npy"), "-o", at("p.npy")}, {"p.npy"}, limits);
  EXPECT_EQ(slurp(at("p.npy")), "old");
}

TEST_F(BadInput, standard_output_on_a_full_disk) {
  write_good();
  Limits limits;
  limits.out_path = "/dev/full";
  const ProcessOutput output = run({"pairs", at("good.npy")}, limits);
  EXPECT_EQ(output.status, 2);
  EXPECT_NE(output.err.find("standard output"), std::string::npos) << output.err;
}

TEST_F(BadInput, out_of_memory_names_the_bytes) {
#if THRONG_SANITIZED
  GTEST_SKIP() << "sanitizers need the whole address space";
#endif
  Limits limits;
  limits.address_space = std::uint64_t{1} << 30;
  // 40,000 identical boxes have 800 million pairs: 6.4 GB.
  std::vector<float> same;
  for (int i = 0; i < 40000; ++i) same.insert(same.end(), {0, 0, 0, 1, 1, 1});
  spill(at("same.npy"), npy("<f4", "40000, 6", same));
  refuses({"pairs", at("same.npy")},
          {"same.npy", "memory", "bytes", "; bound it by --memory, or split the boxes\n"}, limits);
}
#endif

}  // namespace
}  // namespace throng::test
