// The C API: valid calls give the double loop's pairs in every layout and form; invalid ones a
// status and a message, whatever the structs hold.
#include <throng/throng.h>

#include <cmath>
#include <cstring>

#include "fuzz/target.hpp"
#include "support/cases.hpp"
#include "support/vectorized_reference.hpp"

namespace throng::tests {
namespace {

void must(bool good, const std::string& what) {
  if (!good) throw Difference(what);
}

template <class T>
throng_strided strided(const Strided<T>& s) {
  return {s.data, s.stride_bytes};
}

// The same boxes in one of three layouts.
struct Layout {
  std::vector<float> numbers;
  throng_boxes view;

  Layout(const Boxes& boxes, std::uint32_t kind) {
    const std::size_t n = boxes.size();
    const auto copy = [&](std::size_t stride, const std::size_t(&at)[6]) {
      numbers.assign(n * stride + 8 * n + 8, 0);
      for (std::size_t i = 0; i < n; ++i)
        for (int k = 0; k < 6; ++k) numbers[at[k] + i * stride] = boxes.corner(i, k);
      view = {};
      view.count = n;
      view.stride_bytes = stride * sizeof(float);
      for (int k = 0; k < 6; ++k) view.corner[k] = numbers.data() + at[k];
    };
    if (kind == 0) {
      copy(6, {0, 1, 2, 3, 4, 5});
    } else if (kind == 1) {
      copy(1, {0, n, 2 * n, 3 * n, 4 * n, 5 * n});
    } else {
      copy(9, {1, 2, 3, 5, 6, 7});
    }
    const Filters& f = boxes.filters;
    view.group = strided(f.group);
    view.mask = strided(f.mask);
    view.owner = strided(f.owner);
    view.world = strided(f.world);
    view.is_static = strided(f.is_static);
  }
};

struct Handle {
  throng_finder* finder;
  explicit Handle(const throng_options& options) : finder(throng_finder_create(&options)) {}
  ~Handle() { throng_finder_destroy(finder); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
};

// Makes one argument invalid. Returns the expected status, or THRONG_OK if any status will do.
throng_status spoil(Bytes& bytes, throng_options& options, throng_boxes& a) {
  switch (bytes.next() % 7) {
    case 0:
      options.margin = bytes.next() & 1 ? -1.0f : NAN;
      return THRONG_BAD_OPTION;
    case 1:
      options.algorithm = static_cast<int>(bytes.word() | 8);
      return THRONG_BAD_OPTION;
    case 2:
      options.order = 2 + static_cast<int>(bytes.next());
      return THRONG_BAD_OPTION;
    case 3:
      options.struct_bytes = bytes.next() % 8;
      return THRONG_BAD_OPTION;
    case 4:
      a.stride_bytes += 1 + bytes.next() % 3;
      return a.count ? THRONG_BAD_BOXES : THRONG_OK;
    case 5:
      a.corner[bytes.next() % 2] = nullptr;
      return a.count ? THRONG_BAD_BOXES : THRONG_OK;
    default:
      options.nan = 2 + static_cast<int>(bytes.next());
      return THRONG_BAD_OPTION;
  }
}

struct Taken {
  std::vector<Pair> pairs;
  static int take(void* self, const throng_pair* pairs, size_t count) {
    for (size_t i = 0; i < count; ++i)
      static_cast<Taken*>(self)->pairs.push_back({pairs[i].first, pairs[i].second});
    return 1;
  }
};

}  // namespace

void run(Bytes& bytes) {
  const std::uint32_t how = bytes.next(), capacity_choice = bytes.next();
  const Case c = make_case(bytes, 200);
  throng_options options;
  throng_options_init(&options);
  options.algorithm = static_cast<int>(how % 3);
  options.order = how >> 2 & 1;
  options.threads = 1;
  options.margin = c.margin;
  options.nan = c.nan == NanPolicy::refuse ? THRONG_NAN_REFUSE : THRONG_NAN_INACTIVE;
  Layout a(c.first(), how >> 3 & 3), b(c.second(), how >> 5 & 3);
  const throng_boxes* second = c.two_sets ? &b.view : nullptr;

  if (bytes.next() % 4 == 3) {
    const throng_status want = spoil(bytes, options, a.view);
    const Handle wrong(options);
    must(wrong.finder != nullptr, "no handle");
    const throng_status got = throng_find(wrong.finder, &a.view, second);
    const char* message = throng_finder_result(wrong.finder)->message;
    must(got == want || want == THRONG_OK, std::string("an invalid call returned ") +
                                               throng_status_text(got) + ", not " +
                                               throng_status_text(want) + ": " + message);
    must(got == THRONG_OK || *message, "no message");
    return;
  }

  const Handle handle(options);
  must(handle.finder != nullptr, "no handle");
  VectorizedReference loop;
  if (c.is_refused()) {
    must(throng_find(handle.finder, &a.view, second) == THRONG_NAN_BOX, "a NaN was not refused");
    return;
  }
  loop.run(c.first(), c.second(), c.two_sets, c.margin);
  const throng_result* result = throng_finder_result(handle.finder);
  Taken taken;
  throng_status status;
  if (how >> 7) {
    status = throng_consume(handle.finder, &a.view, second, Taken::take, &taken);
  } else if (capacity_choice % 2) {
    const std::size_t capacity = capacity_choice % (loop.pairs().size() + 2);
    std::vector<throng_pair> out(capacity + 1, throng_pair{7, 7});
    status = throng_find_into(handle.finder, &a.view, second, out.data(), capacity);
    must(out[capacity].first == 7 && out[capacity].second == 7, "wrote past the end");
    must(result->found == loop.pairs().size(), "miscounted");
    must(status == (capacity < result->found ? THRONG_BUFFER_TOO_SMALL : THRONG_OK),
         std::string("status ") + throng_status_text(status));
    if (status != THRONG_OK) return;
    Taken::take(&taken, out.data(), result->written);
  } else {
    status = throng_find(handle.finder, &a.view, second);
    std::size_t count = 0;
    const throng_pair* pairs = throng_finder_pairs(handle.finder, &count);
    Taken::take(&taken, pairs, count);
  }
  must(status == THRONG_OK, result->message);
  must(result->inactive == loop.inactive(), "inactive boxes miscounted");
  const std::string wrong =
      loop.compare(taken.pairs.data(), taken.pairs.size(), options.order == THRONG_ORDER_CANONICAL);
  must(wrong.empty(), wrong);
}

}  // namespace throng::tests
