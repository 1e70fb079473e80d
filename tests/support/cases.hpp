// One generator of hard cases for fuzzers, soak and tests: bytes become boxes, filters and options.
// Most of it aims at what random boxes never do: faces that meet exactly or within two ulps, signed
// zeros, denormals, infinities, inverted boxes, sizes apart by powers of two, worlds in one place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <throng/throng.hpp>

#include "support/bytes.hpp"
#include "support/hard_boxes.hpp"

namespace throng::tests {

// Bits that say which filters hang on a view.
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

// About at most `most` boxes; `most` at least 32.
Case make_case(Bytes& bytes, std::size_t most);
// The first byte of a case of the usual kind: scattered boxes few of which meet.
constexpr std::uint8_t scattered_shape = 9;

// Whether some pair that may meet has faces within two ulps of each other, where nothing else keeps
// the two boxes apart: a case whose answer hangs on the last bit.
bool has_close_pair(const Case& c);

}  // namespace throng::tests
