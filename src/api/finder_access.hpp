// The path common to all public forms of a search: checks, optional capture, then a backend.
#pragma once

#include <cstddef>

#include <throng/finder.hpp>

#include "base/output.hpp"

namespace throng {

struct FinderAccess {
  // b null: one set. Pairs go to `output` or `consumer`; with both null, into the finder's own
  // memory. AnyBoxes is Boxes or DoubleBoxes.
  template <class AnyBoxes>
  static Result run(Finder&, const AnyBoxes& a, const AnyBoxes* b, base::Output* output,
                    const Consumer* consumer);
  // Memory for `count` pairs in the finder's own buffer; null on failure. `finder` points to a
  // Finder after its first run().
  static Pair* grow_pairs(void* finder, std::size_t count) noexcept;
  // Throws Error.
  static Explanation explain(Finder&, const Boxes& a, const Boxes* b);

 private:
  template <class AnyBoxes>
  static Result capture_or_search(Finder&, const AnyBoxes& a, const AnyBoxes* b, base::Output*,
                                  const Consumer*);
  static Result captured(const char* folder, Finder&, const Boxes& a, const Boxes* b, base::Output*,
                         const Consumer*);
  template <class AnyBoxes>
  static Result search(Finder&, const AnyBoxes& a, const AnyBoxes* b, base::Output*,
                       const Consumer*);
};

extern template Result FinderAccess::run(Finder&, const Boxes&, const Boxes*, base::Output*,
                                         const Consumer*);
extern template Result FinderAccess::run(Finder&, const DoubleBoxes&, const DoubleBoxes*,
                                         base::Output*, const Consumer*);

}  // namespace throng
