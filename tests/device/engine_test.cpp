// The engine on a device whose memory the host cannot access: every form of the result, and a
// memory cap that holds to the byte on the device and on the host.
#include "device/engine.hpp"

#include <gtest/gtest.h>

#include "device/collected.hpp"
#include "device/discrete_device.hpp"
#include "support/counting_resource.hpp"
#include "support/hard_boxes.hpp"
#include "support/reference.hpp"

namespace throng::device {
namespace {

using tests::Answer;
using tests::BoxList;
using tests::CountingResource;

using DiscreteEngine = Engine<DiscreteDevice>;

Options options_of(Order order, Algorithm algorithm) {
  Options o;
  o.order = order;
  o.algorithm = algorithm;
  return o;
}
std::vector<Options> all_options() {
  std::vector<Options> all;
  for (const Order order : {Order::any, Order::canonical})
    for (const Algorithm a : {Algorithm::grid, Algorithm::all_pairs})
      all.push_back(options_of(order, a));
  return all;
}

base::Output growing(std::vector<Pair>& out) {
  return {out.data(), out.size(),
          [](void* context, std::size_t count) {
            auto& v = *static_cast<std::vector<Pair>*>(context);
            v.resize(count);
            return v.data();
          },
          &out};
}

void expect_answer(const Options& o, const Answer& answer, const std::vector<Pair>& got) {
  if (o.order == Order::canonical) {
    EXPECT_TRUE(got == answer.pairs);
  }
  EXPECT_TRUE(tests::same_pairs(got, answer.pairs));
}

TEST(DiscreteEngine, EveryFormOfTheResult) {
  const BoxList a = tests::uniform_boxes(3000, 1), b = tests::uniform_boxes(2000, 2),
                many = tests::identical_boxes(300, 3);
  std::vector<std::int32_t> worlds;
  for (std::size_t i = 0; i < a.size(); ++i) worlds.push_back(static_cast<int>(i % 5) - 1);
  Boxes with_worlds = a;
  with_worlds.filters.world = {worlds.data(), worlds.size()};
  const Boxes view_b = b;
  const Answer of_a = tests::reference_pairs(a), of_many = tests::reference_pairs(many),
               of_worlds = tests::reference_pairs(with_worlds),
               of_two = tests::reference_pairs(a, b);
  CountingResource memory;
  for (const Options& o : all_options()) {
    DiscreteEngine engine(&memory);
    const auto check = [&](const Boxes& first, const Boxes* second, const Answer& answer) {
      std::vector<Pair> out;
      base::Output output = growing(out);
      Result r;
      engine.find(first, second, o, 0, &output, nullptr, r);
      EXPECT_TRUE(r.ok());
      EXPECT_EQ(r.found, answer.pairs.size());
      out.resize(r.found);
      expect_answer(o, answer, out);
      // Capacity for one pair too few.
      std::vector<Pair> small(out.size() - 1);
      base::Output fixed{small.data(), small.size(), nullptr, nullptr};
      r = {};
      engine.find(first, second, o, 0, &fixed, nullptr, r);
      EXPECT_EQ(r.status, Status::buffer_too_small);
      EXPECT_EQ(r.found, answer.pairs.size());
      EXPECT_EQ(r.written, o.order == Order::canonical ? 0 : small.size());
      Collected taken;
      r = {};
      const Consumer consumer(taken);
      engine.find(first, second, o, 0, nullptr, &consumer, r);
      EXPECT_EQ(r.written, answer.pairs.size());
      EXPECT_LE(taken.largest, DiscreteDevice::piece);
      expect_answer(o, answer, taken.pairs);
      EXPECT_EQ(engine.held(), memory.held());
    };
    check(a, nullptr, of_a);
    check(many, nullptr, of_many);
    check(with_worlds, nullptr, of_worlds);
    check(a, &view_b, of_two);
  }
  EXPECT_EQ(memory.held(), 0u);
}

std::size_t bytes_needed(DiscreteEngine& engine, const Boxes& boxes, Options o, std::size_t cap,
                         std::size_t already_held) {
  o.memory_cap_bytes = cap;
  Collected taken;
  const Consumer consumer(taken);
  Result r;
  try {
    engine.find(boxes, nullptr, o, already_held, nullptr, &consumer, r);
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.status, Status::memory_cap_too_small);
    return failure.bytes;
  }
  return 0;
}

// The reported size suffices exactly; one byte less does not, and then nothing is allocated.
TEST(DiscreteEngine, TheCapHoldsToTheByte) {
  const BoxList boxes = tests::identical_boxes(250, 1);
  const Answer answer = tests::reference_pairs(boxes);
  for (const Options& base : all_options()) {
    for (const std::size_t already_held : {std::size_t{0}, std::size_t{12345}}) {
      CountingResource memory;
      DiscreteEngine engine(&memory);
      const std::size_t needed = bytes_needed(engine, boxes, base, 1, already_held);
      EXPECT_LT(needed, answer.pairs.size() * sizeof(Pair)) << "blocks, not all pairs";
      EXPECT_EQ(bytes_needed(engine, boxes, base, needed - 1, already_held), needed);
      EXPECT_EQ(memory.allocations(), 0u) << "an allocation before the cap was checked";
      for (const std::size_t cap : {needed, needed + 4567, 3 * needed}) {
        CountingResource counted;
        DiscreteEngine capped(&counted);
        Options o = base;
        o.memory_cap_bytes = cap;
        Collected taken;
        const Consumer consumer(taken);
        Result r;
        capped.find(boxes, nullptr, o, already_held, nullptr, &consumer, r);
        expect_answer(o, answer, taken.pairs);
        EXPECT_LE(counted.peak() + already_held, cap);
        EXPECT_EQ(capped.held(), counted.held());
      }
    }
  }
}

// Two sets, where one box of the first may overlap all of the second.
TEST(DiscreteEngine, TheCapInTwoSets) {
  const BoxList few = tests::identical_boxes(40, 1), many = tests::identical_boxes(600, 1);
  const Boxes of_few = few, of_many = many;
  for (const bool few_first : {true, false}) {
    const Boxes &a = few_first ? of_few : of_many, &b = few_first ? of_many : of_few;
    const Answer answer = tests::reference_pairs(a, b);
    for (Options o : all_options()) {
      CountingResource memory;
      DiscreteEngine engine(&memory);
      Collected taken;
      const Consumer consumer(taken);
      Result r;
      o.memory_cap_bytes = 1;
      try {
        engine.find(a, &b, o, 0, nullptr, &consumer, r);
        FAIL() << "one byte was accepted as a cap";
      } catch (const Failure& failure) {
        ASSERT_EQ(failure.status, Status::memory_cap_too_small);
        o.memory_cap_bytes = failure.bytes;
      }
      engine.find(a, &b, o, 0, nullptr, &consumer, r);
      expect_answer(o, answer, taken.pairs);
      EXPECT_EQ(r.found, answer.pairs.size());
      EXPECT_LE(memory.peak(), o.memory_cap_bytes);
    }
  }
}

TEST(DiscreteEngine, NoBoxesTakeNoMemory) {
  const BoxList none;
  CountingResource memory;
  DiscreteEngine engine(&memory);
  for (const Options& o : all_options()) {
    std::vector<Pair> out;
    base::Output output = growing(out);
    Result r;
    engine.find(none, nullptr, o, 0, &output, nullptr, r);
    EXPECT_TRUE(r.ok());
    EXPECT_EQ(r.found, 0u);
  }
  EXPECT_EQ(memory.allocations(), 0u);
}

// If the caller's buffer is too small, the engine allocates no memory for all pairs.
TEST(DiscreteEngine, SmallBufferForManyPairs) {
  const BoxList boxes = tests::identical_boxes(1500, 1);
  for (const Options& o : all_options()) {
    CountingResource memory;
    DiscreteEngine engine(&memory);
    for (const std::size_t capacity : {0, 1, 700, 5000}) {
      std::vector<Pair> out(capacity + 1);
      base::Output output{out.data(), capacity, nullptr, nullptr};
      Result r;
      engine.find(boxes, nullptr, o, 0, &output, nullptr, r);
      EXPECT_EQ(r.status, Status::buffer_too_small);
      EXPECT_EQ(r.found, 1500u * 1499 / 2);
      EXPECT_EQ(r.written, o.order == Order::canonical ? 0 : capacity);
      EXPECT_EQ(out[capacity], (Pair{}));
      if (capacity <= 700) {
        EXPECT_LT(memory.held(), 300000u);
      }
    }
  }
}

// Memory of larger calls is released under a cap, and only then.
TEST(DiscreteEngine, ACapAfterLargerCalls) {
  const BoxList large = tests::uniform_boxes(20000, 1), small = tests::identical_boxes(500, 2);
  const Answer answer = tests::reference_pairs(small);
  for (const Options& base : all_options()) {
    CountingResource memory;
    DiscreteEngine engine(&memory);
    std::vector<Pair> out;
    base::Output output = growing(out);
    Result r;
    engine.find(large, nullptr, options_of(base.order, Algorithm::grid), 0, &output, nullptr, r);
    Options o = base;
    o.memory_cap_bytes = 600000;
    ASSERT_GT(engine.held(), o.memory_cap_bytes);
    std::size_t allocations = 0;
    for (int frame = 0; frame < 3; ++frame) {
      Collected taken;
      const Consumer consumer(taken);
      engine.find(small, nullptr, o, 0, nullptr, &consumer, r);
      expect_answer(o, answer, taken.pairs);
      EXPECT_LE(memory.held(), o.memory_cap_bytes);
      EXPECT_EQ(memory.held(), engine.held());
      if (frame > 0) {
        EXPECT_EQ(memory.allocations(), allocations) << "allocated again in each frame";
      }
      allocations = memory.allocations();
    }
  }
}

// Refused by count alone: no box is read and no memory allocated.
TEST(DiscreteEngine, TooManyBoxes) {
  const Box box = tests::cube(0, 0, 0, 1);
  CountingResource memory;
  DiscreteEngine engine(&memory);
  const Boxes most(&box, max_pipeline_boxes, 0), one(&box, 1, 0);
  const Boxes more(&box, max_pipeline_boxes + 1, 0), all(&box, 0xffffffffu, 0);
  for (const auto& [a, b] : {std::pair<const Boxes*, const Boxes*>{&more, nullptr},
                             {&all, nullptr},
                             {&most, &one},
                             {&all, &all}}) {
    Result r;
    std::vector<Pair> out;
    base::Output output = growing(out);
    try {
      engine.find(*a, b, {}, 0, &output, nullptr, r);
      FAIL() << "too many boxes were accepted";
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.status, Status::too_many_boxes);
      EXPECT_EQ(failure.bytes, a->size() + (b ? b->size() : 0));
    }
  }
  EXPECT_EQ(memory.allocations(), 0u);
}

