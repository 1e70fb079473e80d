// Writing .npy: boxes, pairs and filters.
#include "apps/scenes/npy.hpp"
#include "apps/scenes/npy_header.hpp"
#include "apps/scenes/output_file.hpp"

namespace throng::scenes {
namespace {

std::size_t write_header(OutputFile& file, const std::string& descr,
                         const std::vector<std::uint64_t>& shape) {
  const std::string header = format_npy_header(descr, shape);
  file.write(header.data(), header.size());
  return header.size();
}

template <class T>
void write_values(const std::string& path, char kind, const T* values, std::size_t count) {
  OutputFile file(path);
  write_header(file, native_descr(kind, sizeof(T)), {count});
  file.write(values, count * sizeof(T));
  file.commit();
}

}  // namespace

void write_boxes(const std::string& path, const Box* boxes, std::size_t frames, std::size_t count) {
  BoxWriter writer(path, frames, count);
  writer.write(boxes, frames * count);
  writer.finish();
}

void write_pairs(const std::string& path, const Pair* pairs, std::size_t count) {
  OutputFile file(path);
  write_header(file, native_descr('u', 4), {count, 2});
  file.write(pairs, count * sizeof(Pair));
  file.commit();
}

void write_u32(const std::string& path, const std::uint32_t* values, std::size_t count) {
  write_values(path, 'u', values, count);
}

void write_i32(const std::string& path, const std::int32_t* values, std::size_t count) {
  write_values(path, 'i', values, count);
}

void write_u8(const std::string& path, const std::uint8_t* values, std::size_t count) {
  write_values(path, 'u', values, count);
}

BoxWriter::BoxWriter(const std::string& path, std::size_t frames, std::size_t count)
    : file_(std::make_unique<OutputFile>(path)), wanted_(frames * count) {
  if (frames == 1) {
    write_header(*file_, native_descr('f', 4), {count, 6});
  } else {
    write_header(*file_, native_descr('f', 4), {frames, count, 6});
  }
}

BoxWriter::~BoxWriter() = default;
BoxWriter::BoxWriter(BoxWriter&&) noexcept = default;
BoxWriter& BoxWriter::operator=(BoxWriter&&) noexcept = default;

void BoxWriter::write(const Box* boxes, std::size_t count) {
  if (count > wanted_ - written_) {
    throw FileError("more boxes given than the " + std::to_string(wanted_) +
                    " that the file was opened for");
  }
  file_->write(boxes, count * sizeof(Box));
  written_ += count;
}

void BoxWriter::finish() {
  if (written_ != wanted_) {
    throw FileError("only " + std::to_string(written_) + " boxes given of the " +
                    std::to_string(wanted_) + " that the file was opened for");
  }
  file_->commit();
}

WorldWriter::WorldWriter(const std::string& path, std::size_t count)
    : file_(std::make_unique<OutputFile>(path)) {
  write_header(*file_, native_descr('i', 4), {count});
}
WorldWriter::~WorldWriter() = default;
void WorldWriter::write(const std::int32_t* values, std::size_t count) {
  file_->write(values, count * sizeof(std::int32_t));
}
void WorldWriter::finish() { file_->commit(); }

PairWriter::PairWriter(const std::string& path) : file_(std::make_unique<OutputFile>(path)) {
  if (!file_->can_seek()) {
    throw_file_error(path, "a pipe",
                     "a regular file: its header holds the number of pairs, which is known last");
  }
  header_bytes_ = write_header(*file_, native_descr('u', 4), {0, 2});
}

PairWriter::~PairWriter() = default;
PairWriter::PairWriter(PairWriter&&) noexcept = default;
PairWriter& PairWriter::operator=(PairWriter&&) noexcept = default;

void PairWriter::write(const Pair* pairs, std::size_t count) {
  file_->write(pairs, count * sizeof(Pair));
  written_ += count;
}

void PairWriter::truncate(std::uint64_t count) {
  if (count >= written_) return;
  file_->truncate(header_bytes_ + count * sizeof(Pair));
  written_ = count;
}

void PairWriter::finish() {
  file_->seek(0);
  write_header(*file_, native_descr('u', 4), {written_, 2});  // at most as long as the first one
  file_->commit();
}

}  // namespace throng::scenes
