// throng demo: the paper's scene in motion. A column of boxes falls on a plane; each frame finds
// all pairs, and the pairs push the boxes apart.
#include <algorithm>
#include <memory>
#include <new>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <throng/finder.hpp>

#include "apps/common/failure_text.hpp"
#include "apps/common/interrupt.hpp"
#include "apps/common/median.hpp"
#include "apps/common/numbers.hpp"
#include "apps/report/draw_boxes.hpp"
#include "apps/report/format.hpp"
#include "apps/report/page.hpp"
#include "apps/report/table.hpp"
#include "apps/report/write_png.hpp"
#include "apps/scenes/output_file.hpp"
#include "apps/throng/commands.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/failure.hpp"
#include "apps/throng/falling_boxes.hpp"
#include "apps/throng/film.hpp"
#include "apps/throng/search_options.hpp"

namespace throng::cli {
namespace {

using common::median;

const char* help_text =
    R"(A column of boxes falls on a plane and becomes a heap. Every frame finds all pairs of overlapping
boxes and uses them to push the boxes apart. Prints a table of times and draws a picture of the heap,
where a box's colour shows the number of boxes that it touches.

Examples:
  throng demo
  throng demo --objects 1M --frames 100 -o million.png
  throng demo --objects 10K --animate falling.svg
Exit status: 0 done, 2 bad usage or a picture that cannot be written.)";

// Table 6 of the paper: 100K objects, AABB update, grid update and brute force together.
constexpr double paper_ms = 27.91;
constexpr std::uint64_t paper_objects = 100000;

struct Arguments {
  std::string objects = "100000";
  std::size_t frames = 300;
  unsigned threads = 0;
  std::string picture = report::can_write_png() ? "throng-demo.png" : "";
  std::string animation;
};

struct Measured {
  std::vector<double> plan, bin, find, total, move, pairs;
  double first_ms = 0;
  Plan plan_of_last;
};

std::string ms_text(double ms) { return report::format_ms(ms); }

// `film`: may be null.
Measured run_frames(FallingBoxes& heap, const Arguments& arguments, Finder& finder, Film* film) {
  Measured m;
  Progress progress("frame", arguments.frames);
  for (std::size_t f = 0; f < arguments.frames; ++f) {
    // The last frame's pairs push, too, so the picture shows what the last search found.
    const auto move = Clock::now();
    if (f > 0) heap.push_apart(finder.pairs().data(), finder.pairs().size());
    heap.fall();
    m.move.push_back(ms_since(move));
    const auto search = Clock::now();
    const Result result = finder.find(heap.boxes());
    const double search_ms = ms_since(search);
    if (!result.ok()) {
      throw Failure(fmt::format("frame {}: {}", f, common::failure_text(result, {})));
    }
    m.pairs.push_back(static_cast<double>(result.found));
    m.plan_of_last = result.plan;
    if (f == 0) m.first_ms = search_ms;
    // The first call also allocates memory and starts threads: it has a row of its own.
    if (f > 0 || arguments.frames == 1) {
      m.total.push_back(search_ms);
      m.plan.push_back(result.times.plan_ms);
      m.bin.push_back(result.times.bin_ms);
      m.find.push_back(result.times.find_ms);
    }
    if (film && film->shows(f)) {
      film->add(heap, finder.pairs().data(), finder.pairs().size(),
                fmt::format("frame {}: {} pairs in {} ms", f + 1,
                            report::format_count(result.found), ms_text(search_ms)));
    }
    progress.at(f + 1, fmt::format("{} pairs in {} ms", report::format_count(result.found),
                                   report::format_ms(search_ms)));
  }
  return m;
}

std::string tables(const Measured& m, std::size_t objects, std::size_t frames) {
  const double total = median(m.total);
  const auto worst = [](const std::vector<double>& v) {
    return *std::max_element(v.begin(), v.end());
  };
  report::Table stages(fmt::format("Finding all pairs of {} falling boxes, {} frames",
                                   report::format_count(objects), frames),
                       {"stage", "median ms", "slowest ms"});
  stages.add_row({"plan", ms_text(median(m.plan)), ms_text(worst(m.plan))});
  stages.add_row({"bin", ms_text(median(m.bin)), ms_text(worst(m.bin))});
  stages.add_row({"find", ms_text(median(m.find)), ms_text(worst(m.find))});
  stages.add_row({"total, every frame but the first", ms_text(total), ms_text(worst(m.total))});
  stages.add_row({"the first frame, cold", ms_text(m.first_ms), ms_text(m.first_ms)});
  stages.add_note(fmt::format(
      "{}, {}, {} thread{}. Moving the boxes takes another {} ms per frame.",
      to_string(m.plan_of_last.algorithm), to_string(m.plan_of_last.isa), m.plan_of_last.threads,
      m.plan_of_last.threads == 1 ? "" : "s", ms_text(median(m.move))));
  const auto rate = [](double n, double ms) {
    return fmt::format("{:.1f} million", n / ms * 1e-3);
  };
  report::Table speed("Comparison with the paper",
                      {"", "objects", "ms per frame", "objects per second"});
  speed.add_row({"throng, here", report::format_count(objects), ms_text(total),
                 rate(static_cast<double>(objects), total)});
  speed.add_row({"the paper (2012, Quadro FX 3600M)", report::format_count(paper_objects),
                 fmt::format("{:.1f}", paper_ms),
                 rate(static_cast<double>(paper_objects), paper_ms)});
  const auto count = [](double pairs) {
    return report::format_count(static_cast<std::uint64_t>(pairs));
  };
  speed.add_note(fmt::format("Pairs per frame: {} in the median, {} at most, {} in the last.",
                             count(median(m.pairs)), count(worst(m.pairs)), count(m.pairs.back())));
  return stages.text() + "\n" + speed.text() + "\n";
}

void draw(const FallingBoxes& heap, const Finder& finder, const std::string& path) {
  report::PictureStyle style;
  style.title = fmt::format("{} boxes fell on a plane", report::format_count(heap.objects()));
  style.height = 1200;
  style.azimuth = 43;
  style.elevation = 21;
  style.legend = "touching boxes per box";
  // Without a time: the same picture on every machine.
  style.caption =
      fmt::format("{} pairs. A quarter is cut away.", report::format_count(finder.pairs().size()));
  const std::vector<float> touches = heap.touches(finder.pairs().data(), finder.pairs().size());
  // Leaves out the quarter next to the viewer, to show the inside.
  std::vector<Box> boxes;
  std::vector<float> values;
  for (std::size_t i = 0; i < heap.objects(); ++i) {
    const Box& box = heap.boxes()[i];
    if (box.lower.x > 0 && box.lower.y > 0) continue;
    boxes.push_back(box);
    values.push_back(touches[i]);
  }
  const common::InterruptGuard guard;  // an incomplete picture is removed
  report::draw_boxes(path, boxes.data(), boxes.size(), values.data(), style);
  guard.check();
}

int run(const Arguments& arguments) {
  const std::uint64_t objects = common::parse_count(arguments.objects, "--objects");
  if (objects < 1 || objects > max_box_count - 1) {
    throw Failure(fmt::format("--objects: found {}, wanted 1 to {}", objects, max_box_count - 1));
  }
  const std::string& animation = arguments.animation;
  if (!animation.empty() &&
      (animation.size() <= 4 || animation.compare(animation.size() - 4, 4, ".svg") != 0)) {
    throw Failure(fmt::format(
        "--animate: found '{}', wanted a name that ends in .svg, the only format of films",
        animation));
  }
  scenes::check_outputs({{"-o", arguments.picture}, {"--animate", animation}});
  report::check_png(arguments.picture);
  std::unique_ptr<FallingBoxes> heap;
  try {
    heap = std::make_unique<FallingBoxes>(static_cast<std::size_t>(objects));
  } catch (
      const std::exception&) {  // bad_alloc, or length_error where a vector cannot be that long
    throw Failure(fmt::format("out of memory: about {} bytes needed for {} moving boxes",
                              report::format_count(objects * FallingBoxes::bytes_an_object),
                              report::format_count(objects)));
  }
  Options options;
  options.threads = arguments.threads;
  Finder finder(options);
  Film film(heap->objects(), arguments.frames);
  const Measured measured =
      run_frames(*heap, arguments, finder, animation.empty() ? nullptr : &film);
  print(tables(measured, heap->objects(), arguments.frames));
  finish_output();
  if (arguments.picture.empty()) {
    print("No picture: this build has no Cairo. --animate FILM.svg writes a film.\n");
  } else {
    draw(*heap, finder, arguments.picture);
    print(fmt::format("The picture is in {}\n", arguments.picture));
  }
  if (!animation.empty()) {
    const std::string svg = film.svg(fmt::format("{} boxes fall on a plane, cut in the middle",
                                                 report::format_count(heap->objects())));
    report::write_text(animation, svg);
    print(fmt::format("The film is in {} ({})\n", animation,
                      report::format_bytes(static_cast<double>(svg.size()))));
  }
  return exit_done;
}

}  // namespace

Run add_demo(CLI::App& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& app = *program.add_subcommand("demo", "A column of boxes falls on a plane");
  app.footer(help_text);
  app.add_option("--objects", arguments->objects, "boxes, such as 100000, 100K or 1M (100K)")
      ->type_name("N");
  app.add_option_function<std::string>(
         "--frames", common::count_into(arguments->frames, "--frames", 1, 1000000000),
         "frames (300)")
      ->type_name("F");
  add_threads(app, arguments->threads);
  app.add_option("-o,--output", arguments->picture, "the picture (throng-demo.png)")
      ->type_name("PICTURE.png");
  app.add_option("--animate", arguments->animation,
                 "also write a film of the boxes in the middle, an animated SVG that loops")
      ->type_name("FILM.svg");
  return [arguments] { return run(*arguments); };
}

}  // namespace throng::cli
