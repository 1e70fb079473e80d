// A simulation: one Finder for all frames, and the three ways to receive pairs.
#include <throng/throng.hpp>

#include <cstdint>
#include <cstdio>
#include <vector>

#include "check.hpp"

namespace {

// A row of unit cubes. Each one moves back and forth at its own speed.
void move(std::vector<throng::Box>& boxes, int frame) {
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const float x =
        1.5f * static_cast<float>(i) + static_cast<float>((frame * (i % 7)) % 5) * 0.25f;
    boxes[i] = {{x, 0, 0}, {x + 1, 1, 1}};
  }
}

void narrow_phase(const throng::Pair*, std::size_t) {}

std::uint64_t growing(std::vector<throng::Box>& boxes) {
  std::uint64_t total = 0;
  throng::Finder finder;  // keeps its memory from frame to frame
  for (int frame = 0; frame < 120; ++frame) {
    move(boxes, frame);
    const throng::Result result = finder.find(boxes);
    if (!result.ok()) {
      std::fprintf(stderr, "%s\n", result.message);
      break;
    }
    narrow_phase(finder.pairs().data(), finder.pairs().size());
    total += result.found;
  }
  return total;
}

std::uint64_t own_buffer(const std::vector<throng::Box>& boxes) {
  throng::Finder finder;
  // snippet-begin: buffer
  std::vector<throng::Pair> buffer(16);
  throng::Result result = finder.find(boxes, buffer.data(), buffer.size());
  if (result.status == throng::Status::buffer_too_small) {
    buffer.resize(result.found);  // the exact total
    result = finder.find(boxes, buffer.data(), buffer.size());
  }
  narrow_phase(buffer.data(), result.written);
  // snippet-end: buffer
  CHECK(result.ok());
  return result.written;
}

std::uint64_t consumed(const std::vector<throng::Box>& boxes) {
  // snippet-begin: consumer
  throng::Options options;
  options.memory_cap_bytes = 64 << 20;  // everything that the library allocates
  throng::Finder finder(options);
  std::uint64_t seen = 0;
  const throng::Result result =
      finder.consume(boxes, [&](const throng::Pair* pairs, std::size_t count) {
        narrow_phase(pairs, count);
        seen += count;
        return true;  // false stops the search
      });
  // snippet-end: consumer
  CHECK(result.ok());
  CHECK(result.written == seen);
  return seen;
}

}  // namespace

int main() {
  std::vector<throng::Box> boxes(1000);
  const std::uint64_t total = growing(boxes);
  CHECK(total > 0);
  const std::uint64_t last = throng::find_pairs(boxes).size();
  CHECK(own_buffer(boxes) == last);
  CHECK(consumed(boxes) == last);
  std::printf("%llu pairs in 120 frames\n", static_cast<unsigned long long>(total));
}
