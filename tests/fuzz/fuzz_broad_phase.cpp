// Bytes become calls on a BroadPhase, good ones and wrong ones, and the same on its model. Whatever
// is told must be what the model tells; a wrong call must be refused and change nothing.
#include <cstdint>
#include <cstdlib>
#include <iostream>

#include "broad_phase/model.hpp"
#include "broad_phase/state.hpp"
#include "support/random.hpp"

namespace throng::tests {
namespace {

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  bool empty() const { return at_ >= size_; }
  std::uint32_t next() { return at_ < size_ ? data_[at_++] : 0; }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

void must(const testing::AssertionResult& r) {
  if (r) return;
  std::cerr << r.message() << std::endl;
  std::abort();
}
void must(bool good, const char* what) {
  if (!good) must(testing::AssertionFailure() << what);
}

// Whole numbers, now and then an ulp off, or an end of the floats.
float coordinate(Bytes& bytes) {
  const std::uint32_t b = bytes.next();
  const float ends[] = {-INFINITY, INFINITY, 1e30f, -1e30f, 0x1p-149f, -0.0f, 3e7f, 16777216.0f};
  if (b >= 248) return ends[b - 248];
  const float x = static_cast<float>(b % 31) - 15;
  return b / 31 == 7 ? nudge(x, static_cast<int>(bytes.next() % 5) - 2) : x;
}
Box box(Bytes& bytes) {
  const std::uint32_t kind = bytes.next();
  const float side = static_cast<float>(kind & 7) * ((kind & 8) ? 0.25f : 1.0f);
  Box b{{coordinate(bytes), coordinate(bytes), coordinate(bytes)}, {}};
  b.upper = {b.lower.x + side, b.lower.y + side, b.lower.z + side};
  if (kind >= 240) b.upper = {coordinate(bytes), coordinate(bytes), coordinate(bytes)};
  return b;
}
Filter filter(Bytes& bytes) {
  Filter f;
  const std::uint32_t b = bytes.next();
  if (b & 1) f.group = 1u << (b >> 1 & 3);
  if (b & 8) f.mask = bytes.next();
  if (b & 16) f.owner = static_cast<std::int32_t>(bytes.next() % 4) - 1;
  if (b & 32) f.world = static_cast<std::int32_t>(bytes.next() % 4) - 1;
  f.is_static = b >> 7;
  return f;
}

void wrong_call(BroadPhase& b, const Model& model, Bytes& bytes) {
  const Snapshot before(b);
  const std::uint32_t what = bytes.next();
  const ObjectId id = bytes.next() * 7;
  const Box nan{{0, 0, NAN}, {1, 1, 1}}, some{{0, 0, 0}, {1, 1, 1}};
  Status status = Status::busy;
  if (what % 4 == 0)
    status = b.add(nan, {}, *std::make_unique<ObjectId>());
  else if (model.alive(id)) {
    const ObjectId twice[] = {id, id};
    const Box two[] = {some, some};
    status = what % 4 == 1   ? b.move(id, nan)
             : what % 4 == 2 ? b.remove(twice, 2).status
                             : b.move(twice, Boxes(two, 2)).status;
  } else {
    status = what % 2 ? b.remove(id) : b.move(id, some);
  }
  must(status == Status::nan_box || status == Status::bad_id, "a wrong call was not refused");
  must(Snapshot(b) == before, "a refused call changed something");
}

void live(Bytes& bytes) {
  const std::uint32_t flags = bytes.next();
  Options options;
  options.threads = 1;
  options.margin = (flags & 3) == 3 ? 0.3f : 0.0f;
  BroadPhase b(options);
  Model model(options.margin);
  const auto one = [&]() -> ObjectId {
    const std::vector<ObjectId> ids = model.ids();
    return ids.empty() ? 0 : ids[bytes.next() % ids.size()];
  };
  const auto update = [&] {
    must(b.update().ok(), "an update failed");
    model.update();
    must(model.check(b, bytes.next() % 2 == 0));
  };
  std::size_t updates = 0;
  while (!bytes.empty() && updates < 64) {
    const ObjectId id = one();
    const bool any = model.count() != 0;
    const std::uint32_t call = bytes.next() % 16;
    if (call < 4) {
      // A row of one box: enough objects for few to be few, from few bytes.
      Box next = box(bytes);
      const Filter f = call == 3 ? filter(bytes) : Filter{};
      for (std::uint32_t k = call == 0 ? 32 : 1; k > 0 && model.count() < 150; --k) {
        ObjectId got = 0;
        const Status s = b.add(next, f, got);
        const bool has_nan = next.upper.x != next.upper.x || next.upper.y != next.upper.y ||
                             next.upper.z != next.upper.z;
        must(s == (has_nan ? Status::nan_box : Status::ok), "add");
        if (has_nan) break;
        must(model.add(got, next, f));
        next.lower.x += 1;
        next.upper.x += 1;
      }
    } else if (call == 4 && any) {
      must(b.remove(id) == Status::ok, "remove");
      model.remove(id);
    } else if (call == 5 && any) {
      const Filter f = filter(bytes);
      must(b.set_filter(id, f) == Status::ok, "set_filter");
      model.at(id).filter = f;
    } else if (call == 6) {
      wrong_call(b, model, bytes);
    } else if (call == 7) {
      b = BroadPhase(b);
    } else if (call < 12 && any) {
      const Box to = box(bytes);
      const bool has_nan =
          to.upper.x != to.upper.x || to.upper.y != to.upper.y || to.upper.z != to.upper.z;
      must(b.move(id, to) == (has_nan ? Status::nan_box : Status::ok), "move");
      if (!has_nan) model.at(id).box = to;
    } else {
      update();
      ++updates;
    }
  }
  update();
}

}  // namespace
}  // namespace throng::tests

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  throng::tests::Bytes bytes(data, size);
  throng::tests::live(bytes);
  return 0;
}
