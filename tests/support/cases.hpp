// The generator of hard cases shared by fuzzers, soak and tests: bytes become boxes, filters and
// options. It favours what random boxes never contain: faces that meet exactly or within two ulps,
// signed zeros, denormals, infinities, inverted boxes, sizes that differ by powers of two, worlds
// in one place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <throng/throng.hpp>

#include "support/bytes.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {

// Bits for the filters that a view has.
constexpr unsigned with_group = 1, with_mask = 2, with_owner = 4, with_world = 8, with_static = 16,
                   all_filters = 31;

struct Set {
  BoxList boxes;
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;

  std::size_t size() const { return boxes.size(); }
  bool has_nan() const;
  void add(const Box& box, std::uint32_t labels);
  void append(const Set& other, std::size_t i);
  void erase(std::size_t begin, std::size_t end);
  Boxes view(unsigned filters) const;
};

struct Case {
  Set a, b;
  bool two_sets = false;
  unsigned filters_a = 0, filters_b = 0;
  float margin = 0, cell_scale = 1;
  NanPolicy nan = NanPolicy::inactive;
  const char* shape = "";

  Boxes first() const { return a.view(filters_a); }
  Boxes second() const { return b.view(filters_b); }
  std::size_t size() const { return a.size() + (two_sets ? b.size() : 0); }
  bool is_refused() const {
    return nan == NanPolicy::refuse && (a.has_nan() || (two_sets && b.has_nan()));
  }
};

// At most about `most` boxes; `most` must be at least 32.
Case make_case(Bytes& bytes, std::size_t most);
// First byte of a case of scattered boxes with few overlaps.
constexpr std::uint8_t scattered_shape = 9;

// Whether some pair has faces within two ulps of each other and is separated nowhere else, so that
// the result depends on the last bit.
bool has_close_pair(const Case& c);

}  // namespace throng::tests
