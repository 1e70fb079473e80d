// The choices that make a variant of the paper's system, their names, and which are compatible.
#pragma once

#include <cstdint>
#include <string>

#include "apps/paper/mapping.hpp"
#include "apps/paper/roots.hpp"

namespace throng::paper {

enum class MappingKind { formula, lazy, stored, fold, exact };
enum class RootKind { float32, float64, carmack, lomont, exact };
enum class Output { bit, byte, pairs };
enum class Write { racy, atomic, ballot, owned };

// In the order of the enumerations.
inline constexpr const char* mapping_names[] = {"formula", "lazy", "stored", "fold", "exact"};
inline constexpr const char* root_names[] = {"float32", "float64", "carmack", "lomont", "exact"};
inline constexpr const char* output_names[] = {"bit", "byte", "pairs"};
inline constexpr const char* write_names[] = {"racy", "atomic", "ballot", "owned"};

struct Variant {
  MappingKind mapping = MappingKind::formula;
  RootKind root = RootKind::float32;
  int steps = 2;       // of Newton's method, for carmack and lomont
  bool repair = true;  // the paper's two repairs of a wrong row
  Radicand radicand = Radicand::integer;
  Output output = Output::bit;
  Write write = Write::ballot;  // for bits
  double per_cell = 0;          // objects per cell of the grid; 0: no grid
};

inline const char* name(MappingKind kind) { return mapping_names[static_cast<int>(kind)]; }
inline const char* name(RootKind kind) { return root_names[static_cast<int>(kind)]; }
inline const char* name(Output kind) { return output_names[static_cast<int>(kind)]; }
inline const char* name(Write kind) { return write_names[static_cast<int>(kind)]; }

// A short name for tables: "formula-carmack2-repaired bit/racy", "fold grid 8".
std::string describe(const Variant& variant);

// Calls use(mapping) with the variant's mapping object. `stored` is the list of that mapping; null
// for the others.
template <class Use>
auto with_mapping(const Variant& variant, const Pair* stored, Use&& use) {
  const auto fast = [&](std::uint32_t constant) {
    return use(Formula<FastRoot<float>>{
        {constant, variant.steps, LastOperation::product}, variant.repair, variant.radicand});
  };
  switch (variant.mapping) {
    case MappingKind::lazy:
      return use(Lazy{});
    case MappingKind::stored:
      return use(Stored{stored});
    case MappingKind::fold:
      return use(Fold{});
    case MappingKind::exact:
      return use(Exact{});
    case MappingKind::formula:
      break;
  }
  switch (variant.root) {
    case RootKind::float32:
      return use(Formula<HardwareRoot<float>>{{}, variant.repair, variant.radicand});
    case RootKind::float64:
      return use(Formula<HardwareRoot<double>>{{}, variant.repair, variant.radicand});
    case RootKind::carmack:
      return fast(carmack_constant);
    case RootKind::lomont:
      return fast(lomont_constant);
    case RootKind::exact:
      break;
  }
  return use(Exact{});
}

// The number of threads, and so of output positions, for n objects.
std::uint64_t thread_count(const Variant& variant, std::uint64_t n);

// The pair at output position t: by the variant's exact numbering, whatever root its threads use.
bool pair_at_position(const Variant& variant, std::uint64_t t, std::uint64_t n, Pair& pair);

// The errors of a mapping against its exact numbering. Rounding errors occur at the ends of rows,
// so each row is checked inward from either end until an index is right, or `walk` were wrong: n
// rows, not n^2 indices. walk = 1 checks only the ends.
struct MappingErrors {
  std::uint64_t indices = 0;      // wrong ones among those checked
  std::uint64_t rows = 0;         // with a wrong first or last index
  std::uint64_t first_index = 0;  // the lowest wrong one, if any
};
MappingErrors count_errors(const Variant& variant, std::uint64_t n,
                           std::uint64_t walk = ~std::uint64_t{0});

}  // namespace throng::paper
