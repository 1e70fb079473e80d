// throng scene: writes a generated scene block by block, so memory does not grow with its size.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "apps/common/interrupt.hpp"
#include "apps/common/numbers.hpp"
#include "apps/report/format.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/scenes/output_file.hpp"
#include "apps/scenes/scene.hpp"
#include "apps/throng/commands.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/failure.hpp"

namespace throng::cli {
namespace {

const char* help_text =
    R"(Box i of a frame depends on the scene, the seed and i alone: the same bytes on every machine.
'worlds' is many small worlds in one place; it also writes a file with the world of each box.

Examples:
  throng scene uniform --objects 100K -o uniform.npy
  throng scene uniform --objects 1M --density 2 -o dense.npy
  throng scene column --objects 20K --frames 120 --moving 0.5 -o column.npy
  throng scene worlds --objects 100K -o worlds.npy && \
      throng pairs worlds.npy --world worlds-world.npy
Exit status: 0 done, 2 bad usage or an output that cannot be written.)";

struct Arguments {
  scenes::Spec spec;
  std::string objects, output;
};

// boxes.npy -> boxes-world.npy
std::string world_path(const std::string& boxes) {
  const std::filesystem::path path(boxes);
  const std::string name =
      path.stem().string() + "-world" + (path.has_extension() ? path.extension().string() : ".npy");
  return (path.parent_path() / name).string();
}

// Boxes generated and written at a time.
constexpr std::size_t block_boxes = std::size_t{1} << 18;

void write_frames(const scenes::Scene& made, const Arguments& arguments,
                  const common::InterruptGuard& guard, scenes::BoxWriter& writer) {
  const std::size_t n = arguments.spec.objects, frames = arguments.spec.frames;
  std::vector<Box> boxes(std::min(n, block_boxes));
  Progress progress("writing box", n * frames);
  for (std::size_t f = 0; f < frames; ++f) {
    for (std::size_t i = 0; i < n; i += block_boxes) {
      const std::size_t end = std::min(n, i + block_boxes);
      made.boxes(f, i, end, boxes.data());
      writer.write(boxes.data(), end - i);
      guard.check();
      progress.at(f * n + end);
    }
  }
}

void write_worlds(const scenes::Scene& made, const std::string& path, std::size_t n,
                  const common::InterruptGuard& guard) {
  std::vector<std::int32_t> worlds(std::min(n, block_boxes));
  scenes::WorldWriter writer(path, n);
  for (std::size_t i = 0; i < n; i += block_boxes) {
    const std::size_t count = std::min(n - i, block_boxes);
    for (std::size_t k = 0; k < count; ++k) worlds[k] = made.world(i + k);
    writer.write(worlds.data(), count);
    guard.check();
  }
  writer.finish();
}

// Both files or neither: the boxes are renamed last.
void write(const scenes::Scene& made, const Arguments& arguments, const std::string& worlds) {
  const std::size_t n = arguments.spec.objects;
  const common::InterruptGuard guard;
  scenes::BoxWriter writer(arguments.output, arguments.spec.frames, n);
  write_frames(made, arguments, guard, writer);
  if (!made.has_worlds()) return writer.finish();
  write_worlds(made, worlds, n, guard);
  try {
    writer.finish();
  } catch (...) {
    std::error_code error;
    if (std::filesystem::is_regular_file(worlds, error)) std::filesystem::remove(worlds, error);
    throw;
  }
}

int run(Arguments& arguments) {
  const std::uint64_t objects = common::parse_count(arguments.objects, "--objects");
  if (objects < 1 || objects > max_box_count) {
    throw Failure(fmt::format("--objects: found {}, wanted 1 to {}", objects, max_box_count));
  }
  arguments.spec.objects = static_cast<std::size_t>(objects);
  const scenes::Scene made(arguments.spec);
  const std::string path = world_path(arguments.output);
  scenes::check_outputs({{"-o", arguments.output}});
  write(made, arguments, path);
  std::string text = fmt::format("{}: {} boxes", arguments.output, report::format_count(objects));
  if (arguments.spec.frames > 1) text += fmt::format(", {} frames", arguments.spec.frames);
  if (made.has_worlds()) {
    text += fmt::format("\n{0}: the world of each box, for --world {0}", path);
  }
  print(text + "\n");
  return exit_done;
}

}  // namespace

Run add_scene(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& app =
      *program.add_subcommand("scene", "Write a generated scene of boxes, one frame or many");
  app.footer(help_text);
  std::string list;
  for (const std::string& name : scenes::names()) list += (list.empty() ? "" : "|") + name;
  app.add_option("NAME", arguments->spec.name, "one of " + list)
      ->required()
      ->check(CLI::IsMember(scenes::names()).description(""))
      ->type_name("");
  app.add_option("--objects", arguments->objects, "number of boxes, such as 100000, 100K or 1M")
      ->required()
      ->type_name("N");
  scenes::Spec& spec = arguments->spec;
  app.add_option_function<std::string>(
         "--frames", common::count_into(spec.frames, "--frames", 1, scenes::max_frames),
         "number of frames (1)")
      ->type_name("F");
  app.add_option_function<std::string>(
         "--density",
         common::number_into(spec.density, "--density", scenes::min_density, scenes::max_density,
                             "1e-9 to 1000000"),
         "density; the default depends on the scene")
      ->type_name("D");
  app.add_option_function<std::string>("--seed", common::seed_into(spec.seed), "random seed (1)")
      ->type_name("S");
  app.add_option_function<std::string>("--moving",
                                       common::number_into(spec.moving, "--moving", 0, 1, "0 to 1"),
                                       "share of the boxes that move, 0 to 1 (1)")
      ->type_name("SHARE");
  app.add_option("-o,--output", arguments->output, "the file to write")
      ->required()
      ->type_name("FILE.npy");
  return [arguments] { return run(*arguments); };
}

}  // namespace throng::cli
