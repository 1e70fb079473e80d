// A folder for the files of a test.
#pragma once

#include <filesystem>
#include <random>
#include <string>

namespace throng::tests {

// Makes a new folder, whose name begins with `name`.
inline std::filesystem::path make_temporary_folder(const std::string& name) {
  std::random_device random;
  for (;;) {
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / (name + "-" + std::to_string(random()));
    if (std::filesystem::create_directory(folder)) return folder;
  }
}

}  // namespace throng::tests
