// Pictures are read back by Cairo and checked pixel by pixel.
#include "apps/report/draw_boxes.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <cairo/cairo.h>
#include <gtest/gtest.h>

#include "apps/report/canvas.hpp"
#include "apps/report/colour.hpp"
#include "apps/report/draw_mesh.hpp"

namespace throng::report {
namespace {

struct Pixels {
  int width = 0, height = 0;
  std::map<std::uint32_t, int> colours;
  std::uint32_t middle = 0;
};

Pixels look(const std::string& path) {
  Pixels p;
  cairo_surface_t* s = cairo_image_surface_create_from_png(path.c_str());
  EXPECT_EQ(cairo_surface_status(s), CAIRO_STATUS_SUCCESS);
  p.width = cairo_image_surface_get_width(s);
  p.height = cairo_image_surface_get_height(s);
  const unsigned char* data = cairo_image_surface_get_data(s);
  for (int y = 0; y < p.height; ++y) {
    const auto* row =
        reinterpret_cast<const std::uint32_t*>(data + y * cairo_image_surface_get_stride(s));
    for (int x = 0; x < p.width; ++x) ++p.colours[row[x] & 0xffffff];
    if (y == p.height / 2) p.middle = row[p.width / 2] & 0xffffff;
  }
  cairo_surface_destroy(s);
  return p;
}

PictureStyle small() {
  PictureStyle style;
  style.width = 320;
  style.height = 200;
  return style;
}

std::vector<Box> block() {
  std::vector<Box> boxes = {{{-500, -500, -1}, {500, 500, 0}}};  // a ground plane
  for (int i = 0; i < 512; ++i) {
    const float x = static_cast<float>(i % 8), y = static_cast<float>(i / 8 % 8),
                z = static_cast<float>(i / 64);
    boxes.push_back({{x, y, z}, {x + 0.9f, y + 0.9f, z + 0.9f}});
  }
  return boxes;
}

TEST(Picture, HasManyColoursAndTheRightSize) {
  const std::vector<Box> boxes = block();
  std::vector<float> values(boxes.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i);
  PictureStyle style = small();
  style.title = "title";
  style.caption = "caption";
  draw_boxes("picture_test.png", boxes.data(), boxes.size(), values.data(), style);
  const Pixels p = look("picture_test.png");
  EXPECT_EQ(p.width, 320);
  EXPECT_EQ(p.height, 200);
  EXPECT_GT(p.colours.size(), 1000u);
  EXPECT_FALSE(std::filesystem::exists("picture_test.png.part"));
  std::filesystem::remove("picture_test.png");
}

TEST(Picture, ValuesChangeColours) {
  const std::vector<Box> boxes = block();
  std::uint32_t middle[2];
  for (int k = 0; k < 2; ++k) {
    // All but one box, hidden below the heap, have the lowest or the highest value.
    std::vector<float> values(boxes.size(), k == 0 ? 0.0f : 10.0f);
    for (std::size_t i = 1; i < 40; ++i) values[i] = k == 0 ? 10.0f : 0.0f;
    draw_boxes("picture_values.png", boxes.data(), boxes.size(), values.data(), small());
    middle[k] = look("picture_values.png").middle;
  }
  std::filesystem::remove("picture_values.png");
  EXPECT_GT(middle[0] & 255, middle[0] >> 16) << "low values are blue";
  EXPECT_GT(middle[1] >> 16, middle[1] & 255) << "high values are yellow";
}

TEST(Picture, SkipsInvalidBoxes) {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::nanf("");
  const std::vector<std::vector<Box>> scenes = {
      {},
      {{{0, 0, 0}, {0, 0, 0}}},
      {{{1, 1, 1}, {0, 0, 0}}},
      {{{-inf, -inf, -inf}, {inf, inf, 0}}, {{0, 0, 0}, {1, 1, 1}}, {{2, 0, 0}, {3, 1, 1}}},
      {{{nan, 0, 0}, {1, 1, 1}}, {{0, 0, 0}, {1, nan, 1}}},
      {{{1e7f, 1e7f, 1e7f}, {1e7f, 1e7f, 1e7f}}, {{1e7f, 1e7f, 1e7f}, {1.0000001e7f, 1e7f, 1e7f}}},
  };
  for (const auto& boxes : scenes) {
    draw_boxes("picture_odd.png", boxes.data(), boxes.size(), nullptr, small());
    EXPECT_GT(look("picture_odd.png").colours.size(), 1u);
  }
  std::filesystem::remove("picture_odd.png");
}

TEST(Picture, ReportsWriteErrors) {
  const std::vector<Box> boxes = block();
  try {
    draw_boxes("no_such_folder/a.png", boxes.data(), boxes.size(), nullptr, small());
    FAIL();
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("no_such_folder/a.png"), std::string::npos);
  }
}

// A square of two triangles that faces the viewer, and a mark for each.
TEST(MeshPicture, MarkedTrianglesAreRed) {
  const std::vector<Vec3> points = {{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}};
  const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 2, 3}};
  const TriangleMesh mesh(points, triangles);
  PictureStyle style = small();
  style.dark = false;
  style.azimuth = 0;
  style.elevation = 0;
  const auto count_red = [&](const std::vector<std::uint8_t>& marked, UpAxis up) {
    draw_meshes("mesh_picture.png", {{mesh, marked.data(), ""}}, "marked", up, style);
    int red = 0;
    const Pixels p = look("mesh_picture.png");
    for (const auto& [colour, count] : p.colours) {
      if ((colour >> 16) > 3 * (colour >> 8 & 255) && (colour >> 16) > 100) red += count;
    }
    return red;
  };
  const int none = count_red({0, 0}, UpAxis::z), one = count_red({1, 0}, UpAxis::z),
            both = count_red({1, 1}, UpAxis::z);
  EXPECT_EQ(none, 0);
  EXPECT_GT(one, 1000);
  EXPECT_NEAR(both, 2 * one, 0.1 * one);
  EXPECT_LT(count_red({1, 1}, UpAxis::x), 300) << "the square lies flat, seen edge on";
  std::filesystem::remove("mesh_picture.png");
}

