// throng-simulate as users run it, and through `throng simulate`.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <throng/find_pairs.hpp>

#include "apps/scenes/npy.hpp"
#include "tests/apps/throng/cli_test.hpp"

namespace throng::test {
namespace {

class Simulate : public CliTest {};

TEST_F(Simulate, prints_its_measurements) {
  const nlohmann::json j =
      json({"rain", "--objects", "200", "--steps", "150", "--shape", "rectangle", "--check"});
  EXPECT_EQ(j["scene"], "rain");
  EXPECT_EQ(j["shape"], "rectangle");
  EXPECT_EQ(j["objects"], 200);
  EXPECT_EQ(j["steps"], 150);
  EXPECT_EQ(j["broadphase"], "throng");
  EXPECT_GT(j["broad_phase_ms"], 0.0);
  EXPECT_GT(j["step_ms"], j["broad_phase_ms"]);
  EXPECT_GT(j["pairs"], 200);  // all overlap the plane
  EXPECT_GT(j["contacts"], 0);
  EXPECT_GE(j["deepest_penetration"], 0.0);
  EXPECT_GT(j["compared_pairs"], 150 * 200);
  EXPECT_EQ(j["missing"], 0);
  EXPECT_EQ(j["extra"], 0);
}

TEST_F(Simulate, every_broad_phase_and_a_table) {
  for (const char* phase : {"throng", "dbvt", "axis-sweep"}) {
    const ProcessOutput output =
        run({"column", "--objects", "100", "--steps", "20", "--broadphase", phase});
    EXPECT_EQ(output.status, 0) << output.err;
    EXPECT_EQ(output.err, "");  // no progress without a terminal
    for (const char* word : {"median ms", "broad phase", "points of contact", phase})
      EXPECT_NE(output.out.find(word), std::string::npos) << word << "\n" << output.out;
  }
}

TEST_F(Simulate, one_step_of_one_object) {
  const nlohmann::json j = json({"pile", "--objects", "1", "--steps", "1", "--shape", "sphere"});
  EXPECT_EQ(j["pairs"], 1);
}

TEST_F(Simulate, records_and_draws) {
  const nlohmann::json j = json({"pile", "--objects", "150", "--steps", "12", "--record",
                                 at("boxes.npy"), "--picture", at("last.png"), "--threads", "1"});
  const scenes::BoxFile file = scenes::read_boxes(at("boxes.npy"));
  EXPECT_EQ(file.frames, 12u);
  EXPECT_EQ(file.count, 150u);
  // The last frame's overlaps plus those with the plane, which is not recorded, are the cache's.
  EXPECT_EQ(find_pairs(Boxes(file.frame(11), file.count)).size() + 150, j["pairs"]);
  EXPECT_LT(file.frame(11)[149].lower.z, file.frame(0)[149].lower.z);  // it fell
  EXPECT_EQ(slurp(at("last.png")).substr(1, 3), "PNG");
  EXPECT_EQ(files(), 2u);
}

TEST_F(Simulate, bad_input) {
  refuses({}, {"scene is required"});
  refuses({"heap"}, {"SCENE", "'heap'", "column, pile, rain"});
  refuses({"pile", "--shape", "cone"}, {"--shape", "'cone'", "cube, sphere, rectangle"});
  refuses({"pile", "--broadphase", "sap"}, {"--broadphase", "'sap'", "throng, dbvt, axis-sweep"});
  for (const char* count : {"0", "-3", "1.5", "many", "17M", "1e400", "nan", ""})
    refuses({"pile", "--objects", count}, {"--objects"});
  for (const char* steps : {"0", "-1", "x"}) refuses({"pile", "--steps", steps}, {"--steps"});
  refuses({"pile", "--threads", "-1"}, {"--threads: found '-1', wanted 0 to 4294967295"});
  refuses({"pile", "--seed", "-1"}, {"--seed: found '-1', wanted 0 to 18446744073709551615"});
  refuses({"pile", "--record", at("none/boxes.npy")}, {"none", "which is not a folder"});
  refuses({"pile", "--picture", at("none/last.png")}, {"none", "which is not a folder"});
  refuses({"pile", "--record", at("one"), "--picture", at("one")},
          {"one file for both --record and --picture"});
  refuses({"pile", "rain"}, {"rain"});
  EXPECT_EQ(files(), 0u);
}

#ifndef _WIN32  // no limit on a file's size, and no such signals
TEST_F(Simulate, a_record_that_cannot_be_written_leaves_nothing) {
  Limits limits;
  limits.file_size = 100000;
  refuses({"pile", "--objects", "1000", "--steps", "10", "--record", at("boxes.npy")},
          {"boxes.npy"}, limits);
  EXPECT_EQ(files(), 0u);
}

TEST_F(Simulate, interruption_leaves_no_partial_file) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const Process process =
        start(THRONG_PROGRAM,
              {"column", "--objects", "1K", "--steps", "100000", "--record", at("boxes.npy")},
              at("output.out"), at("output.err"), folder_, {});
    for (int wait = 0; wait < 500 && files() == 0; ++wait) usleep(10000);
    kill(process, signal);
    EXPECT_EQ(wait_for(process), 128 + signal);
    EXPECT_EQ(files(), 0u);
    EXPECT_NE(slurp(at("output.err")).find("interrupted"), std::string::npos);
  }
}
#endif

TEST_F(Simulate, started_by_throng) {
  const ProcessOutput output = run_program(
      THRONG_FRONT, {"simulate", "column", "--objects", "50", "--steps", "3", "--json"});
  EXPECT_EQ(output.status, 0) << output.err;
  EXPECT_NE(output.out.find("\"objects\":50"), std::string::npos) << output.out;
  EXPECT_NE(run_program(THRONG_FRONT, {"--help"}).out.find("simulate"), std::string::npos);
  EXPECT_NE(run_program(THRONG_FRONT, {"simulate", "--help"}).out.find("--broadphase"),
            std::string::npos);
}

}  // namespace
}  // namespace throng::test
