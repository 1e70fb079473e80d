#include "apps/paper/evaluation/experiments.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "apps/common/machine.hpp"
#include "apps/paper/failure.hpp"

namespace throng::paper {

const std::vector<Experiment>& experiments() {
  static const std::vector<Experiment> all = {{"examples", worked_examples},
                                              {"table2", table2},
                                              {"cost", mapping_cost},
                                              {"table3", table3},
                                              {"repairs", repairs},
                                              {"table4", table4},
                                              {"table5", table5},
                                              {"figure4", figure4},
                                              {"table6", table6},
                                              {"table7", table7},
                                              {"figure5", figure5},
                                              {"figure6", figure6},
                                              {"scenes", scenes},
                                              {"study", cell_study},
                                              {"triangles", triangles},
                                              {"errata", errata}};
  return all;
}

std::vector<Section> evaluate(const Lab& lab, const std::vector<std::string>& only,
                              const std::function<void(const Section&)>& done) {
  for (const std::string& name : only) {
    std::string known;
    bool found = false;
    for (const Experiment& experiment : experiments()) {
      known += (known.empty() ? "" : ", ") + std::string(experiment.name);
      found = found || name == experiment.name;
    }
    if (!found) throw Failure(fmt::format("--only: found '{}', wanted one of {}", name, known));
  }
  std::vector<Section> sections;
  for (const Experiment& experiment : experiments()) {
    const bool wanted =
        only.empty() || std::find(only.begin(), only.end(), experiment.name) != only.end();
    if (!wanted) continue;
    sections.push_back(experiment.run(lab));
    done(sections.back());
  }
  return sections;
}

std::vector<std::string> disagreements(const std::vector<Section>& sections) {
  // In these, all rows of one n use the same boxes.
  static const std::vector<std::string> alike = {"table2", "table5", "table6", "table7",
                                                 "triangles"};
  std::vector<std::string> lines;
  for (const Section& section : sections) {
    if (std::find(alike.begin(), alike.end(), section.name) == alike.end()) continue;
    std::map<std::uint64_t, const Row*> first;
    for (const Row& row : section.rows) {
      if (!row.checksum || row.what.find("racy") != std::string::npos) continue;
      const Row& other = *first.emplace(row.n, &row).first->second;
      if (other.checksum == row.checksum && other.pairs == row.pairs) continue;
      lines.push_back(
          fmt::format("{} at {} objects: '{}' on {} and '{}' on {} found different pairs",
                      section.name, row.n, other.what, other.device, row.what, row.device));
    }
  }
  return lines;
}

report::Page page_of(const Lab& lab, const std::vector<Section>& sections) {
  report::Page page("The paper's evaluation, measured here");
  page.paragraph(
      "Q. Avril, V. Gouranton, B. Arnaldi: Fast Collision Culling in Large-Scale Environments "
      "Using "
      "GPU Mapping Function, EGPGV 2012. Each row compares the paper's printed number with the one "
      "measured on this machine; ratio is measured / paper. The paper's hardware was a Quadro FX "
      "3600M and a Core2 X7900.");
  report::Table machine("This machine", {"", ""});
  for (const auto& [what, value] : common::machine_description()) machine.add_row({what, value});
  for (const DeviceKind device : lab.devices()) {
    machine.add_row(
        {device == DeviceKind::cuda ? "GPU" : "experiments on the CPU", lab.name(device)});
  }
  machine.add_row({"run", lab.quick() ? "quick: without the largest sizes" : "whole"});
  page.add(machine);
  page.contents();
  report::Table summary("Summary", {"", "finding"});
  for (const Section& section : sections) summary.add_row({section.title, section.finding});
  page.add(summary);
  for (const Section& section : sections) add_to(page, section);
  return page;
}

}  // namespace throng::paper
