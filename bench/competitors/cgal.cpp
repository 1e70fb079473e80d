// CGAL's box_self_intersection_d, of floats and of doubles. Its headers are GPL, so the benchmark
// is never packaged. Sequential: the parallel form is slower. Closed boxes. The boxes are copied
// inside the measured time, because the algorithm reorders its input.
#include <CGAL/box_intersection_d.h>

#include "competitors.hpp"
#include "doubles.hpp"

namespace throng::bench {
namespace {

template <class Number>
struct CgalBox {
  using NT = Number;
  using ID = std::uint32_t;
  NT low[3], high[3];
  ID number;

  static int dimension() { return 3; }
  ID id() const { return number; }
  NT min_coord(int k) const { return low[k]; }
  NT max_coord(int k) const { return high[k]; }
};

// Appends the pairs of `in`, which is copied to `boxes`.
template <class Number, class AnyBox>
void find(const AnyBox* in, std::size_t count, std::ptrdiff_t cutoff,
          std::vector<CgalBox<Number>>& boxes, PairBuffer& out) {
  boxes.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const AnyBox& b = in[i];
    boxes[i] = {{b.lower.x, b.lower.y, b.lower.z},
                {b.upper.x, b.upper.y, b.upper.z},
                static_cast<std::uint32_t>(i)};
  }
  CGAL::box_self_intersection_d(
      boxes.begin(), boxes.end(),
      [&](const CgalBox<Number>& a, const CgalBox<Number>& b) {
        out.push(ordered(a.number, b.number));
      },
      cutoff);
}

class Cgal : public Method {
 public:
  explicit Cgal(std::ptrdiff_t cutoff) : cutoff_(cutoff) {}

  void run(const Input& in) override {
    out_.clear();
    find(in.boxes, in.count, cutoff_, boxes_, out_);
  }
  void collect(const Input&, std::vector<Pair>& all) const override {
    all.insert(all.end(), out_.begin(), out_.end());
  }

 private:
  std::ptrdiff_t cutoff_;
  std::vector<CgalBox<float>> boxes_;
  PairBuffer out_;
};

class CgalDoubles : public DoubleMethod {
 public:
  explicit CgalDoubles(std::ptrdiff_t cutoff) : cutoff_(cutoff) {}

  std::string name() const override { return "CGAL, cutoff " + std::to_string(cutoff_); }
  std::size_t run(const std::vector<DoubleBox>& boxes) override {
    out_.clear();
    find(boxes.data(), boxes.size(), cutoff_, boxes_, out_);
    return out_.size();
  }

 private:
  std::ptrdiff_t cutoff_;
  std::vector<CgalBox<double>> boxes_;
  PairBuffer out_;
};

MethodInfo method(std::ptrdiff_t cutoff) {
  return {"CGAL box_self_intersection_d " + std::to_string(cutoff),
          "cutoff as named; sequential, which is faster than its parallel form",
          "",
          Origin::other_library,
          false,
          [cutoff](unsigned) { return std::make_unique<Cgal>(cutoff); }};
}

}  // namespace

std::vector<MethodInfo> cgal_methods() { return {method(10), method(1000)}; }

std::vector<std::unique_ptr<DoubleMethod>> cgal_double_methods() {
  std::vector<std::unique_ptr<DoubleMethod>> all;
  for (const std::ptrdiff_t cutoff : {10, 1000})
    all.push_back(std::make_unique<CgalDoubles>(cutoff));
  return all;
}

}  // namespace throng::bench
