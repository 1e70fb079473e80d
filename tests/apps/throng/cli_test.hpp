// Runs the built program as a child process and collects its output.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/process.hpp"
#include "support/temporary_folder.hpp"

namespace throng::test {

namespace fs = std::filesystem;

struct ProcessOutput {
  int status = -1;  // exit status; 128 + the signal that ended it
  std::string out, err;
};

inline std::string slurp(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void spill(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

// Text that a program wrote; Windows writes two characters at the end of a line.
inline std::string slurp_text(const fs::path& path) {
  std::string text = slurp(path);
#ifdef _WIN32
  text.erase(std::remove(text.begin(), text.end(), '\r'), text.end());
#endif
  return text;
}

// A temporary folder per test.
class CliTest : public ::testing::Test {
 protected:
  void SetUp() override { folder_ = tests::make_temporary_folder("throng-cli"); }
  void TearDown() override {
    std::error_code error;
    fs::permissions(folder_, fs::perms::owner_all, error);
    fs::remove_all(folder_, error);
  }

  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  bool exists(const std::string& name) const { return fs::exists(folder_ / name); }
  // All files in the folder, except the test runner's own.
  std::size_t files() const {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      const std::string name = entry.path().filename().string();
      count += name != "output.out" && name != "output.err";
    }
    return count;
  }

  ProcessOutput run_program(const std::string& program, const std::vector<std::string>& arguments,
                            const Limits& limits = {}) const {
    const std::string out = limits.out_path.empty() ? at("output.out") : limits.out_path;
    ProcessOutput output;
    output.status = wait_for(start(program, arguments, out, at("output.err"), folder_, limits));
    if (limits.out_path.empty()) output.out = slurp_text(out);
    output.err = slurp_text(at("output.err"));
    return output;
  }

  ProcessOutput run(const std::vector<std::string>& arguments, const Limits& limits = {}) const {
    return run_program(THRONG_PROGRAM, arguments, limits);
  }

  // Runs with --json; expects success and one object.
  nlohmann::json json(std::vector<std::string> arguments) const {
    arguments.push_back("--json");
    const ProcessOutput output = run(arguments);
    EXPECT_EQ(output.status, 0) << output.err;
    EXPECT_EQ(output.err, "");
    nlohmann::json object = nlohmann::json::parse(output.out, nullptr, false);
    EXPECT_TRUE(object.is_object()) << output.out;
    return object;
  }

  // Exit status 2, a message with all of these words, and nothing on standard output.
  void refuses(const std::vector<std::string>& arguments, const std::vector<std::string>& words,
               const Limits& limits = {}) const {
    const ProcessOutput output = run(arguments, limits);
    EXPECT_EQ(output.status, 2) << output.err;
    EXPECT_EQ(output.out, "");
    for (const std::string& word : words) {
      EXPECT_NE(output.err.find(word), std::string::npos)
          << "no '" << word << "' in: " << output.err;
    }
  }

  fs::path folder_;
};

// The bytes of a .npy file, written here to be independent of the reader.
inline std::string npy(const std::string& descr, const std::string& shape, const void* data,
                       std::size_t bytes, bool fortran = false) {
  std::string header = "{'descr': '" + descr +
                       "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': (" +
                       shape + "), }";
  while ((10 + header.size() + 1) % 64) header += ' ';
  header += '\n';
  std::string file("\x93NUMPY\x01\x00", 8);
  file += static_cast<char>(header.size() & 255);
  file += static_cast<char>(header.size() >> 8);
  return file + header + std::string(static_cast<const char*>(data), bytes);
}

template <class T>
std::string npy(const std::string& descr, const std::string& shape, const std::vector<T>& data) {
  return npy(descr, shape, data.data(), data.size() * sizeof(T));
}

}  // namespace throng::test
