// Any bytes as a .npy file: boxes or a FileError, never a crash nor a large allocation.
#include <string>

#include "apps/scenes/npy.hpp"
#include "fuzz/target.hpp"

namespace throng::tests {

void run(Bytes& bytes) {
  std::vector<unsigned char> file_bytes;
  while (!bytes.empty()) file_bytes.push_back(static_cast<unsigned char>(bytes.next()));
  const std::size_t size = file_bytes.size();
  for (const bool outward : {false, true}) {
    try {
      const scenes::BoxFile file =
          scenes::parse_boxes(file_bytes.data(), size, "fuzz.npy", outward);
      // Every box came from the bytes: at least four per coordinate.
      if (file.count != 0 && file.frames > size / 24 / file.count)
        throw Difference("more boxes than bytes");
      volatile float sum = 0;
      for (std::size_t i = 0; i < file.frames * file.count; ++i)
        sum = sum + file.boxes[i].lower.x + file.boxes[i].upper.z;
    } catch (const scenes::FileError& error) {
      if (std::string(error.what()).find("fuzz.npy") == std::string::npos)
        throw Difference(std::string("an error without the file's name: ") + error.what());
    }
  }
}

}  // namespace throng::tests
