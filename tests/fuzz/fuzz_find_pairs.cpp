// Whatever the bytes say: every algorithm, instruction set and number of threads finds what a
// double loop finds, in the room given, with any filters, in one set or in two.
#include <cstdlib>
#include <iostream>

#include "support/configs.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {
namespace {

// Reads the input from its front; zeros when it is spent.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  bool empty() const { return at_ >= size_; }
  std::uint32_t next() { return at_ < size_ ? data_[at_++] : 0; }
  std::uint32_t word() {
    std::uint32_t w = next();
    w |= next() << 8;
    w |= next() << 16;
    return w | next() << 24;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

// A third of the coordinates repeat an earlier one, exactly or within two ulps.
float coordinate(Bytes& bytes, std::vector<float>& seen) {
  const std::uint32_t kind = bytes.next();
  float x;
  if (kind % 3 == 0 && !seen.empty()) {
    x = nudge(seen[bytes.next() % seen.size()], static_cast<int>(kind / 3 % 5) - 2);
  } else if (kind % 3 == 1) {
    x = static_cast<float>(static_cast<int>(bytes.next()) - 128) * ((kind & 16) ? 0.1f : 1.0f);
  } else {
    const std::uint32_t bits = bytes.word();
    std::memcpy(&x, &bits, sizeof x);
  }
  seen.push_back(x);
  return x;
}

struct Set {
  BoxList boxes;
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;
  bool has_nan = false;

  void read(Bytes& bytes, std::vector<float>& seen, std::size_t most, std::size_t repeat) {
    while (!bytes.empty() && boxes.size() < most) {
      float c[6];
      for (float& x : c) x = coordinate(bytes, seen);
      const std::uint32_t labels = bytes.next();
      for (int k = 0; k < 3; ++k) {
        has_nan = has_nan || c[k] != c[k] || c[k + 3] != c[k + 3];
        if (labels % 8 != 0 && c[k] > c[k + 3]) std::swap(c[k], c[k + 3]);
      }
      // The same box again, some way on along x: enough boxes for many columns from few bytes.
      for (std::size_t r = 0; r <= repeat && boxes.size() < most; ++r) {
        const float shift = static_cast<float>(r);
        boxes.push_back({{c[0] + shift, c[1], c[2]}, {c[3] + shift, c[4], c[5]}});
        const Box& box = boxes.back();
        has_nan = has_nan || box.lower.x != box.lower.x || box.upper.x != box.upper.x;
        group.push_back(1u << (labels & 3));
        mask.push_back(labels);
        owner.push_back(static_cast<std::int32_t>(labels >> 2 & 7) - 1);
        world.push_back(static_cast<std::int32_t>((labels >> 3) + r) % 4 - 1);
        is_static.push_back(labels >> 5 & 1);
      }
    }
  }
  Boxes view(std::uint32_t which) const {
    Boxes v = boxes;
    const std::size_t n = boxes.size();
    if (n == 0) return v;
    if (which & 1) v.filters.group = {group.data(), n};
    if (which & 2) v.filters.mask = {mask.data(), n};
    if (which & 4) v.filters.owner = {owner.data(), n};
    if (which & 8) v.filters.world = {world.data(), n};
    if (which & 16) v.filters.is_static = {is_static.data(), n};
    return v;
  }
};

[[noreturn]] void fail(const Config& config, const std::string& what) {
  std::cerr << config.name() << ": " << what << std::endl;
  std::abort();
}

// `finder` comes with whatever earlier inputs left in it: that saves time and must not matter.
void check(Finder& finder, const Config& config, const Options& options, const Set& a, const Set& b,
           std::uint32_t which, bool two_sets, std::uint32_t room, const Answer& answer) {
  const Boxes first = a.view(which), second = b.view(which >> 1);
  const auto find = [&](Finder& finder, Pair* out, std::size_t capacity) {
    return two_sets ? finder.find(first, second, out, capacity) : finder.find(first, out, capacity);
  };
  finder.set_options(options);
  if (options.nan == NanPolicy::refuse && (a.has_nan || (two_sets && b.has_nan))) {
    if (find(finder, nullptr, 0).status != Status::nan_box) fail(config, "a NaN was not refused");
    return;
  }
  // Room from none to a little too much, and a guard behind it.
  const std::size_t total = answer.pairs.size();
  const std::size_t capacity = room % 4 == 0   ? total
                               : room % 4 == 1 ? total + 1
                                               : room % (total + 1);
  const Pair guard{0x12345678, 0x9abcdef0};
  std::vector<Pair> out(capacity + 8, guard);
  const Result result = find(finder, out.data(), capacity);
  if (result.found != total)
    fail(config, "found " + std::to_string(result.found) + " of " + std::to_string(total));
  if (result.inactive != answer.inactive) fail(config, "inactive boxes miscounted");
  if (result.ok() != (capacity >= total))
    fail(config, std::string("status ") + to_string(result.status));
  if (result.written > capacity) fail(config, "wrote more than there was room for");
  for (std::size_t i = capacity; i < out.size(); ++i)
    if (out[i] != guard) fail(config, "wrote past the end");
  out.resize(result.written);
  if (options.order == Order::canonical && !std::is_sorted(out.begin(), out.end()))
    fail(config, "not sorted");
  if (result.ok()) {
    const testing::AssertionResult same = same_pairs(out, answer.pairs);
    if (!same) fail(config, same.message());
  }
  std::vector<Pair> taken;
  const auto take = [&](const Pair* pairs, std::size_t count) {
    taken.insert(taken.end(), pairs, pairs + count);
    return true;
  };
  const Result consumed =
      two_sets ? finder.consume(first, second, take) : finder.consume(first, take);
  if (!consumed.ok()) fail(config, consumed.message);
  const testing::AssertionResult same = same_pairs(taken, answer.pairs);
  if (!same) fail(config, "consumed: " + std::string(same.message()));
}

}  // namespace
}  // namespace throng::tests

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace throng::tests;
  static const std::vector<Config> configs = all_configs();
  static std::vector<throng::Finder> finders(configs.size());
  Bytes bytes(data, size);
  const std::uint32_t flags = bytes.next(), which = bytes.next(), room = bytes.next(),
                      choice = bytes.next();
  const bool two_sets = flags & 1;
  std::vector<float> seen;
  Set a, b;
  a.read(bytes, seen, two_sets ? 1 + choice % 64 : 600, flags & 2 ? 31 : 0);
  if (two_sets) b.read(bytes, seen, 600, flags & 2 ? 7 : 0);
  throng::Options shared;
  shared.nan = flags & 4 ? throng::NanPolicy::refuse : throng::NanPolicy::inactive;
  const float margins[] = {0.0f, 0.0f, 0.1f, 1.0f};
  shared.margin = margins[flags >> 3 & 3];
  const float scales[] = {1.0f, 1.0f, 0.125f, 8.0f};
  shared.cell_scale = scales[flags >> 5 & 3];
  const Answer answer = two_sets ? reference_pairs(a.view(which), b.view(which >> 1), shared.margin)
                                 : reference_pairs(a.view(which), shared.margin);
  // Four configurations an input: the input says which.
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t at = (choice + k * 11) % configs.size();
    throng::Options options = configs[at].options();
    options.nan = shared.nan;
    options.margin = shared.margin;
    options.cell_scale = shared.cell_scale;
    check(finders[at], configs[at], options, a, b, which, two_sets, room, answer);
  }
  return 0;
}
