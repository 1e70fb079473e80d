// Reads stay within the caller's boxes: a protected page follows them.
#include <cstring>

#include "support/configs.hpp"
#include "support/guarded_memory.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

TEST(Guard, NothingIsReadBehindTheLastBox) {
  for (const Config& config : single_configs()) {
    if (config.backend == Backend::cuda) continue;
    SCOPED_TRACE(config.name());
    Finder finder(config.options());
    for (const std::size_t stride : {sizeof(Box), sizeof(Box) + 8, std::size_t{0}}) {
      for (const int count : {2, 3, 7, 8, 64, 255, 256, 257, 700}) {
        const BoxList boxes = uniform_boxes(count, 5);
        GuardedMemory memory(stride * (boxes.size() - 1) + sizeof(Box));
        BoxList seen;
        for (std::size_t i = 0; i < boxes.size(); ++i) {
          const Box& box = boxes[stride == 0 ? 0 : i];
          std::memcpy(memory.begin() + stride * i, &box, sizeof box);
          seen.push_back(box);
        }
        const Boxes view(reinterpret_cast<const Box*>(memory.begin()), boxes.size(), stride);
        const Result r = finder.find(view);
        EXPECT_TRUE(r.ok()) << r.message;
        EXPECT_TRUE(same_pairs(to_vector(finder.pairs()), reference_pairs(seen).pairs));
      }
    }
  }
}

}  // namespace
}  // namespace throng::tests
