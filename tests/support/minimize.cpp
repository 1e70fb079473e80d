#include "support/minimize.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace throng::tests {
namespace {

// Delta debugging over `count` items: removes halves first, then smaller pieces, down to single
// items. cut(begin, end) removes these and returns true if the failure remains.
void thin_out(std::size_t count, const std::function<bool(std::size_t, std::size_t)>& cut) {
  for (std::size_t piece = std::max<std::size_t>(count / 2, 1);; piece /= 2) {
    for (std::size_t begin = 0; begin < count;) {
      const std::size_t end = std::min(begin + piece, count);
      if (cut(begin, end))
        count -= end - begin;
      else
        begin = end;
    }
    if (piece <= 1) return;
  }
}

std::string literal(float x) {
  if (std::isnan(x)) return "NAN";
  if (std::isinf(x)) return x < 0 ? "-INFINITY" : "INFINITY";
  char text[40];
  std::snprintf(text, sizeof text, "%af", static_cast<double>(x));
  return text;
}

template <class T>
std::string list_of(const std::vector<T>& values) {
  std::string text;
  for (const T& value : values) text += (text.empty() ? "" : ", ") + std::to_string(value);
  return text;
}

std::string set_text(const Set& set, unsigned filters, const std::string& name) {
  std::string text = "  const BoxList " + name + " = {\n";
  for (const Box& b : set.boxes) {
    text += "      {{" + literal(b.lower.x) + ", " + literal(b.lower.y) + ", " +
            literal(b.lower.z) + "}, {" + literal(b.upper.x) + ", " + literal(b.upper.y) + ", " +
            literal(b.upper.z) + "}},\n";
  }
  text += "  };\n  Boxes view_" + name + " = " + name + ";\n";
  const auto filter = [&](unsigned bit, const char* type, const char* field, const auto& values) {
    if (!(filters & bit) || set.boxes.empty()) return;
    const std::string array = name + "_" + field;
    text += "  const std::vector<" + std::string(type) + "> " + array + " = {" + list_of(values) +
            "};\n  view_" + name + ".filters." + field + " = {" + array + ".data(), " + array +
            ".size()};\n";
  };
  filter(with_group, "std::uint32_t", "group", set.group);
  filter(with_mask, "std::uint32_t", "mask", set.mask);
  filter(with_owner, "std::int32_t", "owner", set.owner);
  filter(with_world, "std::int32_t", "world", set.world);
  filter(with_static, "std::uint8_t", "is_static", set.is_static);
  return text;
}

}  // namespace

std::vector<std::uint8_t> minimize_bytes(
    std::vector<std::uint8_t> bytes,
    const std::function<bool(const std::vector<std::uint8_t>&)>& fails) {
  const auto try_it = [&](std::vector<std::uint8_t> next) {
    if (!fails(next)) return false;
    bytes = std::move(next);
    return true;
  };
  for (std::size_t before = 0; before != bytes.size();) {
    before = bytes.size();
    thin_out(bytes.size(), [&](std::size_t begin, std::size_t end) {
      std::vector<std::uint8_t> next = bytes;
      next.erase(next.begin() + static_cast<std::ptrdiff_t>(begin),
                 next.begin() + static_cast<std::ptrdiff_t>(end));
      return try_it(std::move(next));
    });
  }
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (bytes[i] == 0) continue;
    std::vector<std::uint8_t> next = bytes;
    next[i] = 0;
    try_it(std::move(next));
  }
  return bytes;
}

Case minimize_case(Case c, const std::function<bool(const Case&)>& fails) {
  const auto try_it = [&](Case next) {
    if (!fails(next)) return false;
    c = std::move(next);
    return true;
  };
  const auto thin = [&](Set Case::*set) {
    thin_out((c.*set).size(), [&](std::size_t begin, std::size_t end) {
      Case next = c;
      (next.*set).erase(begin, end);
      return try_it(std::move(next));
    });
  };
  for (std::size_t before = 0; before != c.size();) {
    before = c.size();
    thin(&Case::a);
    if (c.two_sets) thin(&Case::b);
  }
  for (unsigned bit = 1; bit <= with_static; bit *= 2) {
    Case next = c;
    next.filters_a &= ~bit, next.filters_b &= ~bit;
    try_it(std::move(next));
  }
  const auto with = [&](const auto& change) {
    Case next = c;
    change(next);
    try_it(std::move(next));
  };
  with([](Case& next) { next.margin = 0; });
  with([](Case& next) { next.cell_scale = 1; });
  with([](Case& next) { next.nan = NanPolicy::refuse; });
  for (Set Case::*set : {&Case::a, &Case::b})
    for (std::size_t i = 0; i < (c.*set).size(); ++i)
      for (int k = 0; k < 6; ++k)
        for (const float plain : {0.0f, 1.0f, 2.0f}) {
          float& x = (&(c.*set).boxes[i].lower.x)[k];
          if (x == plain && !std::signbit(x)) break;
          const float was = x;
          x = plain;
          if (fails(c)) break;
          x = was;
        }
  return c;
}

std::string as_test(const Case& c, const Config& config, const std::string& name) {
  const auto algorithm = config.algorithm == Algorithm::all_pairs ? "all_pairs"
                         : config.algorithm == Algorithm::grid    ? "grid"
                                                                  : "automatic";
  std::string text = "// Made by throng-soak --minimize: " + std::to_string(c.size()) +
                     " boxes, by " + config.name() +
                     ".\n#include <gtest/gtest.h>\n\n#include <cmath>\n#include <vector>\n\n"
                     "#include \"support/hard_boxes.hpp\"\n#include \"support/reference.hpp\"\n\n"
                     "namespace throng::tests {\nnamespace {\n\nTEST(Regression, " +
                     name + ") {\n" + set_text(c.a, c.filters_a, "a");
  if (c.two_sets) text += set_text(c.b, c.filters_b, "b");
  text +=
      std::string("  Options options;\n  options.backend = Backend::") + to_string(config.backend) +
      ";\n  options.algorithm = Algorithm::" + algorithm + ";\n  options.isa = Isa::" +
      (config.isa == Isa::automatic ? "automatic" : to_string(config.isa)) +
      ";\n  options.order = Order::" + (config.order == Order::canonical ? "canonical" : "any") +
      ";\n  options.threads = " + std::to_string(config.threads) +
      ";\n  options.nan = NanPolicy::" + (c.nan == NanPolicy::refuse ? "refuse" : "inactive") +
      ";\n  options.inverted = InvertedPolicy::inactive" +
      ";\n  options.margin = " + literal(c.margin) +
      ";\n  options.cell_scale = " + literal(c.cell_scale) + ";\n";
  const std::string views = c.two_sets ? "view_a, view_b" : "view_a";
  text += "  EXPECT_TRUE(same_pairs(find_pairs(" + views + ", options),\n" +
          "                         reference_pairs(" + views +
          ", options.margin).pairs));\n}\n\n" + "}  // namespace\n}  // namespace throng::tests\n";
  return text;
}

}  // namespace throng::tests
