// Any bytes as a capture: calls or a FileError, never a crash nor a large allocation. Checksums are
// fixed first, so that the parser reaches the bytes after them.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "apps/scenes/capture.hpp"
#include "apps/scenes/npy.hpp"

namespace {

using throng::capture::fold;
using throng::capture::fold_start;

std::uint64_t number(const unsigned char* p) {
  std::uint64_t value = 0;
  for (int k = 7; k >= 0; --k) value = value << 8 | p[k];
  return value;
}

void fix_checksums(std::vector<unsigned char>& bytes) {
  std::memcpy(bytes.data(), throng::capture::magic, std::min<std::size_t>(bytes.size(), 8));
  for (std::size_t at = 16; at + 24 <= bytes.size();) {
    const std::uint64_t size = number(&bytes[at + 8]);
    if (size > bytes.size() - at - 24) return;
    const std::size_t end = at + 16 + static_cast<std::size_t>(size);
    const std::uint64_t sum = fold(fold_start, &bytes[at], end - at);
    for (int k = 0; k < 8; ++k) bytes[end + k] = static_cast<unsigned char>(sum >> (8 * k));
    at = end + 8;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<unsigned char> bytes(data, data + size);
  if (size > 0 && data[0] != 'T') fix_checksums(bytes);
  try {
    const throng::scenes::Capture c = throng::scenes::parse_capture(bytes.data(), size, "fuzz");
    std::size_t held = 0;
    volatile float sum = 0;
    for (const auto& call : c.calls) {
      held += call.ids.size() * 4 + call.sweeps.size() * 36;
      for (const auto& set : call.sets) {
        held += set.boxes.size() * sizeof(throng::Box);
        const throng::Boxes view = set.view();
        if (!view.complete()) std::abort();
        for (std::size_t i = 0; i < view.size(); ++i) sum = sum + view[i].lower.x;
      }
    }
    if (held > size) std::abort();  // every value came from the bytes
  } catch (const throng::scenes::FileError& error) {
    if (std::string(error.what()).find("fuzz") == std::string::npos) std::abort();
  }
  return 0;
}
