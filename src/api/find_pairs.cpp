// find_pairs: a search into a vector by a temporary Finder; and rounding of doubles to float boxes.
#include <throng/throng.hpp>

#include "base/bounds.hpp"
#include "base/float_state.hpp"
#include "finder_access.hpp"
#include "grid/engine.hpp"
#include "validate.hpp"

namespace throng {
namespace {

// A search into a vector. vector::resize writes all elements before the search fills them, so few
// pairs are collected in the finder's memory first and copied.
class IntoVector {
 public:
  IntoVector(std::vector<Pair>& out, const Options& options) noexcept
      : out_(out), finder_(options) {}

  template <class AnyBoxes>
  Result find(const AnyBoxes& a, const AnyBoxes* b) noexcept {
    base::Output output{out_.data(), out_.size(), grow, this};
    Result r = FinderAccess::run<AnyBoxes>(finder_, a, b, &output, nullptr);
    const auto found = static_cast<std::size_t>(r.ok() ? r.found : 0);
    if (found <= out_.size()) {
      out_.resize(found);
      return r;
    }
    try {
      out_.assign(output.data, output.data + found);
    } catch (...) {
      explain_failure(r, {Status::out_of_memory, found * sizeof(Pair)},
                      "take pairs in blocks by Finder::consume, or split the boxes");
    }
    return r;
  }

 private:
  static Pair* grow(void* self, std::size_t count) noexcept {
    auto& [out, finder] = *static_cast<IntoVector*>(self);
    if (count <= grid::few_pairs && out.empty()) {
      if (Pair* const buffer = FinderAccess::grow_pairs(&finder, count)) return buffer;
    }
    try {
      out.clear();
      out.reserve(count);
      want_large_pages(out.data(), count * sizeof(Pair));
      out.resize(count);
    } catch (...) {
      return nullptr;
    }
    return out.data();
  }

  std::vector<Pair>& out_;
  Finder finder_;
};

template <class AnyBoxes>
Result find_into(const AnyBoxes& a, const AnyBoxes* b, std::vector<Pair>& out,
                 const Options& options) noexcept {
  Options strict = options;
  if (strict.inverted == InvertedPolicy::automatic) strict.inverted = InvertedPolicy::refuse;
  return IntoVector(out, strict).find(a, b);
}

template <class AnyBoxes>
std::vector<Pair> find_or_throw(const AnyBoxes& a, const AnyBoxes* b, const Options& options) {
  std::vector<Pair> pairs;
  const Result r = find_into(a, b, pairs, options);
  if (!r.ok()) throw Error(r);
  return pairs;
}

}  // namespace

Error::Error(const Result& result)
    : std::runtime_error(std::string("throng: ") + result.message), result_(result) {}

Result find_pairs(const Boxes& boxes, std::vector<Pair>& out, const Options& options) noexcept {
  return find_into<Boxes>(boxes, nullptr, out, options);
}
Result find_pairs(const Boxes& a, const Boxes& b, std::vector<Pair>& out,
                  const Options& options) noexcept {
  return find_into(a, &b, out, options);
}
std::vector<Pair> find_pairs(const Boxes& boxes, const Options& options) {
  return find_or_throw<Boxes>(boxes, nullptr, options);
}
std::vector<Pair> find_pairs(const Boxes& a, const Boxes& b, const Options& options) {
  return find_or_throw(a, &b, options);
}

Result find_pairs(const DoubleBoxes& boxes, std::vector<Pair>& out,
                  const Options& options) noexcept {
  return find_into<DoubleBoxes>(boxes, nullptr, out, options);
}
Result find_pairs(const DoubleBoxes& a, const DoubleBoxes& b, std::vector<Pair>& out,
                  const Options& options) noexcept {
  return find_into(a, &b, out, options);
}
std::vector<Pair> find_pairs(const DoubleBoxes& boxes, const Options& options) {
  return find_or_throw<DoubleBoxes>(boxes, nullptr, options);
}
std::vector<Pair> find_pairs(const DoubleBoxes& a, const DoubleBoxes& b, const Options& options) {
  return find_or_throw(a, &b, options);
}

Box round_outward(const double lower[3], const double upper[3]) noexcept {
  const base::FloatState float_state;
  const auto down = [](double x) {
    const float f = static_cast<float>(x);
    return static_cast<double>(f) > x ? base::next_down(f) : f;
  };
  const auto up = [&](double x) { return -down(-x); };
  return {{down(lower[0]), down(lower[1]), down(lower[2])},
          {up(upper[0]), up(upper[1]), up(upper[2])}};
}

namespace {

Box from_center(const Vec3& c, const Vec3& h) noexcept {
  return {{base::subtract_rounded_down(c.x, h.x), base::subtract_rounded_down(c.y, h.y),
           base::subtract_rounded_down(c.z, h.z)},
          {base::add_rounded_up(c.x, h.x), base::add_rounded_up(c.y, h.y),
           base::add_rounded_up(c.z, h.z)}};
}

}  // namespace

Box box_from_center(const Vec3& center, const Vec3& half_size) noexcept {
  const base::FloatState float_state;
  return from_center(center, half_size);
}

std::vector<Box> boxes_from_center(const Vec3* centers, const Vec3* half_sizes, std::size_t count) {
  const base::FloatState float_state;
  std::vector<Box> boxes(count);
  for (std::size_t i = 0; i < count; ++i) boxes[i] = from_center(centers[i], half_sizes[i]);
  return boxes;
}

}  // namespace throng
