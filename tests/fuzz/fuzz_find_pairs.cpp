// Every algorithm, instruction set and number of threads finds what a double loop finds, for any
// capacity and filters, in one set or two.
#include "fuzz/target.hpp"
#include "support/oracle.hpp"

namespace throng::tests {

// Four configurations per input, selected by its first byte.
void run(Bytes& bytes) {
  static Oracle oracle;
  const std::uint32_t choice = bytes.next();
  const Case c = make_case(bytes, 600);
  oracle.begin(c);
  for (std::uint32_t k = 0; k < 4; ++k)
    oracle.search(c, (choice + k * 11) % oracle.configs().size(), (choice + k) * 37 + bytes.next());
}

}  // namespace throng::tests
