// Rival: CGAL's box_self_intersection_d (GPL: this program is never packaged). Sequential: its
// parallel form is slower. Float bounds, closed boxes; the boxes are copied inside the time, since
// the algorithm reorders what it is given.
#include <CGAL/box_intersection_d.h>

#include "rivals.hpp"

namespace throng::bench {
namespace {

struct CgalBox {
  using NT = float;
  using ID = std::uint32_t;
  float low[3], high[3];
  ID number;

  static int dimension() { return 3; }
  ID id() const { return number; }
  NT min_coord(int k) const { return low[k]; }
  NT max_coord(int k) const { return high[k]; }
};

class Cgal : public Contender {
 public:
  explicit Cgal(std::ptrdiff_t cutoff) : cutoff_(cutoff) {}

  void run(const Input& in) override {
    out_.clear();
    boxes_.resize(in.count);
    for (std::size_t i = 0; i < in.count; ++i) {
      const Box& b = in.boxes[i];
      boxes_[i] = {{b.lower.x, b.lower.y, b.lower.z},
                   {b.upper.x, b.upper.y, b.upper.z},
                   static_cast<std::uint32_t>(i)};
    }
    CGAL::box_self_intersection_d(
        boxes_.begin(), boxes_.end(),
        [&](const CgalBox& a, const CgalBox& b) { out_.push(ordered(a.number, b.number)); },
        cutoff_);
  }
  void collect(const Input&, std::vector<Pair>& all) const override {
    all.insert(all.end(), out_.begin(), out_.end());
  }

 private:
  std::ptrdiff_t cutoff_;
  std::vector<CgalBox> boxes_;
  PairBuffer out_;
};

Entry entry(std::ptrdiff_t cutoff) {
  return {"CGAL box_self_intersection_d " + std::to_string(cutoff),
          "cutoff as named; sequential, which is faster than its parallel form",
          "",
          Kind::rival,
          false,
          [cutoff](unsigned) { return std::make_unique<Cgal>(cutoff); }};
}

}  // namespace

std::vector<Entry> cgal_entries() { return {entry(10), entry(1000)}; }

}  // namespace throng::bench
