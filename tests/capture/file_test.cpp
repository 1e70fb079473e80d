// Truncated, corrupted and forged files: each is refused with its name, or the truncation is
// reported; and captures of a BroadPhase.
#include <cstring>

#include <throng/throng.hpp>

#include "capture/folder.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

class CaptureFile : public CaptureTest {
 protected:
  // A small capture of two sets with a filter, as bytes.
  std::string small() {
    const BoxList a = uniform_boxes(5, 1), b = uniform_boxes(4, 2);
    const std::vector<std::uint32_t> group(5, 1);
    Boxes view = a;
    view.filters.group = {group.data(), 5};
    Finder finder(options());
    EXPECT_TRUE(finder.find(view, b).ok());
    return last_bytes();
  }
};

void set32(std::string& bytes, std::size_t at, std::uint32_t value) {
  for (int k = 0; k < 4; ++k) bytes[at + k] = static_cast<char>(value >> (8 * k));
}
std::uint64_t get64(const std::string& bytes, std::size_t at) {
  std::uint64_t value = 0;
  for (int k = 7; k >= 0; --k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}
// The offsets of the sections.
std::vector<std::size_t> sections(const std::string& bytes) {
  std::vector<std::size_t> at;
  for (std::size_t k = 16; k < bytes.size(); k += 24 + get64(bytes, k + 8)) at.push_back(k);
  return at;
}
// Updates the hash of the section at `at`.
void seal(std::string& bytes, std::size_t at) {
  const std::size_t size = 16 + get64(bytes, at + 8);
  const std::uint64_t sum =
      capture::fold(capture::fold_start, reinterpret_cast<unsigned char*>(bytes.data()) + at, size);
  set32(bytes, at + size, static_cast<std::uint32_t>(sum));
  set32(bytes, at + size + 4, static_cast<std::uint32_t>(sum >> 32));
}

TEST_F(CaptureFile, TruncatedAnywhere) {
  const std::string whole = small();
  const auto at = sections(whole);
  ASSERT_EQ(at.size(), 5u);  // options, operation, two sets, the answer
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const std::string cut = whole.substr(0, size);
    if (size < at[4]) {
      EXPECT_THROW((void)parse(cut), scenes::FileError) << size;
    } else {
      const scenes::Capture c = parse(cut);  // the complete input, and no answer
      EXPECT_EQ(c.calls[0].sets.size(), 2u);
      EXPECT_FALSE(c.calls[0].answer);
      EXPECT_EQ(c.truncated, size != at[4]);
    }
  }
}

TEST_F(CaptureFile, CorruptedAnywhere) {
  const std::string whole = small();
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x21);
    try {
      const scenes::Capture c = parse(damaged);
      // A corrupted length of the last section can look like a truncation.
      EXPECT_TRUE(c.truncated && !c.calls[0].answer)
          << "byte " << at << ": corruption not detected";
    } catch (const scenes::FileError& error) {
      EXPECT_NE(std::string(error.what()).find("capture"), std::string::npos);
    }
  }
}

// Invalid values with a valid hash.
TEST_F(CaptureFile, HostileNumbers) {
  const std::string whole = small();
  const auto at = sections(whole);
  const auto refused = [&](std::size_t section, std::size_t offset, std::uint32_t value) {
    std::string bytes = whole;
    set32(bytes, at[section] + offset, value);
    seal(bytes, at[section]);
    EXPECT_THROW((void)parse(bytes), scenes::FileError) << section << " + " << offset;
  };
  for (const std::uint32_t huge : {0xffffffffu, 0x80000000u, 6u}) {
    refused(2, 16, huge);  // the count of boxes
    refused(2, 20, huge);
  }
  refused(0, 16, 3);          // an invalid algorithm
  refused(0, 16 + 16, 9);     // an instruction set
  refused(0, 64 + 16, 0x1b);  // a version with an escape character
  refused(1, 4, 11);          // an operation
  refused(1, 4, 1);           // add, with two sets
  refused(1, 16 + 20, 3);     // a form
  refused(1, 16 + 24, 3);     // three sets
  refused(2, 4, 64);          // flags of boxes
  refused(2, 4, 3);           // one filter more than the payload holds
  refused(2, 0, 5);           // boxes tagged as sweeps
  refused(4, 4, 18);          // a status
}