TEST(DiscreteEngine, AConsumerStopsOrThrows) {
  const BoxList boxes = tests::identical_boxes(400, 1);
  CountingResource memory;
  DiscreteEngine engine(&memory);
  std::size_t taken = 0;
  const auto stop = [&](const Pair*, std::size_t count) {
    taken += count;
    return taken < 250;
  };
  const Consumer stopper(stop);
  Result r;
  engine.find(boxes, nullptr, {}, 0, nullptr, &stopper, r);
  EXPECT_EQ(r.status, Status::stopped);
  EXPECT_EQ(r.written, taken);
  EXPECT_EQ(taken, 3 * DiscreteDevice::piece);
  const auto thrower = [](const Pair*, std::size_t) -> bool { throw 4711; };
  const Consumer throwing(thrower);
  EXPECT_THROW(engine.find(boxes, nullptr, {}, 0, nullptr, &throwing, r), int);
  Collected all;
  const Consumer collecting(all);
  r = {};
  engine.find(boxes, nullptr, {}, 0, nullptr, &collecting, r);
  EXPECT_EQ(all.pairs.size(), 400u * 399 / 2);
}

// Each allocation fails in turn; the engine remains usable.
TEST(DiscreteEngine, MemoryRunsShort) {
  const BoxList boxes = tests::uniform_boxes(tests::sanitized ? 800 : 2000, 1);
  const Answer answer = tests::reference_pairs(boxes);
  for (const Options& o : all_options()) {
    CountingResource full;
    {
      DiscreteEngine engine(&full);
      std::vector<Pair> out;
      base::Output output = growing(out);
      Result r;
      engine.find(boxes, nullptr, o, 0, &output, nullptr, r);
    }
    std::size_t refused = 0;
    // Limits below the sum at each allocation; the last one is one byte below the peak.
    std::vector<std::size_t> limits = {0, full.peak() - 1};
    for (std::size_t k = 1; k < 20; ++k) limits.push_back(full.peak() * k / 20);
    for (const std::size_t limit : limits) {
      CountingResource memory;
      memory.limit(limit);
      DiscreteEngine engine(&memory);
      std::vector<Pair> out;
      base::Output output = growing(out);
      Result r;
      try {
        engine.find(boxes, nullptr, o, 0, &output, nullptr, r);
      } catch (const Failure& failure) {
        ++refused;
        EXPECT_EQ(failure.status, Status::out_of_memory);
        EXPECT_GT(failure.bytes, 0u);
      }
      EXPECT_LE(memory.peak(), limit);
      memory.limit(full.peak() * 2);
      output = growing(out);
      r = {};
      engine.find(boxes, nullptr, o, 0, &output, nullptr, r);
      out.resize(r.found);
      expect_answer(o, answer, out);
    }
    EXPECT_EQ(refused, limits.size());
  }
}

}  // namespace
}  // namespace throng::device
