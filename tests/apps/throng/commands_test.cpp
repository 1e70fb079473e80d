// throng scene, check, demo, bench; help; signals and pipes.
#include "apps/report/write_png.hpp"
#include "tests/apps/throng/cli_test.hpp"

#include <chrono>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <regex>
#include <thread>

namespace throng::test {
namespace {

class Commands : public CliTest {};

TEST_F(Commands, help_and_version) {
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--help"},
                                                    {"pairs", "--help"},
                                                    {"scene", "--help"},
                                                    {"check", "--help"},
                                                    {"demo", "--help"}}) {
    const ProcessOutput output = run(arguments);
    EXPECT_EQ(output.status, 0);
    EXPECT_NE(output.out.find("Examples:"), std::string::npos) << output.out;
  }
  const ProcessOutput alone = run({});
  EXPECT_EQ(alone.status, 0);
  EXPECT_EQ(alone.out, run({"--help"}).out);
  EXPECT_EQ(alone.err, "");
  const ProcessOutput version = run({"--version"});
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out.rfind("throng ", 0), 0u) << version.out;
}

TEST_F(Commands, scene_depends_only_on_the_seed) {
  const auto scene = [&](const char* seed, const char* file) {
    const ProcessOutput output = run(
        {"scene", "clusters", "--objects", "2K", "--frames", "3", "--seed", seed, "-o", at(file)});
    EXPECT_EQ(output.status, 0) << output.err;
    return slurp(at(file));
  };
  const std::string first = scene("1", "a.npy");
  EXPECT_GT(first.size(), 3u * 2000 * 24);
  EXPECT_LT(first.size(), 3u * 2000 * 24 + 300);
  EXPECT_NE(first.find("(3, 2000, 6)"), std::string::npos);
  EXPECT_EQ(first, scene("1", "b.npy"));
  EXPECT_NE(first, scene("2", "c.npy"));
}

TEST_F(Commands, moving_share_moves_that_many) {
  ASSERT_EQ(run({"scene", "uniform", "--objects", "1000", "--frames", "2", "--moving", "0.25", "-o",
                 at("m.npy")})
                .status,
            0);
  const std::string bytes = slurp(at("m.npy"));
  const std::size_t frame = 1000 * 24, start = bytes.size() - 2 * frame;
  int moved = 0;
  for (std::size_t i = 0; i < 1000; ++i) {
    moved += std::memcmp(&bytes[start + i * 24], &bytes[start + frame + i * 24], 24) != 0;
  }
  EXPECT_GT(moved, 150);
  EXPECT_LT(moved, 350);
}

TEST_F(Commands, worlds_file_separates_the_worlds) {
  const ProcessOutput output = run({"scene", "worlds", "--objects", "3000", "-o", at("w.npy")});
  ASSERT_EQ(output.status, 0) << output.err;
  ASSERT_TRUE(exists("w-world.npy"));
  EXPECT_NE(output.out.find("w-world.npy"), std::string::npos) << output.out;
  const auto mixed = json({"pairs", at("w.npy")});
  const auto apart = json({"pairs", at("w.npy"), "--world", at("w-world.npy")});
  EXPECT_LT(apart.at("pairs").get<std::size_t>(), mixed.at("pairs").get<std::size_t>());
  EXPECT_GT(apart.at("pairs").get<std::size_t>(), 0u);
  const ProcessOutput check = run({"check", at("w.npy"), "--world", at("w-world.npy")});
  EXPECT_EQ(check.status, 0) << check.out << check.err;
}

TEST_F(Commands, failure_of_one_of_two_files_removes_both) {
  for (const char* blocking_name : {"w-world.npy", "w.npy"}) {
    fs::create_directory(at(blocking_name));
    refuses({"scene", "worlds", "--objects", "3000", "-o", at("w.npy")}, {blocking_name});
    EXPECT_EQ(files(), 1u) << blocking_name;
    fs::remove(at(blocking_name));
  }
}

TEST_F(Commands, check_agrees_on_scenes_and_two_sets) {
  ASSERT_EQ(run({"scene", "mixed", "--objects", "1500", "-o", at("m.npy")}).status, 0);
  ASSERT_EQ(run({"scene", "uniform", "--objects", "900", "-o", at("u.npy")}).status, 0);
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"check", at("m.npy")},
                                                    {"check", at("m.npy"), at("u.npy")},
                                                    {"check", at("u.npy"), "--margin", "0.37"}}) {
    const ProcessOutput output = run(arguments);
    EXPECT_EQ(output.status, 0) << output.out << output.err;
    EXPECT_NE(output.out.find("all agree"), std::string::npos) << output.out;
    EXPECT_NE(output.out.find("all-pairs"), std::string::npos) << output.out;
    EXPECT_NE(output.out.find("scalar"), std::string::npos) << output.out;
  }
}

