// Changes the floating-point state of the calling thread.
#pragma once

#include <cfenv>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace throng::tests {

#if defined(__SSE2__)
constexpr unsigned flush_to_zero = 0x8000, denormals_are_zero = 0x0040, control_bits = 0xffc0;
#endif

// Sets rounding mode and flush-to-zero for its lifetime.
class ModifiedFloatState {
 public:
  ModifiedFloatState(int rounding, bool flush) : rounding_(rounding) {
    std::fegetenv(&before_);
    std::fesetround(rounding);
#if defined(__SSE2__)
    if (flush) _mm_setcsr(_mm_getcsr() | flush_to_zero | denormals_are_zero);
    control_ = _mm_getcsr() & control_bits;
#else
    (void)flush;
#endif
  }
  ~ModifiedFloatState() {
    std::fesetenv(&before_);
#if defined(__SSE2__)
    _mm_setcsr(control_before_);  // mingw-w64's fesetenv leaves it as it is
#endif
  }
  bool unchanged() const {
#if defined(__SSE2__)
    if ((_mm_getcsr() & control_bits) != control_) return false;
#endif
    return std::fegetround() == rounding_;
  }

 private:
  std::fenv_t before_;
  int rounding_;
#if defined(__SSE2__)
  unsigned control_before_ = _mm_getcsr(), control_ = 0;
#endif
};

}  // namespace throng::tests
