#include "apps/paper/variant.hpp"

#include <fmt/format.h>

#include "base/pair_index.hpp"

namespace throng::paper {
namespace {

template <class Mapping>
MappingErrors count_mapping_errors(const Mapping& mapping, std::uint64_t n, std::uint64_t walk) {
  MappingErrors errors;
  const auto wrong = [&](std::uint64_t k, std::uint64_t i) {
    const std::uint32_t row = static_cast<std::uint32_t>(i);
    const Pair want{row, static_cast<std::uint32_t>(i + 1 + (k - base::row_start(i, n)))};
    Pair got{};
    if (mapping(k, n, got) && got == want) return false;
    if (errors.indices == 0 || k < errors.first_index) errors.first_index = k;
    ++errors.indices;
    return true;
  };
  for (std::uint64_t i = 0; i + 1 < n; ++i) {
    const std::uint64_t begin = base::row_start(i, n), end = base::row_start(i + 1, n);
    const std::uint64_t before = errors.indices;
    std::uint64_t k = begin;
    while (k < end && k - begin < walk && wrong(k, i)) ++k;
    for (std::uint64_t last = end; last > k && end - last < walk && wrong(last - 1, i);) --last;
    errors.rows += errors.indices != before;
  }
  return errors;
}

}  // namespace

std::string describe(const Variant& variant) {
  std::string text = name(variant.mapping);
  if (variant.mapping == MappingKind::formula) {
    text += fmt::format("-{}", name(variant.root));
    if (variant.root == RootKind::carmack || variant.root == RootKind::lomont) {
      text += fmt::format("{}", variant.steps);
    }
    if (variant.radicand == Radicand::real) text += "-real";
    if (!variant.repair) text += "-unrepaired";
  }
  if (variant.per_cell > 0) return text + fmt::format(" grid {:g}", variant.per_cell);
  text += fmt::format(" {}", name(variant.output));
  if (variant.output == Output::bit) text += fmt::format("/{}", name(variant.write));
  return text;
}

std::uint64_t thread_count(const Variant& variant, std::uint64_t n) {
  return variant.mapping == MappingKind::lazy ? Lazy::threads(n) : base::pair_count(n);
}

bool pair_at_position(const Variant& variant, std::uint64_t t, std::uint64_t n, Pair& pair) {
  switch (variant.mapping) {
    case MappingKind::lazy:
      return Lazy{}(t, n, pair);
    case MappingKind::fold:
      return Fold{}(t, n, pair);
    case MappingKind::formula:
    case MappingKind::stored:
    case MappingKind::exact:
      break;
  }
  return Exact{}(t, n, pair);
}

MappingErrors count_errors(const Variant& variant, std::uint64_t n, std::uint64_t walk) {
  // The other mappings are exact, and not in row order.
  if (variant.mapping != MappingKind::formula || n < 2) return {};
  return with_mapping(variant, nullptr,
                      [&](const auto& mapping) { return count_mapping_errors(mapping, n, walk); });
}

}  // namespace throng::paper