// The double loop of `check` against `pairs`, by their output.
TEST_F(Commands, check_prints_the_number_of_pairs) {
  ASSERT_EQ(run({"scene", "pile", "--objects", "3000", "-o", at("p.npy")}).status, 0);
  const auto found = json({"pairs", at("p.npy")}).at("pairs").get<std::size_t>();
  ASSERT_GT(found, 1000u);
  std::string text = std::to_string(found) + " pairs";
  text.insert(text.size() - 9, 1, ',');
  EXPECT_NE(run({"check", at("p.npy")}).out.find(text), std::string::npos);
}

TEST_F(Commands, demo_ends_with_a_table_and_a_picture) {
  std::vector<std::string> demo = {"demo", "--objects", "2000", "--frames", "40"};
  if (!report::can_write_png()) {
    const ProcessOutput output = run(demo);
    EXPECT_NE(output.out.find("27.9"), std::string::npos) << output.out;
    EXPECT_NE(output.out.find("No picture: this build has no Cairo"), std::string::npos);
    EXPECT_EQ(files(), 0u);
    refuses({"demo", "-o", at("heap.png")}, {"heap.png", "this build has no Cairo"});
    return;
  }
  demo.insert(demo.end(), {"-o", at("heap.png")});
  const ProcessOutput output = run(demo);
  ASSERT_EQ(output.status, 0) << output.err;
  const std::string png = slurp(at("heap.png"));
  EXPECT_EQ(png.substr(0, 4), "\x89PNG");
  EXPECT_EQ(png.substr(png.size() - 8, 4), "IEND");
  EXPECT_NE(output.out.find("27.9"), std::string::npos) << output.out;
  EXPECT_NE(output.out.find("heap.png"), std::string::npos) << output.out;
  EXPECT_EQ(output.err, "");
  // Reported before the work, not after it.
  refuses({"demo", "--objects", "1M", "--frames", "100000", "-o", at("no/heap.png")},
          {"no/heap.png"});
}

TEST_F(Commands, demo_writes_a_film) {
  const auto films = [&](const char* objects, const char* frames) {
    std::vector<std::string> demo = {"demo", "--objects", objects,       "--frames",
                                     frames, "--animate", at("film.svg")};
    if (report::can_write_png()) demo.insert(demo.end(), {"-o", at("heap.png")});
    const ProcessOutput output = run(demo);
    EXPECT_EQ(output.status, 0) << output.err;
    EXPECT_NE(output.out.find("film.svg"), std::string::npos) << output.out;
    return slurp(at("film.svg"));
  };
  const auto occurrences = [](const std::string& text, const std::string& what) {
    std::size_t count = 0;
    for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
    return count;
  };
  const std::string film = films("300", "30");
  EXPECT_EQ(occurrences(film, "repeatCount=\"indefinite\""), 30u) << "a picture per frame";
  EXPECT_EQ(occurrences(film, "display=\"none\""), 29u) << "the last shows without animation";
  EXPECT_NE(film.find("frame 30: "), std::string::npos);
  EXPECT_EQ(film.substr(film.size() - 7), "</svg>\n");
  // A column of 5 x 5 x 12 boxes: the middle row has 5 x 12 of them.
  const std::string first = film.substr(0, film.find("frame 2: "));
  const std::regex square("v[0-9]+");
  EXPECT_EQ(std::distance(std::sregex_iterator(first.begin(), first.end(), square),
                          std::sregex_iterator()),
            60);
  EXPECT_LT(film.size(), 60000u);
  EXPECT_EQ(occurrences(films("2", "400"), "repeatCount="), 120u) << "at most so many pictures";
  EXPECT_EQ(occurrences(films("1", "1"), "<text"), 2u + 7 + 1);
  refuses({"demo", "--objects", "10", "--animate", at("film.mp4")}, {"film.mp4", ".svg"});
  refuses({"demo", "--objects", "10", "--animate", at("no/film.svg")}, {"no/film.svg"});
  refuses({"demo", "--objects", "10", "-o", at("one.svg"), "--animate", at("one.svg")},
          {"one.svg"});
}

