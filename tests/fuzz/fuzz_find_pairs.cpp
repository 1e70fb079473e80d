// Every algorithm, instruction set and number of threads finds what a double loop finds, for any
// capacity and filters, in one set or two.
#include "fuzz/target.hpp"
#include "support/judge.hpp"

namespace throng::tests {

// Four configurations per input, selected by its first byte.
void run(Bytes& bytes) {
  static Judge judge;
  const std::uint32_t choice = bytes.next();
  const Case c = make_case(bytes, 600);
  judge.begin(c);
  for (std::uint32_t k = 0; k < 4; ++k)
    judge.search(c, (choice + k * 11) % judge.configs().size(), (choice + k) * 37 + bytes.next());
}

}  // namespace throng::tests
