// Any bytes as a .npy file: boxes or a FileError, never a crash nor a large allocation.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "scene/npy.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  for (const bool outward : {false, true}) {
    try {
      const throng::scene::BoxFile file =
          throng::scene::parse_boxes(data, size, "fuzz.npy", outward);
      // Every box there is was in the bytes: four bytes at least a coordinate.
      if (file.count != 0 && file.frames > size / 24 / file.count) std::abort();
      volatile float sum = 0;
      for (std::size_t i = 0; i < file.frames * file.count; ++i)
        sum = sum + file.boxes[i].lower.x + file.boxes[i].upper.z;
    } catch (const throng::scene::FileError& error) {
      if (std::string(error.what()).find("fuzz.npy") == std::string::npos) std::abort();
    }
  }
  return 0;
}
