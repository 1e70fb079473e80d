// The experiments of the evaluation, in the order of the page. Each measures the numbers that it
// reports.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/paper/evaluation/lab.hpp"
#include "apps/paper/evaluation/section.hpp"

namespace throng::paper {

Section worked_examples(const Lab& lab);  // section 3.1 and the bit of 3.4
Section table2(const Lab& lab);           // the mappings from thread to pair
Section mapping_cost(const Lab& lab);     // the cost of a mapping, in time and in instructions
Section table3(const Lab& lab);           // wrong square roots
Section repairs(const Lab& lab);          // the limits of the two repairs
Section table4(const Lab& lab);           // fast square roots
Section table5(const Lab& lab);           // and Figure 3: one byte and one bit per pair
Section figure4(const Lab& lab);          // brute force by number of objects
Section table6(const Lab& lab);           // the stages with the grid
Section table7(const Lab& lab);           // with and without the grid
Section figure5(const Lab& lab);          // by number of objects, compared with Bullet
Section figure6(const Lab& lab);          // by share of moving objects, compared with Bullet
Section scenes(const Lab& lab);           // Figure 1 and the comparison with the literature
Section cell_study(const Lab& lab);       // the best X, the best cell size
Section triangles(const Lab& lab);        // future work: the narrow phase on triangles
Section errata(const Lab& lab);           // errors in the paper, with proof

struct Experiment {
  const char* name;
  Section (*run)(const Lab& lab);
};
const std::vector<Experiment>& experiments();

// Runs the named experiments (all if empty); calls back after each section. Throws Failure for an
// unknown name.
std::vector<Section> evaluate(const Lab& lab, const std::vector<std::string>& only,
                              const std::function<void(const Section&)>& done);

// Rows that searched the same boxes for all pairs and found different ones, one line each; empty
// where all agree. The racy rows may lose pairs and are excluded.
std::vector<std::string> disagreements(const std::vector<Section>& sections);

// The page of all sections: machine, summary, sections.
report::Page page_of(const Lab& lab, const std::vector<Section>& sections);

}  // namespace throng::paper
