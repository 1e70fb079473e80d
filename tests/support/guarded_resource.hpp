// A memory resource with a guard before and after each block. check() and deallocation detect
// writes outside of blocks. New and freed memory is overwritten, so that code that relies on stale
// contents fails.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory_resource>
#include <mutex>

namespace throng::tests {

class GuardedResource : public std::pmr::memory_resource {
 public:
  ~GuardedResource() override { EXPECT_TRUE(blocks_.empty()) << blocks_.size() << " blocks leak"; }

  // Whether all guards of all blocks are intact.
  testing::AssertionResult check() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [begin, block] : blocks_)
      if (!whole(begin, block))
        return testing::AssertionFailure()
               << "write outside of a block of " << block.bytes << " bytes";
    return testing::AssertionSuccess();
  }
  std::size_t allocations() const { return allocations_; }

 private:
  static constexpr std::size_t guard = 256;
  static constexpr unsigned char mark = 0xa5, fresh = 0xcd, gone = 0xdd;
  struct Block {
    std::size_t bytes, alignment, before;
  };

  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::size_t before = std::max(guard, alignment);
    auto* const base = static_cast<unsigned char*>(
        std::pmr::new_delete_resource()->allocate(before + bytes + guard, alignment));
    std::memset(base, mark, before);
    std::memset(base + before, fresh, bytes);
    std::memset(base + before + bytes, mark, guard);
    blocks_[base + before] = {bytes, alignment, before};
    ++allocations_;
    return base + before;
  }
  void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    auto* const begin = static_cast<unsigned char*>(memory);
    const auto at = blocks_.find(begin);
    if (at == blocks_.end()) {
      ADD_FAILURE() << "deallocate of an unknown block";
      return;
    }
    const Block block = at->second;
    EXPECT_EQ(block.bytes, bytes);
    EXPECT_EQ(block.alignment, alignment);
    EXPECT_TRUE(whole(begin, block)) << "write outside of a block of " << bytes << " bytes";
    blocks_.erase(at);
    std::memset(begin, gone, bytes);
    std::pmr::new_delete_resource()->deallocate(
        begin - block.before, block.before + block.bytes + guard, block.alignment);
  }
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
    return this == &other;
  }
  static bool whole(const unsigned char* begin, const Block& block) {
    const auto marked = [](unsigned char c) { return c == mark; };
    return std::all_of(begin - block.before, begin, marked) &&
           std::all_of(begin + block.bytes, begin + block.bytes + guard, marked);
  }

  mutable std::mutex mutex_;
  std::map<unsigned char*, Block> blocks_;
  std::size_t allocations_ = 0;
};

}  // namespace throng::tests
