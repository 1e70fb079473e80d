// A frame of a box file and its filter files, as rows.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/scenes/npy.hpp"
#include "apps/stream/rows.hpp"
#include "apps/stream/stream.hpp"

namespace throng::stream {

// Throws FileError, or Failure for a world below -1.
class FileSource final : public Source {
 public:
  FileSource(const SetFiles& files, bool round_outward);

  const std::string& path() const noexcept { return files_.boxes; }
  std::size_t frames() const noexcept { return boxes_.frames(); }
  const Layout& layout() const noexcept { return layout_; }
  void set_frame(std::size_t frame) noexcept { frame_ = frame; }

  std::uint64_t count() const noexcept override { return boxes_.count(); }
  void read(std::uint64_t first, std::size_t count, char* out) override;

 private:
  template <class T>
  void read_filter(std::optional<scenes::ValueReader<T>>& reader, std::size_t at, std::size_t first,
                   std::size_t count, char* out);

  SetFiles files_;
  scenes::BoxReader boxes_;
  std::optional<scenes::ValueReader<std::uint32_t>> group_, mask_;
  std::optional<scenes::ValueReader<std::int32_t>> owner_, world_;
  std::optional<scenes::ValueReader<std::uint8_t>> is_static_;
  Layout layout_;
  std::size_t frame_ = 0;
  std::vector<char> block_;
};

}  // namespace throng::stream
