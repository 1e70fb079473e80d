// throng-paper measure: the paper's variants at the paper's sizes, as rows of a CSV file.
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "paper/commands.hpp"
#include "paper/cuda.hpp"
#include "paper/failure.hpp"
#include "paper/grid.hpp"
#include "paper/input.hpp"
#include "program/numbers.hpp"
#include "report/format.hpp"

namespace throng::paper {
namespace {

const char* help_text =
    R"(Columns: experiment, variant, device, n, median_ms, pairs, checksum. Experiments, by the paper's table:
  table2   brute force, the ways from thread to pair, pairs through a counter: all n(n-1)/2 pairs tested;
           100K objects on a GPU only
  table4   n square roots; the checksum is the sum of their integer parts, pairs is empty
  table5   one byte and one bit a pair, each way to write: kernel, then transfer of the output
  table6   the grid's stages, for several X
  table7   without and with the grid
Variants whose memory is more than --memory allows are left out, and told.
Example: throng-paper measure --csv paper.csv)";

struct Arguments {
  std::string csv, scene = "uniform", memory = "4G", device = "auto", up_to = "4G";
  bool quick = false;
  int repeat = 11;
  unsigned threads = 1;
};

// A row a line, written as it comes: what was measured before a failure is not lost.
class Csv {
 public:
  explicit Csv(const std::string& path) : path_(path), file_(std::fopen(path.c_str(), "w")) {
    if (!file_) fail();
    line("experiment,variant,device,n,median_ms,pairs,checksum");
  }
  ~Csv() {
    if (file_) std::fclose(file_);
  }
  Csv(const Csv&) = delete;
  Csv& operator=(const Csv&) = delete;

  void line(const std::string& text) {
    if (std::fputs((text + "\n").c_str(), file_) < 0 || std::fflush(file_) != 0) fail();
    say(text + "\n");
  }

 private:
  [[noreturn]] void fail() const {
    throw Failure(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  }
  std::string path_;
  std::FILE* file_;
};

class Experiments {
 public:
  Experiments(const Arguments& arguments, DeviceKind device, Csv& csv)
      : arguments_(arguments),
        memory_bytes_(program::parse_bytes(arguments.memory, "--memory")),
        up_to_(program::parse_count(arguments.up_to, "--up-to")),
        device_(device),
        device_name_(device == DeviceKind::cuda ? cuda_device_name() : "cpu"),
        csv_(csv) {
    for (char& c : device_name_) c = c == ',' ? ' ' : c;
  }

  void run() {
    table2();
    table4();
    table5();
    table6();
    table7();
  }

 private:
  // Sizes above --up-to are left out, and with --quick those above `quick_limit`.
  std::vector<std::uint64_t> sizes(std::vector<std::uint64_t> all,
                                   std::uint64_t quick_limit) const {
    const std::uint64_t limit = arguments_.quick ? std::min(quick_limit, up_to_) : up_to_;
    std::erase_if(all, [&](std::uint64_t n) { return n > limit; });
    return all;
  }

  void row(const char* experiment, const std::string& variant, std::uint64_t n, double ms,
           const std::string& pairs, const std::string& checksum) {
    csv_.line(fmt::format("{},{},{},{},{:.6g},{},{}", experiment, variant, device_name_, n, ms,
                          pairs, checksum));
  }
  void row(const char* experiment, const std::string& variant, std::uint64_t n, double ms,
           const Measured& m) {
    row(experiment, variant, n, ms, std::to_string(m.step.pairs.size()), hex(m.checksum));
  }

  // Calls use(measured), or tells why not.
  template <class Use>
  void with(const char* experiment, const Variant& variant, std::uint64_t n, const Use& use) {
    const Boxes boxes = make_scene(arguments_.scene, n, 1, 1);
    Job job;
    job.variant = variant;
    job.n = n;
    job.environment = environment_of(boxes.frame(0), n);
    job.memory_bytes = memory_bytes_;
    job.threads = arguments_.threads;
    try {
      const std::unique_ptr<Stepper> stepper = make_stepper_on(device_, job);
      use(measure(*stepper, boxes.frame(0), arguments_.repeat, arguments_.quick ? 500 : 5000));
    } catch (const Failure& failure) {
      std::fputs(fmt::format("throng-paper: {} {} n {} left out: {}\n", experiment,
                             describe(variant), n, failure.what())
                     .c_str(),
                 stderr);
    }
  }

  void table2() {
    std::vector<Variant> variants;
    const auto add = [&](MappingKind mapping, RootKind root = RootKind::float32, int steps = 2) {
      Variant variant;
      variant.mapping = mapping;
      variant.root = root;
      variant.steps = steps;
      variant.output = Output::pairs;
      variants.push_back(variant);
    };
    add(MappingKind::formula);
    add(MappingKind::formula, RootKind::float64);
    add(MappingKind::formula, RootKind::carmack, 3);
    add(MappingKind::formula, RootKind::lomont, 3);
    add(MappingKind::exact);
    add(MappingKind::fold);
    add(MappingKind::lazy);
    add(MappingKind::stored);
    // All pairs of 100K objects would take one core minutes for each variant.
    std::vector<std::uint64_t> counts = {1000, 10000};
    if (device_ == DeviceKind::cuda) counts.push_back(100000);
    for (const std::uint64_t n : sizes(counts, 10000))
      for (const Variant& variant : variants)
        with("table2", variant, n, [&](const Measured& m) {
          row("table2", describe(variant), n, m.step.times.search, m);
        });
  }

