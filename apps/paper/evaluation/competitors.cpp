// Figures 5 and 6: the falling column, frame by frame, compared with Bullet's two broad phases.
// Each of these runs in its own process, so that it can be stopped.
#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <throng/throng.hpp>

#include "apps/common/child.hpp"
#include "apps/common/median.hpp"
#include "apps/paper/evaluation/experiments.hpp"
#include "apps/paper/failure.hpp"
#include "apps/report/format.hpp"
#include "apps/scenes/scene.hpp"

namespace throng::paper {
namespace {

constexpr std::size_t first_frame = 49;  // half of the column has landed
const char* const competitor_names[] = {"Bullet btDbvt, default", "Bullet btDbvt, deferred",
                                        "Bullet bt32BitAxisSweep3"};

struct Frames {
  std::uint64_t n = 0;
  double moving = 1;
  std::size_t count = 3;  // after the first
};

struct CompetitorRun {
  std::vector<double> ms;
  std::uint64_t pairs = 0;  // of the last frame
  double insert_ms = 0;     // the time to add all objects; 0: it did not complete
  std::string skip_reason;  // why there is no time
};

// Adding objects one by one may take minutes before the first frame.
double insert_limit(const Lab& lab) { return 5 * lab.setting().limit_seconds; }

// Enough frames were measured.
struct TimeLimitExceeded {};

// The output of the benchmark program for one of them.
CompetitorRun run_competitor(const Lab& lab, const std::string& competitor, const Frames& frames) {
  const double limit = lab.setting().limit_seconds;
  CompetitorRun competitor_run;
  const std::vector<std::string> arguments = {"frames",
                                              "--library",
                                              competitor,
                                              "--scene",
                                              "column",
                                              "--objects",
                                              std::to_string(frames.n),
                                              "--moving",
                                              fmt::format("{}", frames.moving),
                                              "--first",
                                              std::to_string(first_frame),
                                              "--frames",
                                              std::to_string(frames.count)};
  const auto on_line = [&](const std::string& line) {
    const std::size_t a = line.find(','), b = line.find(',', a + 1);
    if (b == std::string::npos || line.compare(0, 5, "frame") == 0) return;
    const double ms = std::stod(line.substr(a + 1, b - a - 1));
    if (line.compare(0, a, "insert") == 0) {
      competitor_run.insert_ms = ms;
      return;
    }
    competitor_run.ms.push_back(ms);
    competitor_run.pairs = std::stoull(line.substr(b + 1));
    if (ms > 1000 * limit) throw TimeLimitExceeded{};
  };
  try {
    const common::ChildEnd ended =
        common::run_child(lab.setting().competitors, arguments, insert_limit(lab), on_line);
    if (ended.stopped) {
      competitor_run.skip_reason = fmt::format(
          "stopped: {} took over {:g} s",
          competitor_run.insert_ms == 0 ? "adding the objects" : "a frame", insert_limit(lab));
    } else if (ended.status != 0) {
      competitor_run.skip_reason = fmt::format("its program exited with status {}", ended.status);
    }
  } catch (const TimeLimitExceeded&) {
    competitor_run.skip_reason = fmt::format("stopped: a frame took over {:g} s", limit);
  }
  return competitor_run;
}

// Why a library is skipped: it was stopped, or adding more objects would take too long. Adding one
// to the axis sweep takes time proportional to the number present.
class SkipRules {
 public:
  // Empty: it is run.
  std::string skip_reason(const Lab& lab, const std::string& competitor, std::uint64_t n) const {
    const auto found = past_runs_.find(competitor);
    if (found == past_runs_.end() || n < found->second.n) return {};
    const PastRun& past_run = found->second;
    if (past_run.stopped) {
      return fmt::format("skipped: stopped at {} objects before", report::format_count(past_run.n));
    }
    const double ratio = static_cast<double>(n) / static_cast<double>(past_run.n);
    const double seconds = past_run.insert_ms / 1000 * ratio * ratio;
    if (ratio <= 1 || past_run.insert_ms < 1000 || seconds <= insert_limit(lab)) return {};
    return fmt::format(
        "skipped: adding {} objects took {:.0f} s, so this many would take about {:.0f}",
        report::format_count(past_run.n), past_run.insert_ms / 1000, seconds);
  }
  void record(const std::string& competitor, std::uint64_t n, const CompetitorRun& competitor_run) {
    past_runs_[competitor] = {n, competitor_run.insert_ms,
                              competitor_run.skip_reason.compare(0, 7, "stopped") == 0};
  }

