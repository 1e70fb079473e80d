// throng-simulate: rigid bodies fall on a plane; reports the time of their broad phase.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <throng/version.hpp>

#include "apps/common/failure.hpp"
#include "apps/common/interrupt.hpp"
#include "apps/common/median.hpp"
#include "apps/common/numbers.hpp"
#include "apps/common/print.hpp"
#include "apps/report/draw_boxes.hpp"
#include "apps/report/format.hpp"
#include "apps/report/table.hpp"
#include "apps/report/write_png.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/scenes/output_file.hpp"
#include "apps/simulate/progress.hpp"
#include "apps/simulate/world.hpp"

namespace throng::simulate {
namespace {

const char* help_text =
    R"(Scenes: column (a column of objects falls on a plane), pile (a steep cone of objects collapses), rain (objects
far apart fall from many heights). A step is 1/60 s of Bullet's rigid-body dynamics. Reports medians over
all steps but the first: of a whole step, and of its broad phase (passing the boxes and finding the pairs);
and the contact points and the deepest penetration of the last step.

Examples:
  throng-simulate column --objects 10K --steps 300
  throng-simulate pile --objects 10K --steps 60 --broadphase dbvt --json
  throng-simulate rain --shape rectangle --check
  throng-simulate column --shape sphere --record boxes.npy --picture last.png
Exit status: 0 done, 1 --check found a difference, 2 bad input or an output that failed; 130, 143 or 129:
SIGINT (Ctrl-C), SIGTERM or SIGHUP ended it.)";

constexpr std::uint64_t max_objects = 16000000;  // Bullet counts pairs and bytes in 32 bits

using common::exit_bad;
using common::exit_differs;
using common::exit_done;
using common::Failure;
using common::median;

struct Arguments {
  std::string scene, shape = "cube", phase = "throng", objects = "10K";
  std::size_t steps = 120;
  std::uint64_t seed = 1;
  unsigned threads = 0;
  bool json = false, check = false;
  std::string record, picture;
};

std::size_t parse_objects(const std::string& text) {
  const std::uint64_t count = common::parse_count(text, "--objects");
  if (count < 1 || count > max_objects) {
    throw Failure(fmt::format("--objects: found {}, wanted 1 to {}", count, max_objects));
  }
  return static_cast<std::size_t>(count);
}

template <class Choice>
Choice parse_choice(const std::string& text, const char* option,
                    const std::vector<std::string>& names) {
  const auto found = std::find(names.begin(), names.end(), text);
  if (found == names.end()) {
    throw Failure(
        fmt::format("{}: found '{}', wanted one of: {}", option, text, fmt::join(names, ", ")));
  }
  return static_cast<Choice>(found - names.begin());
}

struct Measurements {
  std::vector<double> step_ms, broad_phase_ms;
  double setup_ms = 0;
  std::size_t pairs = 0, compared = 0, missing = 0, extra = 0;
  Contacts contacts;
};

Measurements run_steps(const Spec& spec, const Arguments& arguments,
                       std::unique_ptr<World>& world) {
  Measurements measured;
  const auto start = std::chrono::steady_clock::now();
  world = std::make_unique<World>(spec);
  measured.setup_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const common::InterruptGuard guard;
  std::unique_ptr<scenes::BoxWriter> record;
  if (!arguments.record.empty()) {
    record = std::make_unique<scenes::BoxWriter>(arguments.record, arguments.steps, spec.objects);
  }
  Progress progress(arguments.steps);
  for (std::size_t s = 0; s < arguments.steps; ++s) {
    guard.check();
    const StepReport step = world->step();
    // The first step finds all pairs and allocates memory.
    if (s > 0 || arguments.steps == 1) {
      measured.step_ms.push_back(step.step_ms);
      measured.broad_phase_ms.push_back(step.broad_phase_ms);
    }
    if (record) record->write(world->boxes().data(), world->boxes().size());
    if (spec.compare) {
      const Comparison& c = world->comparison();
      measured.compared += c.pairs;
      measured.missing += c.missing;
      measured.extra += c.extra;
    }
    progress.at(
        s + 1,
        fmt::format("step {} ms, broad phase {} ms, {} pairs", report::format_ms(step.step_ms),
                    report::format_ms(step.broad_phase_ms), report::format_count(world->pairs())));
  }
  if (record) record->finish();
  measured.pairs = world->pairs();
  measured.contacts = world->contacts();
  return measured;
}

std::string json_text(const Spec& spec, const Arguments& arguments, const Measurements& measured) {
  nlohmann::ordered_json object = {
      {"scene", to_string(spec.scene)},
      {"shape", to_string(spec.shape)},
      {"objects", spec.objects},
      {"steps", arguments.steps},
      {"seed", spec.seed},
      {"broadphase", to_string(spec.phase)},
      {"setup_ms", measured.setup_ms},
      {"step_ms", median(measured.step_ms)},
      {"broad_phase_ms", median(measured.broad_phase_ms)},
      {"pairs", measured.pairs},
      {"contacts", measured.contacts.points},
      {"deepest_penetration", measured.contacts.deepest},
  };
  if (spec.compare) {
    object["compared_pairs"] = measured.compared;
    object["missing"] = measured.missing;
    object["extra"] = measured.extra;
  }
  return object.dump() + "\n";
}