  void table4() {
    const auto time = [&](const std::string& name, RootKind kind, int steps, std::uint64_t n) {
      const int repeat = n > 100000000 && device_ == DeviceKind::cpu ? 1 : arguments_.repeat;
      const RootTime result = device_ == DeviceKind::cuda
                                  ? time_roots_on_cuda(kind, steps, n, repeat)
                                  : time_roots_on_host(kind, steps, n, repeat, arguments_.threads);
      row("table4", name, n, result.ms, "", hex(result.sum));
    };
    for (const std::uint64_t n : sizes({1000000, 10000000, 100000000, 1000000000}, 10000000)) {
      for (int steps = min_steps; steps <= max_steps; ++steps) {
        time(fmt::format("carmack{}", steps), RootKind::carmack, steps, n);
        time(fmt::format("lomont{}", steps), RootKind::lomont, steps, n);
      }
      time("float32", RootKind::float32, 1, n);
      time("float64", RootKind::float64, 1, n);
    }
  }

  void table5() {
    Variant variant;
    const auto both = [&](std::uint64_t n) {
      with("table5", variant, n, [&](const Measured& m) {
        row("table5", describe(variant) + " kernel", n, m.step.times.search, m);
        row("table5", describe(variant) + " output", n, m.step.times.download, m);
      });
    };
    for (const std::uint64_t n : sizes({100, 1000, 5000, 7500}, 5000)) {
      variant.output = Output::byte;
      both(n);
      variant.output = Output::bit;
      for (const Write write : {Write::racy, Write::atomic, Write::ballot, Write::owned}) {
        variant.write = write;
        both(n);
      }
    }
  }

  void table6() {
    for (const std::uint64_t n : sizes({1000, 10000, 100000, 1000000}, 100000))
      for (const double per_cell : {1.0, 2.0, 4.0, 8.0, 16.0, 32.0}) {
        Variant variant;
        variant.per_cell = per_cell;
        with("table6", variant, n, [&](const Measured& m) {
          const std::string name = describe(variant);
          const Times& t = m.step.times;
          row("table6", name + " boxes", n, t.boxes, m);
          row("table6", name + " update", n, t.grid, m);
          row("table6", name + " search and transfers", n, t.upload + t.search + t.download, m);
          row("table6", name + " total", n, t.total(), m);
        });
      }
  }

  void table7() {
    for (const std::uint64_t n : sizes({100, 1000, 10000}, 10000)) {
      Variant variant;
      const auto total = [&] {
        with("table7", variant, n, [&](const Measured& m) {
          row("table7", describe(variant), n, m.step.times.total(), m);
        });
      };
      total();
      variant.output = Output::pairs;
      total();
      variant.per_cell = 8;
      total();
    }
  }

  const Arguments& arguments_;
  std::uint64_t memory_bytes_, up_to_;
  DeviceKind device_;
  std::string device_name_;
  Csv& csv_;
};

int run(const Arguments& a) {
  const std::string reason = why_no_cuda();
  if (a.device == "cuda" && !reason.empty()) throw Failure("--device cuda: " + reason);
  Csv csv(a.csv);
  if (a.device != "cuda") Experiments(a, DeviceKind::cpu, csv).run();
  if (a.device != "cpu" && reason.empty()) Experiments(a, DeviceKind::cuda, csv).run();
  if (a.device == "auto" && !reason.empty()) say("# cpu only: " + reason + "\n");
  return exit_done;
}

}  // namespace

Run add_measure(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App& app =
      *program.add_subcommand("measure", "Run the paper's tables here, into a CSV file");
  app.footer(help_text);
  app.add_option("--csv", a->csv, "where the rows go")->required()->type_name("FILE");
  app.add_flag("--quick", a->quick, "leave the largest sizes out");
  app.add_option("--up-to", a->up_to, "leave larger n out")->type_name("N");
  app.add_option("--scene", a->scene, "the boxes (uniform)")->type_name("NAME");
  app.add_option("--device", a->device, "auto: the cpu, and a GPU where there is one")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}).description(""))
      ->type_name("auto|cpu|cuda");
  app.add_option("--threads", a->threads, "threads of the cpu (1)")
      ->check(CLI::Range(1, 1024).description(""))
      ->type_name("N");
  app.add_option("--repeat", a->repeat, "warmed runs to take the median of (11)")
      ->check(CLI::Range(1, 1000000).description(""))
      ->type_name("K");
  app.add_option("--memory", a->memory, "the most that one output, list or grid may take (4G)")
      ->type_name("BYTES");
  return [a] { return run(*a); };
}

}  // namespace throng::paper