TEST_F(CaptureFile, LengthsBeyondTheFile) {
  const std::string whole = small();
  for (const std::size_t at : sections(whole)) {
    for (const std::uint32_t high : {0u, 0xffffffffu, 0x7fffffffu}) {
      std::string bytes = whole;
      set32(bytes, at + 8, 0xfffffff0u);
      set32(bytes, at + 12, high);
      try {
        EXPECT_TRUE(parse(bytes).truncated);
      } catch (const scenes::FileError&) {
      }
    }
  }
}

TEST_F(CaptureFile, EveryCallOfABroadPhase) {
  const BoxList boxes = uniform_boxes(40, 3);
  {
    BroadPhase live(options());
    std::vector<ObjectId> ids(boxes.size());
    ASSERT_TRUE(live.add(boxes, ids.data()).ok());
    ASSERT_TRUE(live.update().ok());
    const std::uint64_t pairs = live.pair_count();
    ASSERT_TRUE(live.remove(&ids[3], 1).ok());
    ASSERT_EQ(live.move(ids[4], boxes[5]), Status::ok);
    Filter still;
    still.is_static = 1;
    ASSERT_EQ(live.set_filter(ids[6], still), Status::ok);
    ASSERT_TRUE(live.shift_origin({1, 2, 3}).ok());
    ASSERT_EQ(live.remove(ids[3]), Status::bad_id);  // refused locally: not captured
    ASSERT_TRUE(live.update().ok());
    ASSERT_TRUE(live.find_overlaps(boxes).ok());
    const Sweep sweep{boxes[0], {10, 0, 0}};
    ASSERT_TRUE(live.find_hits(&sweep, 1, SweepHits::first).ok());
    // Not captured: calls with a function, and ray casts.
    const auto filter = [](ObjectId id) { return id % 2 == 0; };
    ASSERT_TRUE(live.find_overlaps(boxes, filter).ok());
    ASSERT_TRUE(live.find_hits(&sweep, 1, SweepHits::first, {}, filter).ok());
    ASSERT_TRUE(live.raycast(live.box(ids[0]).lower, {1, 0, 0}).has_value());
    ASSERT_TRUE(live.move_all(boxes).ok());
    ASSERT_EQ(files().size(), 1u);
    const scenes::Capture c = last();
    using capture::Operation;
    const std::vector<Operation> wanted = {Operation::add,         Operation::update,
                                           Operation::remove,      Operation::move,
                                           Operation::set_filters, Operation::shift_origin,
                                           Operation::update,      Operation::find_overlaps,
                                           Operation::find_hits,   Operation::move_all};
    std::vector<Operation> got;
    for (const auto& call : c.calls) {
      got.push_back(call.operation);
      EXPECT_TRUE(call.answer);
    }
    EXPECT_EQ(got, wanted);
    EXPECT_FALSE(c.is_finder());
    EXPECT_EQ(c.calls[1].answer->found, pairs);
    EXPECT_EQ(c.calls[2].ids, std::vector<std::uint32_t>{ids[3]});
    EXPECT_EQ(c.calls[5].by.z, 3.0f);
    EXPECT_EQ(c.calls[8].sweeps.size(), 1u);
    EXPECT_EQ(c.calls[8].form, 1u);
    EXPECT_FALSE(c.truncated);
    // A file truncated within a call keeps the earlier calls.
    const std::string whole = last_bytes();
    std::size_t most = 0;
    for (std::size_t size = 0; size < whole.size(); size += 7) {
      try {
        const std::size_t calls = parse(whole.substr(0, size)).calls.size();
        EXPECT_GE(calls, most);
        most = calls;
      } catch (const scenes::FileError&) {
        EXPECT_EQ(most, 0u);
      }
    }
    EXPECT_EQ(most, c.calls.size());
    BroadPhase copy(options());
    ASSERT_TRUE(copy.copy_from(live).ok());
    EXPECT_EQ(files().size(), 2u);
    EXPECT_EQ(last().calls[0].operation, Operation::restart);
    EXPECT_EQ(last().calls[0].ids[3], 0u);
    EXPECT_EQ(last().calls[0].ids[4], 1u);
  }
}

}  // namespace
}  // namespace throng::tests
