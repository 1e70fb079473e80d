// throng-paper -o DIR: the paper's evaluation, measured here.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/machine.hpp"
#include "apps/common/numbers.hpp"
#include "apps/common/print.hpp"
#include "apps/common/sibling_program.hpp"
#include "apps/paper/commands.hpp"
#include "apps/paper/cuda.hpp"
#include "apps/paper/evaluation/experiments.hpp"
#include "apps/paper/failure.hpp"
#include "apps/paper/input.hpp"
#include "apps/report/page.hpp"

namespace throng::paper {
namespace {

struct Arguments {
  std::string folder, backend = "auto", memory = "4G", up_to;
  std::vector<std::string> only;
  bool quick = false;
  unsigned threads = 0;
  double limit = 60;
};

std::vector<DeviceKind> devices_of(const std::string& backend) {
  if (backend == "cpu") return {DeviceKind::cpu};
  const std::string reason = why_no_cuda();
  if (backend == "auto" && !reason.empty()) return {DeviceKind::cpu};
  if (!reason.empty()) throw Failure(fmt::format("--backend {}: {}", backend, reason));
  if (backend == "cuda") return {DeviceKind::cuda};
  return {DeviceKind::cpu, DeviceKind::cuda};
}

int run(const Arguments& a) {
  Setting setting;
  setting.quick = a.quick;
  setting.devices = devices_of(a.backend);
  setting.threads = a.threads != 0 ? a.threads : common::hardware_threads();
  setting.memory_bytes = common::parse_bytes(a.memory, "--memory");
  if (!a.up_to.empty()) setting.up_to = common::parse_count(a.up_to, "--up-to");
  setting.limit_seconds = a.limit;
  setting.competitors = common::find_sibling_program("throng-bench");
  setting.progress = [](const std::string& what) {
    std::fputs(fmt::format("throng-paper: {}\n", what).c_str(), stderr);
  };
  std::error_code error;
  std::filesystem::create_directories(a.folder, error);
  if (error) throw Failure(fmt::format("-o {}: {}", a.folder, error.message()));
  const std::filesystem::path folder = a.folder;

  const Lab lab(setting);
  // Written as they come: a failure keeps earlier measurements.
  const std::vector<Section> sections = evaluate(lab, a.only, [&](const Section& section) {
    report::write_text((folder / (section.name + ".csv")).string(), csv_of({section}).csv());
    if (!section.rows.empty()) common::print(table_of(section).text());
    for (const report::Table& table : section.tables) common::print(table.text());
    common::print(section.finding + "\n\n");
  });
  report::write_text((folder / "rows.csv").string(), csv_of(sections).csv());
  const std::string page = (folder / "index.html").string();
  report::write_text(page, page_of(lab, sections).html());
  common::print(fmt::format("The page: {}\n", page));
  const std::vector<std::string> different = disagreements(sections);
  for (const std::string& line : different) {
    std::fputs(fmt::format("throng-paper: {}; please report this\n", line).c_str(), stderr);
  }
  return different.empty() ? exit_done : exit_differs;
}

}  // namespace

Run add_evaluate(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  program.add_option("-o,--output", a->folder, "the folder for the page and the CSV files")
      ->type_name("DIR");
  program.add_flag("--quick", a->quick, "without the largest sizes: under two minutes");
  std::string names;
  for (const Experiment& experiment : experiments()) {
    names += (names.empty() ? "" : ", ") + std::string(experiment.name);
  }
  program.add_option("--only", a->only, "only these of: " + names)->type_name("NAME");
  program.add_option("--backend", a->backend, "auto: the cpu, and a GPU where there is one")
      ->check(CLI::IsMember({"auto", "cpu", "cuda", "all"}).description(""))
      ->type_name("auto|cpu|cuda|all");
  program.add_option("--threads", a->threads, "threads of the cpu (all)")
      ->check(CLI::Range(1, 1024).description(""))
      ->type_name("N");
  program.add_option("--up-to", a->up_to, "skip larger n")->type_name("N");
  program.add_option("--memory", a->memory, "maximum memory of one output, list or grid (4G)")
      ->type_name("BYTES");
  program
      .add_option("--limit", a->limit, "time limit in seconds for a frame of another library (60)")
      ->check(CLI::Range(0.1, 1e6).description(""))
      ->type_name("S");
  return [a] {
    if (a->folder.empty()) {
      throw Failure(
          "found no command and no -o DIR; wanted -o DIR for the evaluation, pairs for one "
          "variant, "
          "or --list; see --help");
    }
    return run(*a);
  };
}

}  // namespace throng::paper
