// The forms of output: what each writes, how it is decoded, and which one loses pairs.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <mutex>
#include <vector>

#include "apps/paper/failure.hpp"
#include "apps/paper/host.hpp"
#include "apps/paper/matrix.hpp"
#include "apps/paper/search.hpp"
#include "apps/paper/stepper.hpp"
#include "base/pair_index.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::paper {
namespace {

using tests::BoxList;

std::vector<Pair> sorted(std::vector<Pair> pairs) {
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

std::vector<Pair> run(const Variant& variant, const BoxList& boxes, unsigned threads = 1) {
  Job job;
  job.variant = variant;
  job.n = boxes.size();
  job.threads = threads;
  return sorted(make_host_stepper(job)->step(boxes.data()).pairs);
}

TEST(Matrix, PairNineteenIsBitThreeOfByteTwo) {
  std::vector<std::uint8_t> matrix(byte_count(28), 0);
  EXPECT_EQ(matrix.size(), 4u);
  matrix[2] = 1u << 3;
  for (std::uint64_t k = 0; k < 28; ++k) EXPECT_EQ(test_bit(matrix.data(), k), k == 19);
  EXPECT_EQ(byte_count(32), 4u);
  EXPECT_EQ(byte_count(33), 5u);
  EXPECT_EQ(word_count(32), 1u);
  EXPECT_EQ(word_count(33), 2u);
  EXPECT_EQ(word_count(0), 0u);
}

TEST(Matrix, DecodingAgreesWithTheQuery) {
  tests::Random random(3);
  std::vector<std::uint32_t> words(word_count(1000));
  for (std::uint32_t& word : words)
    word = static_cast<std::uint32_t>(random.next() & random.next());
  words.back() &= (1u << 1000 % 32) - 1;
  std::vector<std::uint64_t> set_bits, from_words, from_bytes;
  std::vector<std::uint8_t> bytes(1000);
  for (std::uint64_t k = 0; k < 1000; ++k) {
    if (!test_bit(reinterpret_cast<const std::uint8_t*>(words.data()), k)) continue;
    set_bits.push_back(k);
    bytes[k] = 1;
  }
  for_each_bit(words.data(), 1000, [&](std::uint64_t k) { from_words.push_back(k); });
  for_each_byte(bytes.data(), 1000, [&](std::uint64_t k) { from_bytes.push_back(k); });
  EXPECT_GT(set_bits.size(), 100u);
  EXPECT_EQ(from_words, set_bits);
  EXPECT_EQ(from_bytes, set_bits);
}

// Each method sets exactly the bits of the overlapping pairs, in the paper's numbering.
TEST(Output, BitsAreThoseOfTheOverlappingPairs) {
  const BoxList boxes = tests::uniform_boxes(150, 5);
  const PairTest<Exact> test{Exact{}, boxes.data(), boxes.size()};
  const std::uint64_t count = base::pair_count(boxes.size());
  std::vector<std::uint32_t> atomic(word_count(count)), owned(word_count(count), ~0u);
  std::vector<std::uint8_t> bytes(count, 7);
  for (std::uint64_t k = 0; k < count; ++k) {
    WriteBitAtomic<PairTest<Exact>>{test, atomic.data()}(k);
    WriteByte<PairTest<Exact>>{test, bytes.data()}(k);
  }
  for (std::uint64_t w = 0; w < owned.size(); ++w) {
    WriteWord<PairTest<Exact>>{test, owned.data(), count}(w);
  }
  std::uint64_t set = 0, k = 0;
  for (std::uint32_t i = 0; i < boxes.size(); ++i)
    for (std::uint32_t j = i + 1; j < boxes.size(); ++j, ++k) {
      const bool overlap = base::overlaps(boxes[i], boxes[j]);
      set += overlap;
      ASSERT_EQ(test_bit(reinterpret_cast<const std::uint8_t*>(atomic.data()), k), overlap) << k;
      ASSERT_EQ(bytes[k], overlap ? 1 : 0) << k;
    }
  EXPECT_GT(set, 10u);
  EXPECT_EQ(atomic, owned);
}

Variant variant_of(MappingKind mapping, Output output, Write write) {
  Variant variant;
  variant.mapping = mapping;
  variant.output = output;
  variant.write = write;
  return variant;
}

TEST(Output, EveryFormButTheRacyOneIsExact) {
  const MappingKind mappings[] = {MappingKind::formula, MappingKind::lazy, MappingKind::stored,
                                  MappingKind::fold, MappingKind::exact};
  for (const int n : {0, 1, 2, 9, 100, 301}) {
    // All overlap; and some do.
    for (const BoxList& boxes :
         {n == 0 ? BoxList{} : tests::identical_boxes(n, 1), tests::uniform_boxes(n, 2)}) {
      const std::vector<Pair> truth = tests::reference_pairs(boxes).pairs;
      for (const MappingKind mapping : mappings)
        for (const unsigned threads : {1u, 3u}) {
          for (const Write write : {Write::atomic, Write::ballot, Write::owned})
            EXPECT_EQ(run(variant_of(mapping, Output::bit, write), boxes, threads), truth)
                << name(mapping) << " " << name(write) << " n " << n;
          EXPECT_EQ(run(variant_of(mapping, Output::byte, Write::racy), boxes, threads), truth);
          EXPECT_EQ(run(variant_of(mapping, Output::pairs, Write::racy), boxes, threads), truth);
        }
    }
  }
}

// Eight lanes that all find an overlap read the same empty byte, and the last write wins: one pair
// of eight remains.
TEST(Output, RacyFormLosesSevenOfEight) {
  for (const int n : {9, 64, 200}) {
    const BoxList boxes = tests::identical_boxes(n, 1);
    const std::uint64_t all = base::pair_count(boxes.size());
    const std::vector<Pair> found =
        run(variant_of(MappingKind::formula, Output::bit, Write::racy), boxes);
    EXPECT_EQ(found.size(), byte_count(all));
    EXPECT_LT(found.size(), all);
    for (const Pair& pair : found) {
      const std::uint64_t k = base::row_index(pair.first, pair.second, boxes.size());
      EXPECT_TRUE(k % 8 == 7 || k == all - 1) << k;
    }
  }
}

// It loses pairs, but adds none; where no two pairs share a byte it is exact.
TEST(Output, RacyFormAddsNoPairs) {
  const BoxList boxes = tests::snapped_boxes(200, 4, 1.0f, 17);
  const std::vector<Pair> truth = tests::reference_pairs(boxes).pairs;
  const std::vector<Pair> found =
      run(variant_of(MappingKind::formula, Output::bit, Write::racy), boxes);
  EXPECT_LT(found.size(), truth.size());
  EXPECT_TRUE(std::includes(truth.begin(), truth.end(), found.begin(), found.end()));
  BoxList apart;
  for (int i = 0; i < 40; ++i) apart.push_back(tests::cube(static_cast<float>(3 * i), 0, 0, 1));
  apart[39] = apart[0];
  EXPECT_EQ(run(variant_of(MappingKind::formula, Output::bit, Write::racy), apart),
            (std::vector<Pair>{{0, 39}}));
}

// With an inexact root and no repair, pairs are lost; with the repairs none is.
TEST(Output, WrongRootsLosePairsUntilRepaired) {
  const BoxList boxes = tests::identical_boxes(1200, 3);
  Variant variant = variant_of(MappingKind::formula, Output::pairs, Write::ballot);
  variant.root = RootKind::carmack;
  variant.repair = false;
  const std::vector<Pair> broken = run(variant, boxes);
  variant.repair = true;
  const std::vector<Pair> repaired = run(variant, boxes);
  EXPECT_EQ(repaired, tests::reference_pairs(boxes).pairs);
  EXPECT_NE(broken, repaired);
}

TEST(Output, InvertedBoxesAreEmptySlots) {
  BoxList boxes = tests::with_inverted(300, 4);
  constexpr float inf = std::numeric_limits<float>::infinity();
  boxes[0] = {{-inf, -inf, -inf}, {inf, inf, inf}};  // would overlap any of them
  const tests::Answer answer = tests::reference_pairs(boxes);
  EXPECT_GT(answer.inactive, 20u);
  EXPECT_EQ(run(variant_of(MappingKind::formula, Output::bit, Write::ballot), boxes), answer.pairs);
  EXPECT_EQ(run(variant_of(MappingKind::lazy, Output::pairs, Write::ballot), boxes), answer.pairs);
}

// A stepper is reusable: no state of the previous step remains.
TEST(Output, StepsAreIndependent) {
  const BoxList many = tests::identical_boxes(120, 1);
  const BoxList few = tests::uniform_boxes(120, 9);
  for (const Output output : {Output::bit, Output::byte, Output::pairs})
    for (const Write write : {Write::atomic, Write::ballot, Write::owned}) {
      Job job;
      job.variant = variant_of(MappingKind::formula, output, write);
      job.n = 120;
      const auto stepper = make_host_stepper(job);
      EXPECT_EQ(stepper->step(many.data()).pairs.size(), base::pair_count(120));
      EXPECT_EQ(sorted(stepper->step(few.data()).pairs), tests::reference_pairs(few).pairs);
    }
}

TEST(Output, MemoryLimitIsExact) {
  Job job;
  job.n = 1000;  // 499,500 pairs: 15,610 words
  job.memory_bytes = 62440;
  EXPECT_NO_THROW(make_host_stepper(job));
  job.memory_bytes = 62439;
  try {
    make_host_stepper(job);
    FAIL() << "not refused";
  } catch (const Failure& failure) {
    EXPECT_NE(std::string(failure.what()).find("62,440 bytes"), std::string::npos)
        << failure.what();
    EXPECT_NE(std::string(failure.what()).find("--grid"), std::string::npos) << failure.what();
  }
  job.variant.output = Output::byte;
  job.memory_bytes = 499499;
  EXPECT_THROW(make_host_stepper(job), Failure);
  job.variant.output = Output::pairs;
  EXPECT_NO_THROW(make_host_stepper(job));
  job.variant.mapping = MappingKind::stored;
  EXPECT_THROW(make_host_stepper(job), Failure);
  job.n = max_objects + 1;
  job.variant.mapping = MappingKind::formula;
  EXPECT_THROW(make_host_stepper(job), Failure);
}

// The host's threads run concurrently: each waits in its block until all three have one.
TEST(Host, ThreadsShareTheWork) {
  std::mutex mutex;
  std::condition_variable arrival;
  int arrived = 0;
  bool together = true;
  std::vector<int> visits(3 * 64, 0);
  HostDevice(3).teams(visits.size(), [&](std::uint64_t team, std::uint32_t, std::uint32_t) {
    ++visits[team];
    if (team % 64 != 0) return;
    std::unique_lock<std::mutex> lock(mutex);
    ++arrived;
    arrival.notify_all();
    if (!arrival.wait_for(lock, std::chrono::seconds(20), [&] { return arrived == 3; })) {
      together = false;
    }
  });
  EXPECT_TRUE(together);
  EXPECT_EQ(std::count(visits.begin(), visits.end(), 1), 192);
}

}  // namespace
}  // namespace throng::paper