#ifndef _WIN32
// A fake benchmark program, a script, prints its arguments.
TEST_F(Commands, bench_passes_its_arguments_unchanged) {
  fs::copy_file(THRONG_PROGRAM, at("throng"));
  const ProcessOutput without = run_program(at("throng"), {"bench", "--quick"});
  EXPECT_EQ(without.status, 2);
  EXPECT_EQ(without.err.rfind("throng: bench: found no program throng-bench ", 0), 0u)
      << without.err;
  EXPECT_NE(without.err.find("-DTHRONG_BUILD_BENCH=ON"), std::string::npos) << without.err;
  spill(at("throng-bench"), "#!/bin/sh\nfor a; do printf '[%s]' \"$a\"; done\nexit 7\n");
  fs::permissions(at("throng-bench"), fs::perms::owner_all);
  const ProcessOutput with =
      run_program(at("throng"), {"bench", "a b", "$HOME", "'\"", "", "--help"});
  EXPECT_EQ(with.out, "[a b][$HOME]['\"][][--help]");
  EXPECT_EQ(with.status, 7);
}
#endif

TEST_F(Commands, missing_programs_have_an_install_hint) {
  fs::copy_file(THRONG_PROGRAM, at("throng"));
  for (const std::string command : {"pairs", "bench"}) {
    const ProcessOutput output = run_program(at("throng"), {command, "--mpi"});
    EXPECT_EQ(output.status, 2);
    EXPECT_EQ(output.err.rfind("throng: " + command + " --mpi: found no program throng-mpi ", 0),
              0u)
        << output.err;
    for (const char* word : {"libopenmpi-dev", "-DTHRONG_MPI=ON", "--target throng-mpi"})
      EXPECT_NE(output.err.find(word), std::string::npos) << output.err;
  }
  EXPECT_NE(run_program(at("throng"), {"simulate"}).err.find("libbullet-dev"), std::string::npos);
}

// The rest needs signals and a shell.
#ifndef _WIN32
TEST_F(Commands, paper_is_listed_only_if_built) {
  fs::copy_file(THRONG_PROGRAM, at("throng"));
  EXPECT_EQ(run_program(at("throng"), {"--help"}).out.find("paper "), std::string::npos);
  spill(at("throng-paper"), "#!/bin/sh\necho here\n");
  fs::permissions(at("throng-paper"), fs::perms::owner_all);
  EXPECT_NE(run_program(at("throng"), {"--help"}).out.find("paper "), std::string::npos);
  EXPECT_EQ(run_program(at("throng"), {"paper"}).out, "here\n");
}

TEST_F(Commands, interrupted_scene_leaves_nothing) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const Process process =
        start(THRONG_PROGRAM,
              {"scene", "uniform", "--objects", "20K", "--frames", "100000", "-o", at("long.npy")},
              at("output.out"), at("output.err"), folder_, {});
    // Wait until it writes.
    for (int i = 0; i < 500 && files() == 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_GT(files(), 0u);
    kill(process, signal);
    EXPECT_EQ(wait_for(process), 128 + signal) << slurp(at("output.err"));
    EXPECT_EQ(files(), 0u);
    EXPECT_NE(slurp(at("output.err")).find("interrupted"), std::string::npos);
  }
}

// Shells make background jobs of a script ignore Ctrl-C.
TEST_F(Commands, ignored_signals_stay_ignored) {
  for (const std::string name : {"INT", "TERM", "HUP"}) {
    const std::string line = "trap '' " + name +
                             "; \"$0\" scene uniform --objects 20K --frames 200" +
                             " -o long.npy & until ls | grep -q long; do sleep 0.01; done; kill -" +
                             name + " $!; wait $!";
    const ProcessOutput output = run_program("/bin/sh", {"-c", line, THRONG_PROGRAM});
    EXPECT_EQ(output.status, 0) << name << ": " << output.err;
    EXPECT_TRUE(exists("long.npy"));
    fs::remove(at("long.npy"));
  }
}

TEST_F(Commands, closed_output_ends_quietly) {
  ASSERT_EQ(run({"scene", "uniform", "--objects", "100", "-o", at("u.npy")}).status, 0);
  // `true` reads nothing; the program starts after the reader has closed the pipe.
  const std::string line = "(sleep 0.3; \"$0\" pairs u.npy; echo $? >status) | true; sleep 1.5";
  const ProcessOutput output = run_program("/bin/sh", {"-c", line, THRONG_PROGRAM});
  EXPECT_EQ(slurp(at("status")), "141\n");
  EXPECT_EQ(output.err, "");
}
#endif

}  // namespace
}  // namespace throng::test
