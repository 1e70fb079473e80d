// The capture file format: Options::capture writes it, `throng replay` reads it.
//
// Little-endian; floats as their bits. A file starts with a header of 16 bytes: the magic, and two
// u32, the version and 0. Sections follow:
//
//   u32 tag, u32 number, u64 payload bytes, the payload, u64 fold of all of these
//
// The section `options` comes first. Then, for each call, `operation`, the sections of its input,
// and `answer` once the call has returned; without an answer, the call did not return. A Finder
// call is a file of one operation; a BroadPhase appends to its file.
//
//   tag        number        payload
//   options    0             see OptionsFields
//   operation  Operation     u64 capacity (find: of the caller's buffer), three f32 (shift_origin)
//                            and two u32: the Form of find, the SweepHits of find_hits; how many
//                            sections of boxes follow
//   boxes      BoxesFlag     u64 count, six f32 per box, then the filters named by the flags, in
//                            their order: four bytes per box, one for is_static
//   ids        0             u64 count, u32 each; for `restart` 1 if the id is alive, else 0
//   sweeps     0             u64 count, nine f32 each
//   answer     Status        u64 found, written, inactive, first_invalid, invalid_count,
//                            bytes_needed, checksum; u32 Backend, Algorithm, Isa, threads
#pragma once

#include <throng/cpp17.hpp>

#include <cstddef>
#include <cstdint>

#include <throng/checksum.hpp>

namespace throng::capture {

constexpr unsigned char magic[8] = {'T', 'H', 'R', 'O', 'N', 'G', 0x1a, '\n'};
constexpr std::uint32_t format_version = 1;

enum class Tag : std::uint32_t { options = 1, operation, boxes, ids, sweeps, answer };
enum class Form : std::uint32_t { growing, buffer, consumer };
enum class Operation : std::uint32_t {
  find,  // one or two sets of boxes
  add,   // boxes
  remove,
  move,         // ids, boxes
  move_all,     // boxes
  set_filters,  // ids, boxes: only their filters are used
  shift_origin,
  update,
  find_overlaps,  // boxes
  find_hits,      // sweeps, boxes: only their filters are used
  restart,        // a copy of another BroadPhase: boxes of all ids, ids
};
constexpr std::uint32_t operation_count = 11;

enum BoxesFlag : std::uint32_t {
  has_group = 1,
  has_mask = 2,
  has_owner = 4,
  has_world = 8,
  has_static = 16,
  is_flat = 32,  // 2-D boxes: both z are written as 0
};
constexpr std::uint32_t known_boxes_flags = 63;

// The payload of `options`, in this order; 80 bytes.
struct OptionsFields {
  std::uint32_t algorithm, order, backend, nan, isa;  // as in throng/options.hpp
  std::uint32_t margin, cell_scale;                   // the bits of a float
  std::uint32_t threads, concurrent_consumer, measure_stages;
  std::uint32_t executor;  // 0: the default; else the caller's concurrency
  std::uint32_t memory;    // 1: a custom memory resource
  std::uint32_t stop;      // 1: a cancellation flag was set up
  std::uint32_t reserved;
  std::uint32_t cap_low, cap_high;  // memory_cap_bytes
  char library[16];                 // THRONG_VERSION, zero-terminated
};
static_assert(sizeof(OptionsFields) == 80, "16 words and 16 bytes, without padding");

// FNV-1a hash; the initial value is fold_start.
constexpr std::uint64_t fold_start = 0xcbf29ce484222325ull;
constexpr std::uint64_t fold(std::uint64_t sum, const unsigned char* bytes,
                             std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) sum = (sum ^ bytes[i]) * 0x100000001b3ull;
  return sum;
}
// The checksum of a result that is not a set of pairs: folds one number after the other.
constexpr std::uint64_t chain(std::uint64_t sum, std::uint64_t number) noexcept {
  return mix64(sum ^ mix64(number));
}

}  // namespace throng::capture
