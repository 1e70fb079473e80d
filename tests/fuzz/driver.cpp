// Runs a target over files and folders of inputs without a fuzzer, so that the corpus is a test
// with any compiler. --random N adds N random inputs.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "support/bytes.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

bool run(const std::string& name, const std::vector<std::uint8_t>& input) {
  try {
    LLVMFuzzerTestOneInput(input.data(), input.size());
    return true;
  } catch (const throng::tests::Difference& difference) {
    std::printf("%s: %s\n", name.c_str(), difference.what());
    return false;
  }
}

bool run_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<std::uint8_t> input{std::istreambuf_iterator<char>(file), {}};
  return run(path.string(), input);
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t done = 0, failed = 0;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--random" && i + 1 < argc) {
      throng::tests::Random random(42);
      for (int n = std::atoi(argv[++i]); n > 0; --n, ++done)
        failed += !run("random input", throng::tests::random_bytes(random, random.below(1200)));
    } else if (std::filesystem::is_directory(argv[i])) {
      for (const auto& entry : std::filesystem::directory_iterator(argv[i]))
        failed += !run_file(entry.path()), ++done;
    } else {
      failed += !run_file(argv[i]), ++done;
    }
  }
  std::printf("%zu inputs, %zu failed\n", done, failed);
  return failed || done == 0 ? 1 : 0;
}
