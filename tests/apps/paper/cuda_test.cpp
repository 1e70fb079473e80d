// On a GPU, if there is one: every variant against the double loop. The thread functions are tested
// on the host elsewhere; this tests the launches, transfers, atomics and the scan.
#include "apps/paper/cuda.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "apps/paper/failure.hpp"
#include "apps/paper/grid.hpp"
#include "base/pair_index.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::paper {
namespace {

using tests::BoxList;

std::vector<Pair> on_cuda(const Variant& variant, const BoxList& boxes) {
  Job job;
  job.variant = variant;
  job.n = boxes.size();
  job.environment = environment_of(boxes.data(), boxes.size());
  const auto stepper = make_cuda_stepper(job);
  stepper->step(boxes.data());
  std::vector<Pair> pairs =
      stepper->step(boxes.data()).pairs;  // the second time: into reused memory
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

class Cuda : public testing::Test {
 protected:
  void SetUp() override {
    if (!why_no_cuda().empty()) GTEST_SKIP() << why_no_cuda();
  }
};

TEST_F(Cuda, EveryFormButTheRacyOneIsExact) {
  for (const int n : {0, 1, 2, 33, 700})
    for (const BoxList& boxes :
         {n == 0 ? BoxList{} : tests::identical_boxes(n, 1), tests::uniform_boxes(n, 2)}) {
      const std::vector<Pair> truth = tests::reference_pairs(boxes).pairs;
      Variant variant;
      for (const MappingKind mapping :
           {MappingKind::formula, MappingKind::lazy, MappingKind::stored, MappingKind::fold,
            MappingKind::exact}) {
        variant.mapping = mapping;
        variant.output = Output::bit;
        for (const Write write : {Write::atomic, Write::ballot, Write::owned}) {
          variant.write = write;
          EXPECT_EQ(on_cuda(variant, boxes), truth) << describe(variant) << " n " << n;
        }
        for (const Output output : {Output::byte, Output::pairs}) {
          variant.output = output;
          EXPECT_EQ(on_cuda(variant, boxes), truth) << describe(variant) << " n " << n;
        }
      }
    }
}

// Roots round on the GPU as on the host: the same pairs, and the same wrong ones.
TEST_F(Cuda, RootsAreWrongAsOnTheHost) {
  const BoxList boxes = tests::identical_boxes(1500, 3);
  for (const RootKind root :
       {RootKind::float32, RootKind::float64, RootKind::carmack, RootKind::lomont})
    for (const Radicand radicand : {Radicand::integer, Radicand::real})
      for (const bool repair : {false, true})
        for (int steps = min_steps; steps <= max_steps; ++steps) {
          Job job;
          job.n = boxes.size();
          job.variant.root = root;
          job.variant.radicand = radicand;
          job.variant.repair = repair;
          job.variant.steps = steps;
          job.variant.output = Output::pairs;
          std::vector<Pair> here = make_host_stepper(job)->step(boxes.data()).pairs;
          std::sort(here.begin(), here.end());
          EXPECT_EQ(on_cuda(job.variant, boxes), here) << describe(job.variant);
        }
  for (const RootKind root : {RootKind::float32, RootKind::float64, RootKind::lomont})
    EXPECT_EQ(time_roots_on_cuda(root, 2, 100000, 1).sum,
              time_roots_on_host(root, 2, 100000, 1, 1).sum);
}

// The result of the race depends on the machine; it adds no pairs. The loss is recorded.
TEST_F(Cuda, RacyFormAddsNoPairs) {
  const BoxList boxes = tests::identical_boxes(700, 1);
  Variant variant;
  variant.write = Write::racy;
  const std::vector<Pair> found = on_cuda(variant, boxes),
                          truth = tests::reference_pairs(boxes).pairs;
  EXPECT_TRUE(std::includes(truth.begin(), truth.end(), found.begin(), found.end()));
  RecordProperty("lost", std::to_string(truth.size() - found.size()));
  RecordProperty("of", std::to_string(truth.size()));
}

TEST_F(Cuda, GridFindsWhatTheDoubleLoopFinds) {
  for (const tests::HardScene& scene : tests::hard_scenes(1500)) {
    const std::vector<Pair> truth = tests::reference_pairs(scene.boxes).pairs;
    for (const double per_cell : {0.5, 8.0, 1e6})
      for (const MappingKind mapping :
           {MappingKind::formula, MappingKind::lazy, MappingKind::fold}) {
        Variant variant;
        variant.per_cell = per_cell;
        variant.mapping = mapping;
        EXPECT_EQ(on_cuda(variant, scene.boxes), truth) << scene.name << " " << describe(variant);
      }
  }
}

}  // namespace
}  // namespace throng::paper
