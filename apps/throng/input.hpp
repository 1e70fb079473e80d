// The boxes and filters of a command, read from its files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <throng/boxes.hpp>
#include <throng/options.hpp>

#include "apps/common/failure_text.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/scenes/output_file.hpp"
#include "apps/throng/search_options.hpp"

namespace throng::cli {

// All input files of a command, by option.
std::vector<scenes::NamedFile> files_of(const InputArguments& arguments);

// One file of boxes and its filter files, in memory.
class BoxSet {
 public:
  // Throws FileError, or Failure where memory is short.
  BoxSet(const std::string& path, const FilterFiles& files, bool round_outward);

  const std::string& path() const noexcept { return path_; }
  std::size_t frames() const noexcept { return boxes_.frames; }
  std::size_t count() const noexcept { return boxes_.count; }
  std::uint64_t bytes() const noexcept;  // in memory, with filters
  // A file of one frame repeats it for every frame.
  Boxes frame(std::size_t f) const;

 private:
  std::string path_;
  scenes::BoxFile boxes_;
  std::vector<std::uint32_t> group_, mask_;
  std::vector<std::int32_t> owner_, world_;
  std::vector<std::uint8_t> is_static_;
};

// One set, or two with the same number of frames; a set of one frame repeats it.
class Input {
 public:
  explicit Input(const InputArguments& arguments);

  const BoxSet& a() const noexcept { return a_; }
  const std::optional<BoxSet>& b() const noexcept { return b_; }
  std::size_t frames() const noexcept;
  std::uint64_t bytes() const noexcept;
  // "A.npy", "A.npy and B.npy", with the frame if there are several: for messages.
  std::string name(std::size_t frame) const;

 private:
  BoxSet a_;
  std::optional<BoxSet> b_;
};

// The library needs more than the cap; a streamed search may fit.
struct CapTooSmall {};

// Unless `result` is ok, throws CapTooSmall, or Failure with the input's name and a fix.
void require_ok(const Result& result, const Input& input, std::size_t frame,
                const common::HintOptions& hint_options);

}  // namespace throng::cli
