// Section 3.1's worked examples, the limits of Table 1, and section 3.4's bit of pair 19.
#include <fmt/format.h>

#include "apps/paper/evaluation/experiments.hpp"
#include "apps/paper/host.hpp"
#include "apps/paper/mapping.hpp"
#include "apps/paper/matrix.hpp"
#include "apps/paper/search.hpp"
#include "base/pair_index.hpp"

namespace throng::paper {
namespace {

// 1-based, as in the paper; "none" where the thread has no pair.
std::string pair_text(bool found, Pair pair) {
  return found ? fmt::format("({}, {})", pair.first + 1, pair.second + 1) : "none";
}

Row word_row(const std::string& what, std::uint64_t n, const std::string& paper,
             const std::string& measured) {
  Row row;
  row.what = what;
  row.n = n;
  row.paper_text = paper;
  row.measured_text = measured;
  row.found = paper == measured ? "agrees" : "differs";
  return row;
}

template <class Mapping>
std::string map(const Mapping& mapping, std::uint64_t k, std::uint64_t n) {
  Pair pair{};
  const bool found = mapping(k, n, pair);
  return pair_text(found, pair);
}

// The bit in the matrix of seven objects whose only overlap is pair 19.
std::string bit_of_pair_19() {
  const std::uint64_t n = 7;
  const Pair pair = base::pair_of_row_index(19, n);
  std::vector<Box> boxes;
  for (std::uint64_t i = 0; i < n; ++i) {
    const float x = static_cast<float>(i == pair.second ? pair.first : i) * 10;
    boxes.push_back({{x, 0, 0}, {x + 1, 1, 1}});
  }
  HostDevice device;
  HostDevice::Array<std::uint32_t> words;
  const std::uint64_t bits = base::pair_count(n);
  words.reserve(word_count(bits));
  using Tested = PairTest<Exact>;
  device.each(word_count(bits), WriteWord<Tested>{{Exact{}, boxes.data(), n}, words.data(), bits});
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(words.data());
  std::string text;
  for (std::uint64_t k = 0; k < bits; ++k) {
    if (!test_bit(bytes, k)) continue;
    text += fmt::format("{}bit {} of byte {}", text.empty() ? "" : ", ", k % 8, k / 8);
  }
  return text;
}

}  // namespace

Section worked_examples(const Lab&) {
  Section section("examples", "Section 3.1 and 3.4: the worked examples");
  const Formula<HardwareRoot<float>> hardware{};
  const Formula<FastRoot<float>> carmack{{carmack_constant, 2, LastOperation::product}};
  const Formula<FastRoot<float>> lomont{{lomont_constant, 2, LastOperation::product}};
  const struct {
    std::uint64_t k;
    const char* pair;
  } given[] = {{71452, "(75, 303)"}, {46108, "(48, 285)"}};
  for (const auto& example : given) {
    const std::string thread = fmt::format("thread {}, ", example.k);
    section.rows.push_back(
        word_row(thread + "float32 root", 1000, example.pair, map(hardware, example.k, 1000)));
    section.rows.push_back(word_row(thread + "Carmack, 2 steps, repaired", 1000, example.pair,
                                    map(carmack, example.k, 1000)));
    section.rows.push_back(word_row(thread + "Lomont, 2 steps, repaired", 1000, example.pair,
                                    map(lomont, example.k, 1000)));
    section.rows.push_back(
        word_row(thread + "exact integers", 1000, example.pair, map(Exact{}, example.k, 1000)));
  }
  section.rows.push_back(word_row("thread 0", 1000, "(1, 2)", map(hardware, 0, 1000)));

  // Table 1 ends with (n^2 - n)/2; counted from 0, that is one past the last pair.
  const std::uint64_t last = base::pair_count(1000) - 1;
  Row end = word_row("number of the last pair", 1000, std::to_string(base::pair_count(1000)),
                     std::to_string(last));
  end.found = fmt::format("differs: thread {} has {}, and with thread 0 that makes {} threads",
                          last, map(Exact{}, last, 1000), last + 1);
  section.rows.push_back(end);
  section.rows.push_back(word_row("the bit of pair 19", 7, "bit 3 of byte 2", bit_of_pair_19()));

  std::size_t agree = 0;
  for (const Row& row : section.rows) agree += row.found == "agrees";
  section.finding =
      fmt::format("{} of {} agree; the number of the last pair is one lower than Table 1 has it.",
                  agree, section.rows.size());
  return section;
}

}  // namespace throng::paper