 private:
  struct PastRun {
    std::uint64_t n = 0;
    double insert_ms = 0;
    bool stopped = false;
  };
  std::map<std::string, PastRun> past_runs_;
};

struct OurTimes {
  double paper_ms = 0, library_ms = 0, library_one_ms = 0;
  double persistent_ms = 0;  // persistent objects, on one thread
  std::uint64_t pairs = 0;
  std::string skip_reason;  // why the paper's grid has no time
};

// Persistent objects, used as in Bullet: they get all boxes of a frame and detect which moved.
class PersistentObjects {
 public:
  explicit PersistentObjects(const std::vector<Box>& boxes) : broad_phase_(one_thread()) {
    std::vector<ObjectId> ids(boxes.size());
    require(broad_phase_.add(boxes, ids.data()));
    require(broad_phase_.update());
  }
  double frame(const std::vector<Box>& boxes) {
    return ms_of([&] {
      require(broad_phase_.move_all(boxes));
      require(broad_phase_.update());
    });
  }
  std::uint64_t pairs() const { return broad_phase_.pair_count(); }

 private:
  static Options one_thread() {
    Options options;
    options.threads = 1;
    return options;
  }
  static void require(const Result& result) {
    if (!result.ok()) throw Failure(result.message);
  }
  BroadPhase broad_phase_;
};

// The same frames with the paper's grid and with the library, on one device.
OurTimes our_times(const Lab& lab, const Frames& frames, DeviceKind device) {
  scenes::Spec spec;
  spec.name = "column";
  spec.objects = frames.n;
  spec.frames = first_frame + frames.count + 1;
  spec.moving = frames.moving;
  const scenes::Scene scene(spec);
  std::vector<Box> boxes(frames.n);
  std::vector<double> paper, library, one, persistent;
  scene.frame(first_frame, boxes.data());
  std::optional<PersistentObjects> objects;
  if (device == DeviceKind::cpu) objects.emplace(boxes);
  OurTimes result;
  Variant variant;
  variant.per_cell = 4;
  for (std::size_t f = 1; f <= frames.count; ++f) {
    scene.frame(first_frame + f, boxes.data());
    // The plane is excluded from the environment that determines the density.
    const Lab::Measurement measurement = lab.run(variant, boxes.data(), frames.n, device);
    if (measurement.measured) paper.push_back(measurement.measured->step.times.total());
    result.skip_reason = measurement.skip_reason;
    const Lab::Library found = lab.library(boxes.data(), frames.n, device);
    library.push_back(found.ms);
    if (objects) {
      one.push_back(lab.library(boxes.data(), frames.n, device, 1).ms);
      persistent.push_back(objects->frame(boxes));
    }
    result.pairs = found.pairs;
    if ((measurement.measured && measurement.measured->checksum != found.checksum) ||
        (objects && objects->pairs() != found.pairs)) {
      throw Failure(fmt::format(
          "frame {} of {} objects: the paper's grid, the library and the persistent objects "
          "found different pairs: please report this",
          first_frame + f, frames.n));
    }
  }
  result.paper_ms = common::median(paper);
  result.library_ms = common::median(library);
  result.library_one_ms = common::median(one);
  result.persistent_ms = common::median(persistent);
  return result;
}

class Curves {
 public:
  explicit Curves(report::Plot plot) : plot_(std::move(plot)) {}
  void add(const std::string& name, double x, double y, bool emphasis = false) {
    if (y <= 0) return;
    for (report::Series& line : plot_.series) {
      if (line.name != name) continue;
      line.x.push_back(x);
      line.y.push_back(y);
      return;
    }
    plot_.series.push_back({name, {x}, {y}, emphasis, false});
  }
  report::Plot plot_;
};

// One point of either figure: all on the same frames. Returns Throng's time divided by that of the
// fastest other library: 0 where there is none.
double point(const Lab& lab, Section& section, Curves& curves, const Frames& frames, double x,
             SkipRules& skip_rules) {
  const auto add = [&](Row row) {
    row.quantity = fmt::format("frame, {:g} % moving", 100 * frames.moving);
    section.rows.push_back(std::move(row));
  };
  double library = 0, persistent = 0, fastest = 0;
  for (const DeviceKind device : lab.devices()) {
    lab.say(fmt::format("{}: {} objects, {:g} % moving, {}", section.name,
                        report::format_short(frames.n), 100 * frames.moving, lab.name(device)));
    const OurTimes own = our_times(lab, frames, device);
    Row row = lab.row("the paper's grid, X = 4", frames.n, "", "ms", device);
    if (own.paper_ms > 0) row.measured = own.paper_ms;
    row.pairs = own.pairs;
    row.found = own.skip_reason;
    if (section.name == "figure5" && frames.n == 100000) {
      row.paper = 25;
      row.paper_text = "under 25";
    }
    curves.add("the paper's grid, " + lab.name(device), x, own.paper_ms);
    add(row);
    row = lab.row("Throng", frames.n, "", "ms", device);
    row.measured = own.library_ms;
    row.pairs = own.pairs;
    curves.add("Throng, " + lab.name(device), x, own.library_ms, true);
    add(row);
    if (device == DeviceKind::cpu) {
      library = own.library_ms;
      row.device += ", only 1 used";
      row.measured = own.library_one_ms;
      add(row);
      row.what = "Throng, persistent objects";
      row.measured = own.persistent_ms;
      curves.add("Throng, persistent objects", x, own.persistent_ms);
      add(row);
      persistent = own.persistent_ms;
    }
  }
  for (const char* const name : competitor_names) {
    Row row = lab.row(name, frames.n, "", "ms", DeviceKind::cpu);
    row.device += ", only 1 used";
    if (lab.setting().competitors.empty()) {
      row.found = "not built: build with libbullet-dev installed (scripts/paper does)";
    } else if (const std::string skip_reason = skip_rules.skip_reason(lab, name, frames.n);
               !skip_reason.empty()) {
      row.found = skip_reason;
    } else {
      lab.say(fmt::format("{}: {} objects, {:g} % moving, {}", section.name,
                          report::format_short(frames.n), 100 * frames.moving, name));
      const CompetitorRun competitor_run = run_competitor(lab, name, frames);
      row.found = competitor_run.skip_reason;
      skip_rules.record(name, frames.n, competitor_run);
      if (!competitor_run.ms.empty()) {
        row.measured = common::median(competitor_run.ms);
        row.pairs = competitor_run.pairs;
        row.found = fmt::format(
            "{} Throng's time on all threads, {} that of its persistent objects{}",
            report::format_ratio(*row.measured / library),
            report::format_ratio(*row.measured / persistent),
            competitor_run.skip_reason.empty() ? "" : "; " + competitor_run.skip_reason);
        if (fastest == 0 || *row.measured < fastest) fastest = *row.measured;
        curves.add(name, x, *row.measured);
      }
    }
    add(row);
  }
  return fastest == 0 || library == 0 ? 0 : fastest / library;
}

std::string conditions() {
  return fmt::format(
      "The column falls; frame {}. Throng and the paper's grid search each frame "
      "from scratch; Throng's persistent objects get all boxes and detect which moved. Bullet "
      "keeps "
      "its objects from frame to frame, gets all new boxes, and its exact "
      "pairs "
      "are picked out of its surplus outside the time, which favours it. Medians of the frames "
      "that "
      "follow.",
      first_frame);
}

}  // namespace

Section figure5(const Lab& lab) {
  Section section("figure5", "Figure 5: 1K to 1M moving objects, compared with Bullet");
  Curves curves({"Figure 5", "objects", "ms per frame", true, true, {}});
  SkipRules skip_rules;
  std::string gains;
  for (const std::uint64_t n :
       lab.sizes({1000, 3000, 10000, 30000, 100000, 300000, 1000000}, 30000)) {
    const double time_ratio =
        point(lab, section, curves, {n, 1, std::size_t{lab.quick() ? 2u : 3u}},
              static_cast<double>(n), skip_rules);
    if (time_ratio > 0) {
      gains += fmt::format("{}{} at {}", gains.empty() ? "" : ", ",
                           report::format_ratio(time_ratio), report::format_short(n));
    }
  }
  if (!gains.empty()) {
    section.finding =
        fmt::format("Throng on the processor is ahead of the faster of Bullet's two by {}.", gains);
  } else {
    section.finding =
        "No time of Bullet's is here, so only the paper's system and Throng are compared.";
  }
  section.words = {
      conditions(),
      "The paper's figure has no numbers in its text; its headline says under 25 ms at "
      "100,000 objects."};
  section.plots.push_back(std::move(curves.plot_));
  return section;
}

Section figure6(const Lab& lab) {
  Section section("figure6", "Figure 6: 0 to 100 % of the objects moving, compared with Bullet");
  const std::uint64_t n =
      std::min<std::uint64_t>(lab.quick() ? 10000 : 100000, lab.setting().up_to);
  Curves curves({fmt::format("Figure 6, {} objects", report::format_count(n)),
                 "% moving",
                 "ms per frame",
                 false,
                 true,
                 {}});
  SkipRules skip_rules;
  const std::vector<double> shares = lab.quick() ? std::vector<double>{0, 0.5, 1}
                                                 : std::vector<double>{0, 0.1, 0.25, 0.5, 0.75, 1};
  std::string behind;
  for (const double share : shares) {
    const double time_ratio =
        point(lab, section, curves, {n, share, std::size_t{lab.quick() ? 2u : 3u}}, 100 * share,
              skip_rules);
    if (time_ratio > 0 && time_ratio < 1) {
      behind += fmt::format("{}{:g} %", behind.empty() ? "" : ", ", 100 * share);
    }
  }
  const auto spread = [&](const std::string& start) {
    double least = 0, most = 0;
    for (const report::Series& line : curves.plot_.series) {
      if (line.name.compare(0, start.size(), start) != 0 || line.y.empty()) continue;
      least = *std::min_element(line.y.begin(), line.y.end());
      most = *std::max_element(line.y.begin(), line.y.end());
      break;
    }
    return least > 0 ? report::format_ratio(most / least) : std::string("-");
  };
  section.finding = fmt::format(
      "From the cheapest to the most expensive share of movers, times change by {} for the paper's "
      "grid "
      "(flat, says the paper), {} for Throng, {} for btDbvt and {} for the axis sweep.",
      spread("the paper's"), spread("Throng"), spread(competitor_names[0]),
      spread(competitor_names[2]));
  if (!behind.empty()) {
    section.finding += fmt::format(
        " With {} moving one of Bullet's is ahead of a search from scratch, as it has next to "
        "nothing to do; the times of Throng's persistent objects change by {}.",
        behind, spread("Throng, objects"));
  }
  section.words = {conditions(), "The paper does not say how many objects its figure has."};
  section.plots.push_back(std::move(curves.plot_));
  return section;
}

}  // namespace throng::paper
