// The scenes of Figure 1, and the single figures that the paper compares with the literature.
#include <utility>

#include <fmt/format.h>

#include "apps/paper/evaluation/experiments.hpp"
#include "apps/report/format.hpp"
#include "apps/scenes/scene.hpp"

namespace throng::paper {
namespace {

struct Case {
  const char* what;
  const char* scene;
  std::uint64_t n;
  std::size_t frame;
  double paper;            // ms; 0: none
  const char* paper_text;  // empty: the number
  const char* note;
};
constexpr Case cases[] = {
    {"Figure 1: cubes", "uniform", 250000, 0, 0, "", ""},
    {"Figure 1: spheres", "spheres", 100000, 0, 25, "under 25", ""},
    {"Figure 1: rectangles", "rectangles", 75000, 0, 0, "", ""},
    {"the falling column", "column", 1000, 60, 0, "", ""},
    {"the falling column", "column", 10000, 60, 0, "", ""},
    {"the falling column", "column", 100000, 60, 25, "under 25", ""},
    {"the falling column", "column", 1000000, 60, 0, "", ""},
    {"spheres of three sizes", "spheres", 64000, 0, 15.67, "", "Liu et al.: 13.71"},
    {"spheres of three sizes", "spheres", 128000, 0, 30.68, "", "Liu et al.: 48.16"},
    {"spheres of three sizes", "spheres", 256000, 0, 50.33, "", "Liu et al.: 241"},
    {"spheres of three sizes", "spheres", 960000, 0, 0, "", "Liu et al.: no figure"},
    {"n-body, 300 spheres and 4 cones", "nbody", 304, 0, 0.41, "",
     "Pabst et al., both phases: 128.1 discrete, 184.8 continuous"},
    {"3000 objects, all moving", "uniform", 3000, 1, 0.46, "", "Tracy et al.: 4"},
    {"2500 objects, brute force", "uniform", 2500, 0, 0, "", "said to be 20 % below Liu et al."},
};

}  // namespace

Section scenes(const Lab& lab) {
  Section section("scenes",
                  "Figure 1 and section 6: the scenes, and the figures from the literature");
  for (const DeviceKind device : lab.devices()) {
    std::size_t compared = 0, faster = 0;
    for (const Case& c : cases) {
      if (lab.sizes({c.n}, 130000).empty()) continue;
      lab.say(fmt::format("scenes: {}, {} objects, {}", c.what, report::format_short(c.n),
                          lab.name(device)));
      scenes::Spec spec;
      spec.name = c.scene;
      spec.objects = c.n;
      spec.frames = c.frame + 1;
      std::vector<Box> boxes(c.n);
      scenes::Scene(spec).frame(c.frame, boxes.data());
      Variant variant;
      const bool brute = std::string(c.what).find("brute") != std::string::npos;
      if (!brute) variant.per_cell = 4;
      const Lab::Measurement measurement = lab.run(variant, boxes.data(), c.n, device);
      const auto finish = [&](Row row) {
        if (c.paper > 0) row.paper = c.paper;
        row.paper_text = c.paper_text;
        if (row.measured) {
          row.found = speed_sentence(row);
          if (*c.note != 0) row.found += fmt::format("{}{}", row.found.empty() ? "" : "; ", c.note);
        }
        section.rows.push_back(std::move(row));
      };
      Row row = lab.row(c.what, c.n, brute ? "the paper's brute force" : "the paper's grid, X = 4",
                        "ms", device);
      row.found = measurement.skip_reason;
      if (measurement.measured) {
        row.measured = measurement.measured->step.times.total();
        row.pairs = measurement.measured->step.pairs.size();
        row.checksum = measurement.measured->checksum;
      }
      finish(row);
      const Lab::Library found = lab.library(boxes.data(), c.n, device);
      row = lab.row(c.what, c.n, "Throng", "ms", device);
      row.measured = found.ms;
      row.pairs = found.pairs;
      row.checksum = found.checksum;
      if (c.paper > 0) {
        ++compared;
        faster += found.ms < c.paper;
      }
      finish(row);
    }
    section.finding += fmt::format(
        "On {} Throng is below {} of the {} times that the paper gives for its own system. ",
        lab.name(device), faster, compared);
  }
  section.words = {
      "Boxes only, without the rigid-body dynamics that moves them. The paper gives "
      "neither "
      "the density of its scenes nor how they move; these are the scenes of `throng scene`."};
  return section;
}

}  // namespace throng::paper