std::string table_text(const Spec& spec, const Arguments& arguments, const Measurements& measured) {
  const auto worst = [](const std::vector<double>& v) {
    return report::format_ms(*std::max_element(v.begin(), v.end()));
  };
  report::Table table(fmt::format("{}: {} {}s, {} steps, broad phase {}", to_string(spec.scene),
                                  report::format_count(spec.objects), to_string(spec.shape),
                                  arguments.steps, to_string(spec.phase)),
                      {"", "median ms", "slowest ms"});
  table.add_row({"a step", report::format_ms(median(measured.step_ms)), worst(measured.step_ms)});
  table.add_row({"its broad phase", report::format_ms(median(measured.broad_phase_ms)),
                 worst(measured.broad_phase_ms)});
  table.add_note(fmt::format("In the last step {} pairs, {} points of contact, the deepest {:.4f}.",
                             report::format_count(measured.pairs),
                             report::format_count(measured.contacts.points),
                             measured.contacts.deepest));
  if (spec.compare) {
    table.add_note(fmt::format("Compared with {}: {} overlaps, {} missing, {} extra.",
                               spec.phase == Phase::throng ? "dbvt" : "throng",
                               report::format_count(measured.compared), measured.missing,
                               measured.extra));
  }
  return table.text();
}

void draw(const World& world, const Spec& spec, const Measurements& measured,
          const std::string& path) {
  report::PictureStyle style;
  style.title = fmt::format("{}: {} {}s", to_string(spec.scene), report::format_count(spec.objects),
                            to_string(spec.shape));
  style.legend = "touching objects per object";
  style.caption = fmt::format("Boxes of the last step; {} points of contact.",
                              report::format_count(measured.contacts.points));
  report::draw_boxes(path, world.boxes().data(), world.objects(),
                     measured.contacts.of_objects.data(), style);
}

int run(const Arguments& arguments) {
  Spec spec;
  spec.scene = parse_choice<Scene>(arguments.scene, "SCENE", scene_names());
  spec.shape = parse_choice<Shape>(arguments.shape, "--shape", shape_names());
  spec.phase = parse_choice<Phase>(arguments.phase, "--broadphase", phase_names());
  spec.objects = parse_objects(arguments.objects);
  spec.seed = arguments.seed;
  spec.options.threads = arguments.threads;
  spec.compare = arguments.check;
  scenes::check_outputs({{"--record", arguments.record}, {"--picture", arguments.picture}});
  report::check_png(arguments.picture);
  std::unique_ptr<World> world;
  const Measurements measured = run_steps(spec, arguments, world);
  common::print(arguments.json ? json_text(spec, arguments, measured)
                               : table_text(spec, arguments, measured));
  if (!arguments.picture.empty()) {
    const common::InterruptGuard guard;  // an incomplete picture is removed
    draw(*world, spec, measured, arguments.picture);
    guard.check();
  }
  return measured.missing + measured.extra == 0 ? exit_done : exit_differs;
}

int dispatch(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Rigid bodies fall on a plane.", "throng-simulate");
  app.footer(help_text);
  app.set_version_flag("--version", "throng-simulate " THRONG_VERSION);
  app.add_option("scene", arguments.scene, "column, pile or rain")->required()->type_name("SCENE");
  app.add_option("--objects", arguments.objects,
                 "number of objects, such as 10000, 10K or 1M (10K)")
      ->type_name("N");
  app.add_option_function<std::string>(
         "--steps", common::count_into(arguments.steps, "--steps", 1, 1000000000),
         "number of steps of 1/60 s (120)")
      ->type_name("S");
  app.add_option("--shape", arguments.shape, "cube, sphere or rectangle (cube)")
      ->type_name("SHAPE");
  app.add_option("--broadphase", arguments.phase, "throng, dbvt or axis-sweep (throng)")
      ->type_name("PHASE");
  app.add_option_function<std::string>("--seed", common::seed_into(arguments.seed),
                                       "random seed (1)")
      ->type_name("S");
  app.add_option_function<std::string>("--threads", common::threads_into(arguments.threads),
                                       "maximum number for throng; 0: all")
      ->type_name("N");
  app.add_flag("--json", arguments.json, "one object on one line");
  app.add_flag("--check", arguments.check,
               "run throng (or dbvt, if throng is chosen) on the same boxes and compare");
  app.add_option("--record", arguments.record, "the boxes of every step, (S, N, 6)")
      ->type_name("FILE.npy");
  app.add_option("--picture", arguments.picture, "the boxes of the last step")
      ->type_name("FILE.png");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? exit_done : exit_bad;
  }
  return run(arguments);
}

int guarded(int argc, char** argv) {
  std::string message = "out of memory";
  try {
    return dispatch(argc, argv);
  } catch (const common::Interrupted& interrupted) {
    std::fputs("throng-simulate: interrupted; no partial file is left\n", stderr);
    return interrupted.status();
  } catch (const std::bad_alloc&) {
    // Out of memory: no formatting.
  } catch (const std::exception& error) {
    message = error.what();
  }
  std::fputs(("throng-simulate: " + message + "\n").c_str(), stderr);
  return exit_bad;
}

}  // namespace
}  // namespace throng::simulate

int main(int argc, char** argv) {
  throng::common::ignore_write_signals();
  return throng::simulate::guarded(argc, argv);
}
