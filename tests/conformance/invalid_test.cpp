// Invalid input is rejected with a message, and no pair is found; empty slots are counted.
#include <cstdlib>
#include <set>

#include "support/configs.hpp"
#include "support/hard_boxes.hpp"
#include "support/process.hpp"

namespace throng::tests {
namespace {

class Invalid : public Conformance {
 protected:
  void expect_found(const Finder& finder, const Result& result, const Answer& answer) const {
    expect_pairs(result, config(), answer, to_vector(finder.pairs()), 0);
  }
};

constexpr float quiet = std::numeric_limits<float>::quiet_NaN();

// NaN in each of the six coordinates in turn.
BoxList with_nan(BoxList boxes, std::size_t first, std::size_t step) {
  int k = 0;
  for (std::size_t i = first; i < boxes.size(); i += step, ++k)
    (&boxes[i].lower.x)[k % 6] = k % 2 ? quiet : -quiet;
  return boxes;
}

TEST_P(Invalid, NanIsRefusedByIndexAndCount) {
  Finder finder(options());
  for (const int n : {1, 2, 17, 40, 3000}) {
    const BoxList good = uniform_boxes(n, 1);
    for (const std::size_t first :
         {std::size_t{0}, static_cast<std::size_t>(n) / 2, static_cast<std::size_t>(n) - 1}) {
      SCOPED_TRACE(std::to_string(n) + " boxes, the first NaN in " + std::to_string(first));
      const BoxList boxes = with_nan(good, first, 13);
      const std::size_t count = (static_cast<std::size_t>(n) - 1 - first) / 13 + 1;
      std::vector<Pair> buffer(100, Pair{5, 6});
      for (const bool own : {true, false}) {
        const Result result =
            own ? finder.find(boxes) : finder.find(boxes, buffer.data(), buffer.size());
        EXPECT_EQ(result.status, Status::nan_box);
        EXPECT_EQ(result.first_invalid, first);
        EXPECT_EQ(result.invalid_count, count);
        EXPECT_EQ(result.written, 0u);
        const std::string message = result.message;
        EXPECT_NE(message.find(std::to_string(first)), std::string::npos) << message;
        EXPECT_NE(message.find(std::to_string(count)), std::string::npos) << message;
      }
      for (const Pair& pair : buffer) ASSERT_TRUE((pair == Pair{5, 6}));
      for (const bool second : {false, true}) {
        const Result result = second ? finder.find(good, boxes) : finder.find(boxes, good);
        EXPECT_EQ(result.status, Status::nan_box);
        EXPECT_EQ(result.first_invalid, first);
        EXPECT_EQ(result.invalid_count, count);
        EXPECT_EQ(result.inactive, 0u) << "a rejected box is not an empty slot";
        const char* set = second ? "of the second set" : "of the first set";
        EXPECT_NE(std::string(result.message).find(set), std::string::npos) << result.message;
      }
    }
  }
}

// Every coordinate, in every vector lane.
TEST_P(Invalid, NanIsSeenInEveryPlace) {
  Finder finder(options());
  for (std::size_t i = 0; i < 40; ++i) {
    for (int k = 0; k < 6; ++k) {
      BoxList boxes = uniform_boxes(40, 1);
      (&boxes[i].lower.x)[k] = quiet;
      const Result result = finder.find(boxes);
      ASSERT_EQ(result.status, Status::nan_box) << i << ' ' << k;
      ASSERT_EQ(result.first_invalid, i);
      ASSERT_EQ(result.invalid_count, 1u);
    }
  }
}

TEST_P(Invalid, NanIsInactiveIfRequested) {
  Options with = options();
  with.nan = NanPolicy::inactive;
  Finder finder(with);
  for (const int n : {1, 33, 700}) {
    for (const BoxList& plain :
         {uniform_boxes(n, 1), with_inverted(n, 2), snapped_boxes(n, 20, 1, 3)}) {
      const BoxList boxes = with_nan(plain, 0, 7);
      const Answer one = reference_pairs(boxes);
      EXPECT_GE(one.inactive, static_cast<std::uint64_t>(n) / 7);
      expect_found(finder, finder.find(boxes), one);
      const Answer two = reference_pairs(plain, boxes);
      expect_found(finder, finder.find(plain, boxes), two);
    }
  }
  const BoxList all(50, Box{{quiet, quiet, quiet}, {quiet, quiet, quiet}});
  const Result result = finder.find(all);
  EXPECT_TRUE(result.ok());
  EXPECT_EQ(result.inactive, 50u);
  EXPECT_EQ(result.found, 0u);
}

// A margin must activate neither a NaN box nor an empty slot.
TEST_P(Invalid, MarginActivatesNothing) {
  Options with = options();
  with.nan = NanPolicy::inactive;
  with.margin = 100;
  Finder finder(with);
  const BoxList boxes = with_nan(with_inverted(400, 5), 3, 11);
  const Answer answer = reference_pairs(boxes, with.margin);
  expect_found(finder, finder.find(boxes), answer);
}

TEST_P(Invalid, AllInverted) {
  const BoxList boxes(70, Box{{1, 1, 1}, {0, 2, 2}});
  expect_exact(boxes, config(), reference_pairs(boxes));
  expect_exact(boxes, boxes, config(), reference_pairs(boxes, boxes));
}

TEST_P(Invalid, Options) {
  const BoxList boxes = uniform_boxes(40, 1);
  for (const float margin : {-1.0f, -denormal, -infinity, infinity, quiet}) {
    throng::Options with = options();
    with.margin = margin;
    Finder finder(with);
    const Result result = finder.find(boxes);
    EXPECT_EQ(result.status, Status::bad_option) << margin;
    EXPECT_STRNE(result.message, "");
    EXPECT_EQ(finder.pairs().size(), 0u);
    finder.set_options(options());
    EXPECT_TRUE(finder.find(boxes).ok()) << "with the option fixed";
  }
  for (const float scale : {0.0f, -1.0f, denormal, 0.0156f, 64.01f, infinity, -infinity, quiet}) {
    throng::Options with = options();
    with.cell_scale = scale;
    const Result result = Finder(with).find(boxes);
    EXPECT_EQ(result.status, Status::bad_option) << scale;
    EXPECT_NE(std::string(result.message).find("within 1/64 and 64"), std::string::npos);
  }
  throng::Options minus_zero = options();
  minus_zero.margin = -0.0f;
  EXPECT_EQ(find_pairs(boxes, minus_zero).size(), reference_pairs(boxes).pairs.size());
}

// As from a cast or an uninitialized struct.
TEST_P(Invalid, InvalidEnumValues) {
  const BoxList boxes = uniform_boxes(40, 1);
  const auto is_refused = [&](auto option, const char* name, auto last) {
    for (const int value : {static_cast<int>(last) + 1, 77, 255}) {
      throng::Options with = options();
      with.*option = static_cast<decltype(last)>(value);
      Finder finder(with);
      Result result = finder.find(boxes);
      const std::string named = std::string(name) + " is " + std::to_string(value) + ",";
      EXPECT_EQ(result.status, Status::bad_option) << named;
      EXPECT_NE(std::string(result.message).find(named), std::string::npos) << result.message;
      EXPECT_EQ(finder.pairs().size(), 0u);
      EXPECT_THROW((void)finder.explain(boxes), Error) << named;
      EXPECT_EQ(BroadPhase(with).update().status, Status::bad_option) << named;
      finder.set_options(options());
      EXPECT_TRUE(finder.find(boxes).ok()) << "with the option fixed";
    }
  };
  is_refused(&throng::Options::algorithm, "Options::algorithm", Algorithm::grid);
  is_refused(&throng::Options::order, "Options::order", Order::canonical);
  is_refused(&throng::Options::backend, "Options::backend", Backend::emulated);
  is_refused(&throng::Options::nan, "Options::nan", NanPolicy::inactive);
  is_refused(&throng::Options::inverted, "Options::inverted", InvertedPolicy::inactive);
  is_refused(&throng::Options::isa, "Options::isa", *std::rbegin(all_isas));
  UpdateOptions of_update;
  of_update.isa = static_cast<Isa>(77);
  Box box;
  EXPECT_EQ(update_boxes({}, &box, of_update).status, Status::bad_option);
}

TEST_P(Invalid, MissingArrays) {
  const float c[2] = {1, 2};
  Finder finder(options());
  const Boxes bad[] = {
      Boxes(static_cast<const Box*>(nullptr), 2), Boxes::split(nullptr, nullptr, 2),
      Boxes::arrays(c, c, c, c, c, nullptr, 2),   Boxes::arrays(c, c, nullptr, c, c, c, 2),
      Boxes::arrays(nullptr, c, c, c, c, c, 2),   Boxes::arrays(c, c, c, c, nullptr, c, 2),
      Boxes::arrays(c, c, c, c, c, c, 2, 6)};
  for (const Boxes& boxes : bad) {
    for (int form = 0; form < 3; ++form) {
      const BoxList good = uniform_boxes(3, 1);
      const Result result = form == 0   ? finder.find(boxes)
                            : form == 1 ? finder.find(good, boxes)
                                        : finder.find(boxes, good);
      EXPECT_EQ(result.status, Status::bad_boxes);
      EXPECT_STRNE(result.message, "");
    }
  }
}

// 4e9 boxes in one set: rejected before the first is read.
TEST_P(Invalid, TooManyBoxes) {
  const Box box = cube(0, 0, 0, 1);
  Finder finder(options());
  const Boxes many(&box, static_cast<std::size_t>(max_box_count) + 1, 0);
  for (const Result& result :
       {finder.find(many), finder.find(many, BoxList{box}), finder.find(BoxList{box}, many)}) {
    EXPECT_EQ(result.status, Status::too_many_boxes);
    EXPECT_NE(std::string(result.message).find(std::to_string(max_box_count + 1)),
              std::string::npos)
        << result.message;
  }
}

// A device has a lower limit, and reports it before it allocates.
TEST_P(Invalid, TooManyBoxesForADevice) {
  if (config().backend == Backend::cpu) GTEST_SKIP() << "the CPU supports them";
  const Box box = cube(0, 0, 0, 1);
  Finder finder(options());
  constexpr std::size_t most = 1800000000;
  const BoxList one{box};
  for (const Result& result :
       {finder.find(Boxes(&box, most + 1, 0)), finder.find(Boxes(&box, max_box_count, 0)),
        finder.find(Boxes(&box, most, 0), one), finder.find(one, Boxes(&box, most, 0))}) {
    EXPECT_EQ(result.status, Status::too_many_boxes);
    EXPECT_NE(std::string(result.message).find("split them"), std::string::npos) << result.message;
  }
  EXPECT_TRUE(finder.find(one).ok());
}

TEST_P(Invalid, ShortFormThrows) {
  BoxList boxes = uniform_boxes(20, 1);
  boxes[11].upper.y = quiet;
  std::vector<Pair> out;
  EXPECT_EQ(find_pairs(boxes, out, options()).status, Status::nan_box);
  try {
    (void)find_pairs(boxes, options());
    FAIL() << "nothing was thrown";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::nan_box);
    EXPECT_EQ(error.result().first_invalid, 11u);
    EXPECT_NE(std::string(error.what()).find("11"), std::string::npos) << error.what();
  }
  EXPECT_THROW((void)find_pairs(boxes, boxes, options()), Error);
  EXPECT_THROW((void)find_pairs(boxes, options()), std::runtime_error);
}

// Every enumerator has a distinct name, for messages.
template <class Enum>
void expect_names(Enum last) {
  std::set<std::string> names;
  const int count = static_cast<int>(last) + 1;
  for (int k = 0; k < count; ++k) names.insert(to_string(static_cast<Enum>(k)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(count));
  EXPECT_EQ(names.count("unknown"), 0u);
  EXPECT_STREQ(to_string(static_cast<Enum>(count)), "unknown");
}
TEST(Names, OneEach) {
  expect_names(Status::bad_mesh);
  expect_names(Algorithm::grid);
  expect_names(Backend::emulated);
  expect_names(*std::rbegin(all_isas));
}

THRONG_INSTANTIATE(Invalid, suite_configs);

TEST(Isas, UnavailableIsRejected) {
  int refused = 0;
  for (const Isa isa : all_isas) {
    if (is_supported(isa)) continue;
    Options options;
    options.isa = isa;
    Finder finder(options);
    const Result result = finder.find(uniform_boxes(10, 1));
    EXPECT_EQ(result.status, Status::unsupported_isa);
    EXPECT_NE(std::string(result.message), "");
    ++refused;
  }
  EXPECT_GE(refused, 1) << "no processor has both x86 and ARM";
}

TEST(Isas, BadEnvironmentValueListsAllowed) {
  const char* const before = std::getenv("THRONG_ISA");
  const std::string kept = before ? before : "";
  const std::string absent = is_supported(Isa::neon) ? "avx2" : "neon";
  std::vector<std::pair<Isa, bool>> isas;
  for (const Isa isa : all_isas) isas.emplace_back(isa, is_supported(isa));
  for (const std::string& name : {std::string("foo"), std::string("SCALAR"), std::string(" scalar"),
                                  absent, std::string(1000, 'x')}) {
    test::set_environment("THRONG_ISA", name.c_str());
    Box box;
    const Result of_find = Finder().find(uniform_boxes(10, 1));
    const Result of_update = update_boxes({}, &box);
    for (const Result& result : {of_find, of_update}) {
      EXPECT_EQ(result.status, Status::unsupported_isa);
      const std::string message = result.message;
      EXPECT_NE(message.find("THRONG_ISA is '" + name.substr(0, 40) + "'"), std::string::npos);
      const std::size_t list = message.find("unset it, or set it to one of: auto");
      ASSERT_NE(list, std::string::npos) << message;
      for (const auto& [isa, here] : isas) {
        const bool named =
            message.find(std::string(", ") + to_string(isa), list + 8) != std::string::npos;
        EXPECT_EQ(named, here) << message;
      }
    }
  }
  test::set_environment("THRONG_ISA", before ? kept.c_str() : nullptr);
}

// Run by ctest with THRONG_ISA=scalar; otherwise it tests nothing.
TEST(ForcedIsa, MatchesTheEnvironment) {
  const char* forced = std::getenv("THRONG_ISA");
  if (!forced) GTEST_SKIP() << "THRONG_ISA is not set";
  const BoxList boxes = uniform_boxes(5000, 1);
  Finder finder;
  const Result result = finder.find(boxes);
  ASSERT_TRUE(result.ok()) << result.message;
  EXPECT_STREQ(to_string(result.plan.isa), forced);
  EXPECT_TRUE(same_pairs(to_vector(finder.pairs()), swept_pairs(boxes).pairs));
}

TEST(RoundOutward, IsTheSmallestFloatBoxAround) {
  const double values[] = {0.0,
                           -0.0,
                           1.0,
                           0.1,
                           -0.1,
                           1e-300,
                           -1e-300,
                           1e300,
                           -1e300,
                           16777217.0,
                           1e-40,
                           3.4028234663852886e38,
                           3.4028234663852889e38,
                           1.0 / 3,
                           -2e-46,
                           static_cast<double>(infinity),
                           -static_cast<double>(infinity)};
  for (const double v : values) {
    const volatile double d = v;
    std::fesetround(FE_DOWNWARD);
    const volatile float down = static_cast<float>(d);
    std::fesetround(FE_UPWARD);
    const volatile float up = static_cast<float>(d);
    std::fesetround(FE_TONEAREST);
    const double lower[3] = {v, 1, v}, upper[3] = {2, v, v};
    const Box box = round_outward(lower, upper);
    EXPECT_EQ(box.lower.x, down) << v;
    EXPECT_EQ(box.lower.y, 1.0f);
    EXPECT_EQ(box.upper.x, 2.0f);
    EXPECT_EQ(box.upper.y, up) << v;
    EXPECT_EQ(box.lower.z, down);
    EXPECT_EQ(box.upper.z, up);
  }
  const double nan[3] = {0, static_cast<double>(quiet), 0}, zero[3] = {0, 0, 0};
  EXPECT_TRUE(std::isnan(round_outward(nan, zero).lower.y)) << "a NaN must remain, to be rejected";
}

}  // namespace
}  // namespace throng::tests
