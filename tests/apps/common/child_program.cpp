// A program for child_test: does what its arguments say, one after the other.
//   print TEXT        on standard output, at once
//   lines N BYTES     N lines of this length, each the number of the line
//   repeat TEXT MS    prints TEXT every MS milliseconds, for ever
//   complain TEXT     on standard error
//   sleep MS
//   close             its standard output
//   words             prints the remaining arguments, one on a line
//   exit STATUS
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

namespace {

void print(const char* text) {
  std::fputs(text, stdout);
  std::fflush(stdout);
}
void sleep_ms(const char* ms) {
  std::this_thread::sleep_for(std::chrono::milliseconds(std::atoi(ms)));
}

}  // namespace

int main(int argc, char** argv) {
  for (int k = 1; k < argc; ++k) {
    const std::string what = argv[k];
    if (what == "words") {
      while (++k < argc) std::puts(argv[k]);
    } else if (what == "close") {
      std::fclose(stdout);
    } else if (++k == argc) {
      return 99;
    } else if (what == "print") {
      print(argv[k]);
    } else if (what == "complain") {
      std::fputs(argv[k], stderr);
    } else if (what == "sleep") {
      sleep_ms(argv[k]);
    } else if (what == "exit") {
      return std::atoi(argv[k]);
    } else if (what == "lines") {
      const int bytes = std::atoi(argv[k + 1]);
      for (int line = 0; line < std::atoi(argv[k]); ++line) std::printf("%0*d\n", bytes, line);
      ++k;
    } else if (what == "repeat") {
      for (;; sleep_ms(argv[k + 1])) print(argv[k]);
    } else {
      return 99;
    }
  }
  return 0;
}