// A red square below a larger one: it shines through from above, and is red from below.
TEST(MeshPicture, HiddenMarksShineThrough) {
  const std::vector<Vec3> points = {{-4, -4, 1}, {4, -4, 1}, {4, 4, 1}, {-4, 4, 1},
                                    {-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0}};
  const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  const std::vector<std::uint8_t> marked = {0, 0, 1, 1}, none = {0, 0, 0, 0};
  const auto middle = [&](const DoubleVec3& from, const std::vector<std::uint8_t>& marks) {
    PictureStyle style = small();
    look_from(from, UpAxis::z, style);
    draw_meshes("mesh_picture.png", {{TriangleMesh(points, triangles), marks.data(), ""}}, "marked",
                UpAxis::z, style);
    const std::uint32_t colour = look("mesh_picture.png").middle;
    std::filesystem::remove("mesh_picture.png");
    // How much more red than green and blue.
    return static_cast<int>(colour >> 16) -
           static_cast<int>(std::max(colour >> 8 & 255, colour & 255));
  };
  const int above = middle({0, 0, 2}, marked), below = middle({0, 0, -2}, marked);
  EXPECT_GT(above, 40);
  EXPECT_GT(below, above + 40);
  EXPECT_LT(middle({0, 0, 2}, none), 10);
  EXPECT_LT(middle({0, 0, -2}, none), 10);
}

TEST(MeshPicture, TheViewerStandsInTheDirection) {
  const auto angles = [](const DoubleVec3& from, UpAxis up) {
    PictureStyle style;
    look_from(from, up, style);
    return std::make_pair(std::lround(style.azimuth), std::lround(style.elevation));
  };
  using Angles = std::pair<long, long>;
  EXPECT_EQ(angles({2, 0, 0}, UpAxis::z), Angles(0, 0));
  EXPECT_EQ(angles({0, 1e-9, 0}, UpAxis::z), Angles(90, 0));
  EXPECT_EQ(angles({1, 1, std::sqrt(2.0)}, UpAxis::z), Angles(45, 45));
  EXPECT_EQ(angles({0, 0, -7}, UpAxis::z), Angles(-90, -90));
  // y points up, so z is first.
  EXPECT_EQ(angles({0, 0, 1}, UpAxis::y), Angles(0, 0));
  EXPECT_EQ(angles({1, 0, 0}, UpAxis::y), Angles(90, 0));
  EXPECT_EQ(angles({0, 1, 0}, UpAxis::y), Angles(0, 90));
  EXPECT_EQ(angles({0, 1, 0}, UpAxis::x), Angles(0, 0));
}

TEST(MeshPicture, TakesAnyCoordinates) {
  const double inf = std::numeric_limits<double>::infinity(), most = 1.7e308;
  const std::vector<std::vector<DoubleVec3>> cases = {
      {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}},
      {{-most, 0, 0}, {most, 0, 0}, {0, most, -most}},
      {{5e-324, 0, 0}, {0, 5e-324, 0}, {0, 0, 0}},
      {{1e15, 1e15, 0}, {1e15 + 1, 1e15, 0}, {1e15, 1e15 + 1, 0}},
      {{inf, 0, 0}, {0, 1, 0}, {0, 0, 1}},
  };
  for (const std::vector<DoubleVec3>& points : cases) {
    const std::vector<Triangle> triangles = {{0, 1, 2}};
    draw_meshes("mesh_picture.png", {{TriangleMesh(points, triangles), nullptr, "name"}}, "marked",
                UpAxis::y, small());
    EXPECT_GT(look("mesh_picture.png").colours.size(), 1u);
  }
  draw_meshes("mesh_picture.png", {}, "marked", UpAxis::y, small());
  EXPECT_GT(look("mesh_picture.png").colours.size(), 1u);
  std::filesystem::remove("mesh_picture.png");
}

TEST(Canvas, TheNearerFaceWinsInAnyOrder) {
  const Corner far[4] = {{0, 0, 1}, {8, 0, 1}, {8, 8, 1}, {0, 8, 1}};
  const Corner near[4] = {{2, 2, 2}, {6, 2, 2}, {6, 6, 2}, {2, 6, 2}};
  for (const bool far_first : {true, false}) {
    Canvas c(8, 8);
    if (far_first) c.quad(far, 1, 5);
    c.quad(near, 2, 5);
    if (!far_first) c.quad(far, 1, 5);
    int count[2] = {0, 0};
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x) ++count[c.tag(x, y) >> 3 == 2];
    EXPECT_EQ(count[0], 48);
    EXPECT_EQ(count[1], 16);
  }
}

TEST(ColourMap, LightnessRisesEvenly) {
  float before = -1;
  for (int k = 0; k <= 100; ++k) {
    const Vector c = colour_map(static_cast<float>(k) / 100);
    const float luminance = 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
    EXPECT_GT(luminance, before);
    before = luminance;
  }
  for (const unsigned rgb : {0x000000u, 0x47515fu, 0xffffffu}) {
    const Vector v = from_screen(rgb);
    const unsigned back = static_cast<unsigned>(std::lround(255 * to_screen(v.x))) << 16 |
                          static_cast<unsigned>(std::lround(255 * to_screen(v.y))) << 8 |
                          static_cast<unsigned>(std::lround(255 * to_screen(v.z)));
    EXPECT_EQ(back, rgb);
  }
}

}  // namespace
}  // namespace throng::report
