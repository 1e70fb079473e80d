// The experiments of the evaluation, in the order of the page. Each measures what it tells.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "paper/evaluation/lab.hpp"
#include "paper/evaluation/section.hpp"

namespace throng::paper {

Section worked_examples(const Lab& lab);  // section 3.1 and the bit of 3.4
Section table2(const Lab& lab);           // the ways from thread to pair
Section mapping_cost(const Lab& lab);     // what a mapping costs, in time and in instructions
Section table3(const Lab& lab);           // wrong square roots
Section repairs(const Lab& lab);          // how far the two repairs reach
Section table4(const Lab& lab);           // fast square roots
Section table5(const Lab& lab);           // and Figure 3: one byte and one bit a pair
Section figure4(const Lab& lab);          // brute force over the number of objects
Section table6(const Lab& lab);           // the stages with the grid
Section table7(const Lab& lab);           // with and without the grid
Section figure5(const Lab& lab);          // over the number of objects, beside Bullet
Section figure6(const Lab& lab);          // over the share of moving objects, beside Bullet
Section scenes(const Lab& lab);           // Figure 1 and the comparison with the literature
Section cell_study(const Lab& lab);       // the best X, the best size of cells
Section slips(const Lab& lab);            // what is wrong in the paper, with proof

struct Experiment {
  const char* name;
  Section (*run)(const Lab& lab);
};
const std::vector<Experiment>& experiments();

// Runs those named (all, where none is), telling each section as it is done. Throws Failure that
// names an unknown one.
std::vector<Section> evaluate(const Lab& lab, const std::vector<std::string>& only,
                              const std::function<void(const Section&)>& done);

// Rows that searched the same boxes for all pairs and found different ones, a line each; empty
// where all agree. The racy rows are known to lose pairs, and are left out.
std::vector<std::string> disagreements(const std::vector<Section>& sections);

// The page of all sections: machine, summary, then each.
report::Page page_of(const Lab& lab, const std::vector<Section>& sections);

}  // namespace throng::paper
