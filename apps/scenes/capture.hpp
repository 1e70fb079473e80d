// Reads captures (throng/capture.hpp): the recorded calls of a program, with boxes and numbers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <throng/boxes.hpp>
#include <throng/broad_phase.hpp>
#include <throng/capture.hpp>
#include <throng/options.hpp>

namespace throng::scenes {

// A set of boxes with its filters. Absent filters are empty.
struct CapturedBoxes {
  std::uint32_t flags = 0;  // capture::BoxesFlag
  std::vector<Box> boxes;
  std::vector<std::uint32_t> group, mask;
  std::vector<std::int32_t> owner, world;
  std::vector<std::uint8_t> is_static;

  // 2-D where the captured boxes were.
  Boxes view() const noexcept;
};

struct CapturedAnswer {
  Status status = Status::ok;
  std::uint64_t found = 0, written = 0, inactive = 0, first_invalid = 0, invalid_count = 0,
                bytes_needed = 0, checksum = 0;
  Backend backend = Backend::cpu;
  Algorithm algorithm = Algorithm::automatic;
  Isa isa = Isa::automatic;
  std::uint32_t threads = 0;
};

struct CapturedCall {
  capture::Operation operation = capture::Operation::find;
  std::uint64_t capacity = 0;
  Vec3 by{};
  std::uint32_t form = 0;
  std::vector<CapturedBoxes> sets;  // at most two, and only for find
  std::vector<std::uint32_t> ids;
  std::vector<Sweep> sweeps;
  std::optional<CapturedAnswer> answer;  // none: the call did not return
};

struct Capture {
  Options options;  // executor, memory and stop are null: recorded separately
  std::uint32_t executor = 0;
  bool has_memory_resource = false, had_stop = false;
  std::string library;  // the version that wrote the file
  std::vector<CapturedCall> calls;
  bool truncated = false;  // the file ends within a call, which is left out

  bool is_finder() const noexcept {
    return calls.empty() || calls[0].operation == capture::Operation::find;
  }
};

// FileError, with the position, for any violation of the format; a header's sizes are checked
// against the file before use. A file that ends within its first call is refused, too.
Capture read_capture(const std::string& path);
Capture parse_capture(const unsigned char* data, std::size_t size, const std::string& name);

}  // namespace throng::scenes
