// Chooses the instruction set of a call: the caller's, that of THRONG_ISA, or the widest.
#include <cstdlib>
#include <cstring>

#include "grid/sweep/kernel_table.hpp"

namespace throng {

const char* to_string(Isa isa) noexcept {
  switch (isa) {
    case Isa::automatic:
      return "auto";
    case Isa::scalar:
      return "scalar";
    case Isa::sse4:
      return "sse4";
    case Isa::avx2:
      return "avx2";
    case Isa::avx512:
      return "avx512";
    case Isa::neon:
      return "neon";
    case Isa::wasm:
      return "wasm";
  }
  return "unknown";
}

}  // namespace throng

namespace throng::grid {
namespace {

const Kernels* widest() noexcept {
  const Kernels* widest = &scalar_kernels;
  for (const Isa isa : all_isas)
    if (const Kernels* k = simd_kernels(isa)) widest = k;
  return widest;
}

}  // namespace

const Kernels* find_kernels(Isa isa) noexcept {
  if (isa == Isa::scalar) return &scalar_kernels;
  if (isa != Isa::automatic) return simd_kernels(isa);
  const char* name = std::getenv("THRONG_ISA");
  if (!name || !*name || std::strcmp(name, "auto") == 0) return widest();
  for (const Isa known : all_isas) {
    if (std::strcmp(name, to_string(known)) == 0) return find_kernels(known);
  }
  return nullptr;
}

}  // namespace throng::grid
