#include "apps/throng/input.hpp"

#include <filesystem>
#include <new>
#include <system_error>

#include <fmt/format.h>

#include "apps/report/format.hpp"
#include "apps/stream/stream.hpp"
#include "apps/throng/console.hpp"
#include "apps/throng/failure.hpp"

namespace throng::cli {
namespace {

// Calls `read`; when memory is short, adds the number of bytes to the error. That is the file's
// size: readers allocate no more than the file can fill.
template <class Read>
auto reading(const std::string& path, Read read) {
  try {
    return read();
  } catch (const std::bad_alloc&) {
    std::error_code error;
    const auto size = std::filesystem::file_size(path, error);
    throw Failure(
        fmt::format("{}: out of memory; about {} bytes needed to hold it", path,
                    error ? std::string("an unknown number of") : report::format_count(size)));
  }
}

template <class T>
Strided<T> strided(const std::vector<T>& values) {
  return values.empty() ? Strided<T>{} : Strided<T>{values.data(), values.size(), sizeof(T)};
}

}  // namespace

std::vector<scenes::NamedFile> files_of(const InputArguments& arguments) {
  std::vector<scenes::NamedFile> files = {{"A", arguments.a}, {"B", arguments.b}};
  const auto add = [&](const FilterFiles& f, const std::string& suffix) {
    files.insert(files.end(), {{"--group" + suffix, f.group},
                               {"--mask" + suffix, f.mask},
                               {"--owner" + suffix, f.owner},
                               {"--world" + suffix, f.world},
                               {"--static" + suffix, f.is_static}});
  };
  add(arguments.filters_a, "");
  add(arguments.filters_b, "-b");
  return files;
}

BoxSet::BoxSet(const std::string& path, const FilterFiles& files, bool round_outward)
    : path_(path), boxes_(reading(path, [&] { return scenes::read_boxes(path, round_outward); })) {
  const auto load = [&](const std::string& file, auto& values, auto* read) {
    if (!file.empty()) values = reading(file, [&] { return read(file, count()); });
  };
  load(files.group, group_, &scenes::read_u32);
  load(files.mask, mask_, &scenes::read_u32);
  load(files.owner, owner_, &scenes::read_i32);
  load(files.world, world_, &scenes::read_i32);
  load(files.is_static, is_static_, &scenes::read_u8);
  // Reported here, as the file's name is only known here.
  stream::check_worlds(world_.data(), world_.size(), 0, files.world);
}

std::uint64_t BoxSet::bytes() const noexcept {
  return std::uint64_t{frames()} * count() * sizeof(Box) +
         4 * (group_.size() + mask_.size() + owner_.size() + world_.size()) + is_static_.size();
}

Boxes BoxSet::frame(std::size_t f) const {
  Boxes view(boxes_.frame(frames() == 1 ? 0 : f), count());
  view.filters.group = strided(group_);
  view.filters.mask = strided(mask_);
  view.filters.owner = strided(owner_);
  view.filters.world = strided(world_);
  view.filters.is_static = strided(is_static_);
  return view;
}

Input::Input(const InputArguments& arguments)
    : a_(arguments.a, arguments.filters_a, arguments.round_outward) {
  const FilterFiles& f = arguments.filters_b;
  if (!arguments.b.empty()) {
    b_.emplace(arguments.b, f, arguments.round_outward);
    stream::check_frames(a_.path(), a_.frames(), b_->path(), b_->frames());
  } else {
    arguments.require_no_filters_b();
  }
}

std::uint64_t Input::bytes() const noexcept { return a_.bytes() + (b_ ? b_->bytes() : 0); }

std::size_t Input::frames() const noexcept {
  if (b_ && a_.frames() == 1) return b_->frames();
  return a_.frames();
}

std::string Input::name(std::size_t frame) const {
  std::string name = a_.path();
  if (b_) name += " and " + b_->path();
  if (frames() > 1) name += fmt::format(", frame {}", frame);
  return name;
}

void require_ok(const Result& result, const Input& input, std::size_t frame,
                const common::HintOptions& hint_options) {
  if (result.ok()) return;
  if (result.status == Status::memory_cap_too_small) throw CapTooSmall{};
  throw Failure(
      fmt::format("{}: {}", input.name(frame), common::failure_text(result, hint_options)));
}

}  // namespace throng::cli
