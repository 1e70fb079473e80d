// Reads stay within the caller's boxes: a protected page follows them.
#if defined(__unix__) || defined(__APPLE__)
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>

#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

// Memory that ends at a protected page.
class Guarded {
 public:
  explicit Guarded(std::size_t bytes)
      : page_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))),
        whole_((bytes + page_ - 1) / page_ * page_ + page_) {
    void* p = mmap(nullptr, whole_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (p == MAP_FAILED) throw std::bad_alloc();
    base_ = static_cast<char*>(p);
    if (mprotect(base_ + whole_ - page_, page_, PROT_NONE) != 0) throw std::bad_alloc();
    begin_ = base_ + whole_ - page_ - bytes;
  }
  ~Guarded() { munmap(base_, whole_); }
  Guarded(const Guarded&) = delete;
  Guarded& operator=(const Guarded&) = delete;
  char* begin() const { return begin_; }

 private:
  std::size_t page_, whole_;
  char *base_, *begin_;
};

TEST(Guard, NothingIsReadBehindTheLastBox) {
  for (const Config& config : single_configs()) {
    if (config.backend == Backend::cuda) continue;
    SCOPED_TRACE(config.name());
    Finder finder(config.options());
    for (const std::size_t stride : {sizeof(Box), sizeof(Box) + 8, std::size_t{0}}) {
      for (const int count : {2, 3, 7, 8, 64, 255, 256, 257, 700}) {
        const BoxList boxes = uniform_boxes(count, 5);
        Guarded memory(stride * (boxes.size() - 1) + sizeof(Box));
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
#endif
