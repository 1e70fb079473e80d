// Reading .npy: what is accepted, what is refused, and the messages.
#include <gtest/gtest.h>
#ifndef _WIN32
#include <sys/stat.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <new>

#include "apps/scenes/npy.hpp"
#include "largest_block.hpp"
#include "npy_bytes.hpp"

namespace throng::scenes {
namespace {

using npy_bytes::file;
using npy_bytes::Folder;
using npy_bytes::raw;
using npy_bytes::with_header;

BoxFile parse(const std::string& bytes, bool outward = false) {
  return parse_boxes(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(),
                     "boxes.npy", outward);
}

// The reader's error; empty on success.
template <class Read>
std::string complaint(Read read) {
  try {
    read();
  } catch (const FileError& e) {
    return e.what();
  }
  return "";
}
std::string complaint_of(const std::string& bytes) {
  return complaint([&] { parse(bytes); });
}

const float* floats(const BoxFile& f) { return &f.boxes[0].lower.x; }

std::vector<float> count_up(std::size_t n) {
  std::vector<float> v(n);
  for (std::size_t i = 0; i < n; ++i) v[i] = static_cast<float>(i) * 0.25f - 3;
  return v;
}

TEST(ReadBoxes, OneFrameAndSeveral) {
  const std::vector<float> v = count_up(36);
  const BoxFile one = parse(file("<f4", "(6, 6)", raw(v)));
  EXPECT_EQ(one.frames, 1u);
  EXPECT_EQ(one.count, 6u);
  EXPECT_TRUE(std::equal(v.begin(), v.end(), floats(one)));
  const BoxFile three = parse(file("<f4", "(3, 2, 6)", raw(v)));
  EXPECT_EQ(three.frames, 3u);
  EXPECT_EQ(three.count, 2u);
  EXPECT_EQ(three.frame(2)[1].upper.z, v[35]);
  EXPECT_EQ(parse(file("<f4", "(0, 6)", "")).count, 0u);
}

TEST(ReadBoxes, EveryVersionAndSpelling) {
  const std::vector<float> v = count_up(6);
  for (int major : {1, 2, 3}) {
    EXPECT_EQ(parse(file("<f4", "(1, 6)", raw(v), false, major)).count, 1u) << major;
  }
  EXPECT_EQ(parse(with_header("{\"shape\":(1L,6),\"fortran_order\":False,\"descr\":\"<f4\"}   \n",
                              raw(v)))
                .count,
            1u);
}

TEST(ReadBoxes, OtherByteOrder) {
  const std::vector<float> v = count_up(12);
  const BoxFile f = parse(file(">f4", "(2, 6)", raw(v, true)));
  EXPECT_TRUE(std::equal(v.begin(), v.end(), floats(f)));
  const std::vector<double> d(v.begin(), v.end());
  const BoxFile g = parse(file(">f8", "(2, 6)", raw(d, true)));
  EXPECT_TRUE(std::equal(v.begin(), v.end(), floats(g)));
}

TEST(ReadBoxes, FortranOrder) {
  const std::vector<float> v = count_up(2 * 3 * 6);
  std::vector<float> two, three;
  for (int k = 0; k < 6; ++k)
    for (int i = 0; i < 6; ++i) two.push_back(v[static_cast<std::size_t>(i * 6 + k)]);
  for (int k = 0; k < 6; ++k)
    for (int i = 0; i < 3; ++i)
      for (int f = 0; f < 2; ++f) three.push_back(v[static_cast<std::size_t>((f * 3 + i) * 6 + k)]);
  EXPECT_TRUE(std::equal(v.begin(), v.end(), floats(parse(file("<f4", "(6, 6)", raw(two), true)))));
  EXPECT_TRUE(
      std::equal(v.begin(), v.end(), floats(parse(file("<f4", "(2, 3, 6)", raw(three), true)))));
}

// 2-D boxes, and corners with their own index, in C and Fortran order; all messages name a position
// in the file.
TEST(ReadBoxes, OtherShapes) {
  const std::vector<float> v = count_up(5 * 12);
  const auto in_fortran_order = [&](const std::vector<std::size_t>& shape) {
    std::vector<float> turned(v.size());
    for (std::size_t at = 0; at < v.size(); ++at) {
      std::size_t rest = at, to = 0, factor = v.size();
      for (std::size_t k = shape.size(); k-- > 0; rest /= shape[k]) {
        factor /= shape[k];
        to += rest % shape[k] * factor;
      }
      turned[to] = v[at];
    }
    return turned;
  };
  struct Shape {
    std::vector<std::size_t> shape;
    std::size_t frames, count;
    bool is_flat;
  };
  const Shape shapes[] = {
      {{10, 6}, 1, 10, false}, {{2, 5, 6}, 2, 5, false}, {{10, 2, 3}, 1, 10, false},
      {{15, 4}, 1, 15, true},  {{5, 3, 4}, 5, 3, true},  {{15, 2, 2}, 1, 15, true},
  };
  for (const Shape& s : shapes) {
    std::string text;
    for (const std::size_t k : s.shape) text += std::to_string(k) + ", ";
    for (const bool fortran : {false, true}) {
      for (const bool wide : {false, true}) {
        const std::vector<float> stored = fortran ? in_fortran_order(s.shape) : v;
        const std::vector<double> doubles(stored.begin(), stored.end());
        const BoxFile f = parse(wide ? file("<f8", "(" + text + ")", raw(doubles), fortran)
                                     : file("<f4", "(" + text + ")", raw(stored), fortran));
        SCOPED_TRACE(text + (fortran ? "in Fortran order" : "in C order"));
        ASSERT_EQ(f.frames, s.frames);
        ASSERT_EQ(f.count, s.count);
        ASSERT_EQ(f.is_flat, s.is_flat);
        const float* want = v.data();
        for (std::size_t i = 0; i < s.frames * s.count; ++i) {
          for (std::size_t k = 0; k < 6; ++k) {
            const float got = (&f.boxes[i].lower.x)[k];
            const float wanted = s.is_flat && k % 3 == 2 ? 0 : *want++;
            ASSERT_EQ(got, wanted) << i << ' ' << k;
          }
        }
      }
    }
  }
  std::vector<double> odd(12, 1.0);
  odd[11] = 0.1;
  EXPECT_NE(complaint_of(file("<f8", "(2, 2, 3)", raw(odd))).find("(1, 1, 2)"), std::string::npos);
  EXPECT_NE(complaint_of(file("<f8", "(3, 4)", raw(odd))).find("(2, 3)"), std::string::npos);
  EXPECT_NE(complaint_of(file("<f8", "(3, 1, 4)", raw(odd))).find("(2, 0, 3)"), std::string::npos);
  EXPECT_NE(complaint_of(file("<f8", "(3, 2, 2)", raw(odd))).find("(2, 1, 1)"), std::string::npos);
  for (const char* shape : {"(4, 3)", "(2, 6, 1)", "(2, 3, 2)", "(12,)", "(1, 2, 2, 3)"})
    EXPECT_NE(complaint_of(file("<f8", shape, raw(odd))).find("(n, 6)"), std::string::npos)
        << shape;
}

TEST(ReadBoxes, DoublesThatAreFloats) {
  const double inf = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const BoxFile f =
      parse(file("<f8", "(1, 6)", raw<double>({-inf, nan, -0.0, inf, 1.5, 0x1p-149})));
  EXPECT_EQ(f.boxes[0].lower.x, -INFINITY);
  EXPECT_TRUE(std::isnan(f.boxes[0].lower.y));
  EXPECT_TRUE(std::signbit(f.boxes[0].lower.z));
  EXPECT_EQ(f.boxes[0].upper.x, INFINITY);
  EXPECT_EQ(f.boxes[0].upper.z, 0x1p-149f);
}

TEST(ReadBoxes, OtherDoublesOnlyRoundedOutward) {
  const std::string bytes = file(
      "<f8", "(2, 6)", raw<double>({0, 0, 0, 1, 1, 1, 0.1, -0.1, 1e300, 0.1, -0.1, 0x1p-1000}));
  const std::string error_text = complaint_of(bytes);
  EXPECT_NE(error_text.find("boxes.npy"), std::string::npos) << error_text;
  EXPECT_NE(error_text.find("(1, 0)"), std::string::npos) << error_text;
  EXPECT_NE(error_text.find("--round outward"), std::string::npos) << error_text;
  const BoxFile f = parse(bytes, true);
  const Box& b = f.boxes[1];
  EXPECT_LT(b.lower.x, 0.1);
  EXPECT_EQ(std::nextafter(b.lower.x, 1.0f), b.upper.x);
  EXPECT_GT(b.upper.x, 0.1);
  EXPECT_LT(b.lower.y, -0.1);
  EXPECT_EQ(std::nextafter(b.lower.y, 1.0f), b.upper.y);
  EXPECT_EQ(b.lower.z, std::numeric_limits<float>::max());
  EXPECT_EQ(b.upper.z, 0x1p-149f);
  EXPECT_EQ(f.boxes[0].upper.x, 1.0f);
  EXPECT_NE(complaint_of(file("<f8", "(1, 6)", raw<double>({0, 0, 0, 1, 1, 1e39}))), "");
}

struct Bad {
  const char* what;
  std::string bytes;
  const char* message_part;  // must occur in the message
};

std::vector<Bad> bad_files() {
  const std::string v = raw(count_up(6));
  const std::string good = file("<f4", "(1, 6)", v);
  const std::string head = "{'descr': '<f4', 'fortran_order': False, 'shape': ";
  return {
      {"empty", "", "empty"},
      {"garbage", std::string(500, 'x'), "\\x93NUMPY"},
      {"zip", "PK\3\4 and so on and so on", "\\x93NUMPY"},
      {"magic alone", good.substr(0, 6), "6 bytes"},
      {"no header", good.substr(0, 10), "ends inside its header"},
      {"half a header", good.substr(0, 40), "ends inside its header"},
      {"truncated", good.substr(0, good.size() - 1), "23 bytes of data"},
      {"trailing", good + "x", "25 bytes of data"},
      {"version", file("<f4", "(1, 6)", v, false, 4), "version 4.0"},
      {"huge header", npy_bytes::preamble(2, 0xffffffffu) + "{}", "4294967295 bytes"},
      {"int32", file("<i4", "(1, 6)", v), "int32"},
      {"int64", file("<i8", "(1, 6)", v + v), "int64"},
      {"float16", file("<f2", "(1, 6)", v.substr(0, 12)), "float16"},
      {"bool", file("|b1", "(1, 6)", v.substr(0, 6)), "bool"},
      {"complex", file("<c8", "(1, 6)", v + v), "'<c8'"},
      {"objects", file("|O", "(1, 6)", v), "'|O'"},
      {"text", file("<U1", "(1, 6)", v), "'<U1'"},
      {"odd float", file("<f3", "(1, 6)", v.substr(0, 18)), "<f3"},
      {"records",
       with_header("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (6,)}", v),
       "several fields"},
      {"scalar", file("<f4", "()", v.substr(0, 4)), "()"},
      {"one dimension", file("<f4", "(6,)", v), "(6,)"},
      {"turned", file("<f4", "(6, 1)", v), "(6, 1)"},
      {"five wide", file("<f4", "(1, 5)", v.substr(0, 20)), "(1, 5)"},
      {"four dimensions", file("<f4", "(1, 1, 1, 6)", v), "(1, 1, 1, 6)"},
      {"2^40 boxes", file("<f4", "(1099511627776, 6)", v), "1099511627776"},
      {"2^40 frames", file("<f4", "(1099511627776, 1, 6)", v), "1099511627776"},
      {"product is 2^64", file("<f4", "(4294967296, 4294967296, 6)", v), "4294967296"},
      {"product wraps to 24", file("<f4", "(9223372036854775809, 2, 6)", v + v), "fits in a file"},
      {"dimension past 2^64", file("<f4", "(18446744073709551616, 6)", v), "2^64"},
      {"2^40 empty frames", file("<f4", "(1099511627776, 0, 6)", ""), "empty frames"},
      {"no frames", file("<f4", "(0, 5, 6)", ""), "at least one frame"},
      {"negative", file("<f4", "(-1, 6)", v), "shape"},
      {"number for tuple", file("<f4", "6", v), "'('"},
      {"open tuple", with_header(head + "(1, 6", v), "comma"},
      {"open dictionary", with_header(head + "(1, 6)", v), "comma"},
      {"open word", with_header("{'descr", v), "unterminated"},
      {"no shape", with_header("{'descr': '<f4', 'fortran_order': False}", v), "no 'shape'"},
      {"no descr", with_header("{'fortran_order': False, 'shape': (1, 6)}", v), "no 'descr'"},
      {"no order", with_header("{'descr': '<f4', 'shape': (1, 6)}", v), "no 'fortran_order'"},
      {"twice", with_header("{'descr': '<f4', 'descr': '<f4'}", v), "the key 'descr'"},
      {"other key", with_header(head + "(1, 6), 'more': 1}", v), "the key 'more'"},
      {"order 1", with_header("{'fortran_order': 1}", v), "True nor False"},
      {"after", with_header(head + "(1, 6)} or not", v), "after the closing brace"},
      {"zeros", with_header(std::string(40, '\0'), v), "'{'"},
  };
}

TEST(LargestBlock, IsRecorded) {
  forget_blocks();
  // Called by name: an unused new-expression may be optimized away.
  ::operator delete(::operator new(123456));
  EXPECT_EQ(largest_block(), 123456u);
  ::operator delete(::operator new(123457, std::nothrow));
  EXPECT_EQ(largest_block(), 123457u);
}

TEST(ReadBoxes, BadFilesAreNamedWithTheReason) {
  const Folder folder;
  for (const Bad& bad : bad_files()) {
    const std::string error_text = complaint_of(bad.bytes);
    EXPECT_EQ(error_text.rfind("boxes.npy: found ", 0), 0u) << bad.what << ": " << error_text;
    EXPECT_NE(error_text.find("; wanted "), std::string::npos) << bad.what << ": " << error_text;
    EXPECT_NE(error_text.find(bad.message_part), std::string::npos)
        << bad.what << ": " << error_text;
    // The same from a file, by name.
    const std::string path = folder.put("bad.npy", bad.bytes);
    forget_blocks();
    const std::string of_file = complaint([&] { read_boxes(path); });
    EXPECT_LT(largest_block(), 4096u) << bad.what;
    ASSERT_GT(error_text.size(), 9u);
    EXPECT_EQ(of_file, path + error_text.substr(9)) << bad.what;
  }
}

TEST(ReadBoxes, SurvivesAnyChangedByte) {
  const std::string good = file("<f4", "(2, 6)", raw(count_up(12)));
  for (std::size_t n = 0; n < good.size(); ++n) {
    EXPECT_NE(complaint_of(good.substr(0, n)), "") << n << " bytes";
  }
  int refused = 0;
  for (std::size_t at = 0; at + 48 < good.size(); ++at) {
    for (int value = 0; value < 256; ++value) {
      std::string changed = good;
      changed[at] = static_cast<char>(value);
      refused += !complaint_of(changed).empty();
    }
  }
  EXPECT_GT(refused, 10000);
}

TEST(ReadBoxes, NoFileToRead) {
  const Folder folder;
  const std::string missing = folder / "missing.npy";
  const std::string error_text = complaint([&] { read_boxes(missing); });
  EXPECT_NE(error_text.find(missing + ": found no file"), std::string::npos) << error_text;
  EXPECT_NE(complaint([&] { read_boxes(folder / "."); }).find("a directory"), std::string::npos);
  EXPECT_NE(complaint([&] { read_boxes(""); }), "");
#ifndef _WIN32
  EXPECT_NE(complaint([&] { read_boxes("/dev/null"); }).find("a device"), std::string::npos);
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_NE(complaint([&] { read_boxes(pipe); }).find("a pipe"),
            std::string::npos);  // does not block
#endif
}

TEST(ReadFilters, AnyIntegerTypeThatFits) {
  const Folder folder;
  const auto put = [&](const char* descr, const std::string& data) {
    return folder.put("f.npy", file(descr, "(3,)", data));
  };
  const std::vector<std::uint32_t> u = {0, 7, 100};
  EXPECT_EQ(read_u32(put("<u4", raw(u)), 3), u);
  EXPECT_EQ(read_u32(put(">u4", raw(u, true)), 3), u);
  EXPECT_EQ(read_u32(put("<i8", raw<std::int64_t>({0, 7, 100})), 3), u);
  EXPECT_EQ(read_u32(put(">u2", raw<std::uint16_t>({0, 7, 100}, true)), 3), u);
  EXPECT_EQ(read_u32(put("|i1", raw<std::int8_t>({0, 7, 100})), 3), u);
  EXPECT_EQ(read_u32(put("<u4", raw<std::uint32_t>({0, 1, 0xffffffff})), 3)[2], 0xffffffffu);
  const std::vector<std::int32_t> s = {-1, -2147483647 - 1, 2147483647};
  EXPECT_EQ(read_i32(put("<i8", raw<std::int64_t>({-1, -2147483648ll, 2147483647})), 3), s);
  EXPECT_EQ(read_i32(put(">i4", raw(s, true)), 3), s);
  const std::vector<std::uint8_t> b = {0, 1, 1};
  EXPECT_EQ(read_u8(put("|b1", raw(b)), 3), b);
  EXPECT_EQ(read_u8(put("<i2", raw<std::int16_t>({0, 1, 1})), 3), b);
  EXPECT_EQ(read_u8(folder.put("none.npy", file("|u1", "(0,)", "")), 0).size(), 0u);
}

TEST(ReadFilters, OutOfRangeValuesAreNamed) {
  const Folder folder;
  const auto error_text = [&](const std::string& descr, const std::string& shape,
                              const std::string& data, auto read, std::size_t expected = 3) {
    const std::string path = folder.put("owner.npy", file(descr, shape, data));
    return complaint([&] { read(path, expected); });
  };
  const auto has = [](const std::string& text, const std::string& word) {
    return ::testing::AssertionResult(text.find("owner.npy: found ") != std::string::npos &&
                                      text.find(word) != std::string::npos)
           << text;
  };
  const std::string i4 = raw<std::int32_t>({5, -1, 5});
  EXPECT_TRUE(has(error_text("<i4", "(3,)", i4, read_u32), "value -1 at index 1"));
  EXPECT_TRUE(has(error_text("<i4", "(3,)", i4, read_u8), "from 0 to 255"));
  EXPECT_TRUE(has(error_text("<u4", "(3,)", raw<std::uint32_t>({0, 0, 2147483648u}), read_i32),
                  "value 2147483648 at index 2"));
  EXPECT_TRUE(has(error_text("<u8", "(3,)", raw<std::uint64_t>({1ull << 63, 0, 0}), read_i32),
                  "value 9223372036854775808 at index 0"));
  EXPECT_TRUE(has(error_text("<i8", "(3,)", raw<std::int64_t>({0, -2147483649ll, 0}), read_i32),
                  "value -2147483649 at index 1"));
  EXPECT_TRUE(has(error_text("<i4", "(3,)", i4, read_i32, 4), "shape (4,), one value per box"));
  EXPECT_TRUE(has(error_text("<i4", "(3, 1)", i4, read_i32), "(3, 1)"));
  EXPECT_TRUE(has(error_text("<i4", "()", i4.substr(0, 4), read_i32, 1), "()"));
  EXPECT_TRUE(has(error_text("<f4", "(3,)", i4, read_i32), "float32"));
  EXPECT_TRUE(has(error_text("|b1", "(3,)", i4.substr(0, 3), read_i32), "bool"));
  EXPECT_TRUE(has(error_text("|b2", "(3,)", i4.substr(0, 6), read_u8), "b2"));
  EXPECT_TRUE(has(error_text("<i4", "(3,)", i4.substr(1), read_i32), "11 bytes of data"));
  EXPECT_TRUE(
      has(error_text("<i4", "(1099511627776,)", i4, read_i32, 1ull << 40), "1099511627776"));
}

TEST(ReadBoxes, RealData) {
  const char* data = std::getenv("THRONG_DATA");
  if (!data) GTEST_SKIP() << "THRONG_DATA does not name the folder of real boxes";
  const std::pair<const char*, std::size_t> files[] = {{"bounds01.npy", 288},
                                                       {"bounds02.npy", 4221},
                                                       {"cloth-funnel.npy", 55864},
                                                       {"armadillo-rollers.npy", 72740},
                                                       {"cloth-ball.npy", 277653}};
  for (const auto& [name, count] : files) {
    const BoxFile f = read_boxes(std::string(data) + "/" + name);
    EXPECT_EQ(f.frames, 1u) << name;
    EXPECT_EQ(f.count, count) << name;
    const Box& b = f.boxes[f.count - 1];
    EXPECT_TRUE(b.lower.x <= b.upper.x && b.lower.y <= b.upper.y && b.lower.z <= b.upper.z) << name;
  }
}

}  // namespace
}  // namespace throng::scenes
