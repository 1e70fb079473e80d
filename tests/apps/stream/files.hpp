// Boxes in files, searched in slabs under a cap and in memory at once.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <throng/checksum.hpp>
#include <throng/throng.hpp>

#include "apps/common/failure.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/scenes/scene.hpp"
#include "apps/stream/stream.hpp"
#include "support/temporary_folder.hpp"

namespace throng::test {

namespace fs = std::filesystem;

// A set of boxes with optional filters.
struct Set {
  std::vector<Box> boxes;
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;

  Boxes view() const {
    Boxes view(boxes);
    const auto show = [](const auto& values, auto& to) {
      if (!values.empty()) to = {values.data(), values.size(), sizeof(values[0])};
    };
    show(group, view.filters.group);
    show(mask, view.filters.mask);
    show(owner, view.filters.owner);
    show(world, view.filters.world);
    show(is_static, view.filters.is_static);
    return view;
  }
};

inline Set scene_set(const std::string& name, std::size_t n, double density = 0,
                     std::uint64_t seed = 1) {
  scenes::Spec spec;
  spec.name = name;
  spec.objects = n;
  spec.density = density;
  spec.seed = seed;
  const scenes::Scene made(spec);
  Set set;
  set.boxes.resize(n);
  made.frame(0, set.boxes.data());
  if (made.has_worlds()) {
    for (std::size_t i = 0; i < n; ++i) set.world.push_back(made.world(i));
  }
  return set;
}

// A temporary folder per test; temporary files go there, too.
class StreamTest : public ::testing::Test {
 protected:
  void SetUp() override { folder_ = tests::make_temporary_folder("throng-stream"); }
  void TearDown() override {
    std::error_code error;
    fs::remove_all(folder_, error);
  }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  stream::SetFiles write(const Set& set, const std::string& name) const {
    stream::SetFiles files;
    files.boxes = at(name + ".npy");
    scenes::write_boxes(files.boxes, set.boxes.data(), 1, set.boxes.size());
    const auto filter = [&](const auto& values, std::string& file, const char* what, auto* store) {
      if (values.empty()) return;
      file = at(name + what);
      store(file, values.data(), values.size());
    };
    filter(set.group, files.group, "-group.npy", &scenes::write_u32);
    filter(set.mask, files.mask, "-mask.npy", &scenes::write_u32);
    filter(set.owner, files.owner, "-owner.npy", &scenes::write_i32);
    filter(set.world, files.world, "-world.npy", &scenes::write_i32);
    filter(set.is_static, files.is_static, "-static.npy", &scenes::write_u8);
    return files;
  }

  stream::Request request(const Set& a, const Set* b, const Options& options) const {
    stream::Request request;
    request.a = write(a, "a");
    if (b) request.b = write(*b, "b");
    request.options = options;
    request.output = at("pairs.npy");
    request.scratch_folder = folder_.string();
    return request;
  }

  // The smallest accepted cap, as named by the error for a smaller one.
  static std::size_t smallest_cap(stream::Request request) {
    request.options.memory_cap_bytes = 1;
    try {
      stream::run(request);
    } catch (const common::Failure& failure) {
      const std::string said = failure.what();
      const std::string before = "wanted at least ";
      const std::size_t found = said.find(before);
      if (found != std::string::npos) return std::stoull(said.substr(found + before.size()));
    }
    ADD_FAILURE() << "a cap of one byte is no error that names the bytes needed";
    return 0;
  }

  std::vector<Pair> read_pairs() const {
    std::ifstream file(at("pairs.npy"), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    constexpr std::size_t header = 128;
    EXPECT_GE(bytes.size(), header);
    if (bytes.size() < header) return {};
    std::vector<Pair> pairs((bytes.size() - header) / sizeof(Pair));
    if (!pairs.empty()) std::memcpy(pairs.data(), bytes.data() + header, pairs.size() * 8);
    const std::string shape = "(" + std::to_string(pairs.size()) + ", 2)";
    EXPECT_NE(bytes.substr(0, header).find(shape), std::string::npos) << bytes.substr(0, header);
    return pairs;
  }

  // The pairs, their number and checksum, and the inactive boxes equal those of a search in memory.
  stream::Report expect_same(const Set& a, const Set* b = nullptr, Options options = {},
                             std::size_t bytes_above_min = 0) const {
    stream::Request capped = request(a, b, options);
    capped.options.memory_cap_bytes = smallest_cap(capped) + bytes_above_min;
    const std::size_t before = files();
    const stream::Report report = stream::run(capped);
    EXPECT_EQ(files(), before + 1) << "more is left than the pairs";
    options.order = Order::canonical;
    Finder finder(options);
    const Result r = b ? finder.find(a.view(), b->view()) : finder.find(a.view());
    EXPECT_TRUE(r.ok()) << r.message;
    const Pairs expected = finder.pairs();
    std::vector<Pair> found = read_pairs();
    if (capped.options.order != Order::canonical) std::sort(found.begin(), found.end());
    EXPECT_EQ(found.size(), expected.size());
    EXPECT_TRUE(std::equal(found.begin(), found.end(), expected.begin(), expected.end()));
    EXPECT_EQ(report.frames.size(), 1u);
    EXPECT_EQ(report.frames[0].pairs, expected.size());
    EXPECT_EQ(report.frames[0].checksum, pair_checksum(expected.data(), expected.size()));
    EXPECT_EQ(report.frames[0].inactive, r.inactive);
    fs::remove(at("pairs.npy"));
    return report;
  }

  fs::path folder_;
};

}  // namespace throng::test
