// A temporary folder for the captures of a test.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "apps/scenes/capture.hpp"
#include "apps/scenes/npy.hpp"
#include "support/temporary_folder.hpp"

namespace throng::tests {

class CaptureTest : public testing::Test {
 protected:
  void SetUp() override { folder_ = make_temporary_folder("throng-capture").string(); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Options options() const {
    Options o;
    o.capture = folder_.c_str();
    return o;
  }
  // Sorted by creation.
  std::vector<std::string> files() const {
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
      paths.push_back(entry.path().string());
    std::sort(paths.begin(), paths.end());
    return paths;
  }
  scenes::Capture last() const {
    const auto paths = files();
    EXPECT_FALSE(paths.empty());
    return paths.empty() ? scenes::Capture{} : scenes::read_capture(paths.back());
  }
  std::string last_bytes() const {
    std::ifstream file(files().back(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

  std::string folder_;
};

inline scenes::Capture parse(const std::string& bytes) {
  return scenes::parse_capture(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(),
                               "capture");
}

}  // namespace throng::tests
