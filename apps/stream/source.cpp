#include "apps/stream/source.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "apps/common/failure.hpp"

namespace throng::stream {
namespace {

// Number of rows that are read at a time through buffers.
constexpr std::size_t block_rows = 8192;

}  // namespace

FileSource::FileSource(const SetFiles& files, bool round_outward)
    : files_(files), boxes_(files.boxes, round_outward) {
  const auto open = [&](const std::string& file, auto& reader, std::size_t& at) {
    if (file.empty()) return;
    reader.emplace(file, boxes_.count());
    layout_.add(at);
  };
  open(files.group, group_, layout_.group);
  open(files.mask, mask_, layout_.mask);
  open(files.owner, owner_, layout_.owner);
  open(files.world, world_, layout_.world);
  open(files.is_static, is_static_, layout_.is_static);
  block_.resize(std::min<std::size_t>(block_rows, std::max<std::size_t>(boxes_.count(), 1)) *
                sizeof(Box));
}

template <class T>
void FileSource::read_filter(std::optional<scenes::ValueReader<T>>& reader, std::size_t at,
                             std::size_t first, std::size_t count, char* out) {
  if (!reader) return;
  T* values = reinterpret_cast<T*>(block_.data());
  reader->read(first, count, values);
  for (std::size_t i = 0; i < count; ++i) {
    std::memcpy(out + i * layout_.bytes + at, values + i, sizeof(T));
  }
  if constexpr (std::is_same_v<T, std::int32_t>) {
    if (&reader == &world_) check_worlds(values, count, first, files_.world);
  }
}

void FileSource::read(std::uint64_t first, std::size_t count, char* out) {
  for (std::size_t done = 0; done < count;) {
    const std::size_t now = std::min(block_.size() / sizeof(Box), count - done);
    const std::size_t from = static_cast<std::size_t>(first) + done;
    char* rows = out + done * layout_.bytes;
    boxes_.read(frame_, from, now, reinterpret_cast<Box*>(block_.data()));
    for (std::size_t i = 0; i < now; ++i) {
      const auto index = static_cast<std::uint32_t>(from + i);
      std::memcpy(rows + i * layout_.bytes, block_.data() + i * sizeof(Box), sizeof(Box));
      std::memcpy(rows + i * layout_.bytes + Layout::index_at, &index, sizeof index);
    }
    read_filter(group_, layout_.group, from, now, rows);
    read_filter(mask_, layout_.mask, from, now, rows);
    read_filter(owner_, layout_.owner, from, now, rows);
    read_filter(world_, layout_.world, from, now, rows);
    read_filter(is_static_, layout_.is_static, from, now, rows);
    done += now;
  }
}

void check_worlds(const std::int32_t* worlds, std::size_t count, std::size_t first,
                  const std::string& path) {
  const std::int32_t* bad = std::find_if(worlds, worlds + count, [](auto w) { return w < -1; });
  if (bad == worlds + count) return;
  throw common::Failure(fmt::format("{}: found world {} at box {}, wanted -1 (every world) or more",
                                    path, *bad, first + static_cast<std::size_t>(bad - worlds)));
}

void check_frames(const std::string& a, std::size_t frames_a, const std::string& b,
                  std::size_t frames_b) {
  if (frames_a == frames_b || frames_a == 1 || frames_b == 1) return;
  throw common::Failure(
      fmt::format("{}: found {} frames, wanted 1 or the {} of {}", b, frames_b, frames_a, a));
}

}  // namespace throng::stream
