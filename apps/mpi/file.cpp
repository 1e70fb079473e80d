#include "apps/mpi/file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include <fmt/format.h>

#include "apps/common/failure.hpp"
#include "apps/mpi/collective.hpp"
#include "apps/scenes/npy.hpp"
#include "apps/scenes/npy_header.hpp"

namespace throng::mpi_app {

using common::Failure;

namespace {

constexpr std::size_t piece = std::size_t{1} << 28;  // MPI counts are int

void check(int code, const std::string& path, const char* what) {
  if (code == MPI_SUCCESS) return;
  char text[MPI_MAX_ERROR_STRING] = "";
  int length = 0;
  MPI_Error_string(code, text, &length);
  throw Failure(fmt::format("{}: {}: {}", path, what, text));
}

void read_at(MPI_File file, const std::string& path, std::uint64_t at, void* out,
             std::size_t bytes) {
  for (std::size_t done = 0; done < bytes;) {
    const std::size_t next = std::min(piece, bytes - done);
    const std::uint64_t place = at + done;
    MPI_Status status;
    check(MPI_File_read_at(file, static_cast<MPI_Offset>(place), static_cast<char*>(out) + done,
                           static_cast<int>(next), MPI_BYTE, &status),
          path, "cannot be read");
    int got = 0;
    MPI_Get_count(&status, MPI_BYTE, &got);
    if (static_cast<std::size_t>(got) != next) {
      throw Failure(
          fmt::format("{}: found a file that grew shorter while read, wanted {} bytes at {}", path,
                      next, at + done));
    }
    done += next;
  }
}

}  // namespace

std::uint64_t slice_begin(std::uint64_t n, int rank, int size) noexcept {
  const auto r = static_cast<std::uint64_t>(rank), s = static_cast<std::uint64_t>(size);
  return n / s * r + std::min(n % s, r);
}

// Each rank opens the file independently, so that the ranks that fail are known.
void BoxSlices::open() {
  check(MPI_File_open(MPI_COMM_SELF, path_.c_str(), MPI_MODE_RDONLY, MPI_INFO_NULL, &file_), path_,
        "cannot be opened");
  MPI_Offset bytes = 0;
  check(MPI_File_get_size(file_, &bytes), path_, "has no size");
  file_bytes_ = static_cast<std::uint64_t>(bytes);
  std::vector<unsigned char> start(std::min<std::uint64_t>(file_bytes_, 12));
  read_at(file_, path_, 0, start.data(), start.size());
  const std::size_t all = std::min<std::uint64_t>(
      scenes::npy_prefix_bytes(start.data(), start.size(), path_), file_bytes_);
  if (all > start.size()) {
    start.resize(all);
    read_at(file_, path_, 0, start.data(), all);
  }
  const scenes::NpyHeader h =
      scenes::parse_npy_header(start.data(), start.size(), file_bytes_, path_);
  const std::size_t d = h.shape.size();
  if (h.descr != scenes::native_descr('f', 4) || h.fortran_order || (d != 2 && d != 3) ||
      h.shape.back() != 6) {
    scenes::throw_file_error(path_, h.text() + (h.fortran_order ? " in Fortran order" : ""),
                             "float32 of shape (n, 6) or (frames, n, 6), in C order and this "
                             "machine's byte order, which ranks can read by parts");
  }
  count_ = h.shape[d - 2];
  frames_ = d == 3 ? h.shape[0] : 1;
  offset_ = h.data_offset;
}

BoxSlices::BoxSlices(const std::string& path, MPI_Comm comm) : path_(path), comm_(comm) {
  try {
    run_collectively(comm_, [&] { open(); });
    const std::uint64_t mine[] = {file_bytes_, count_, frames_};
    const char* names[] = {"bytes", "boxes", "frames"};
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t most = max_over_ranks(mine[k], comm_),
                          least = ~max_over_ranks(~mine[k], comm_);
      if (most == least) continue;
      throw Failure(fmt::format("{}: found files of {} to {} {}, wanted the same on all ranks",
                                path_, least, most, names[k]));
    }
  } catch (...) {
    if (file_ != MPI_FILE_NULL) MPI_File_close(&file_);
    throw;
  }
  begin_ = slice_begin(count_, rank_of(comm_), size_of(comm_));
  end_ = slice_begin(count_, rank_of(comm_) + 1, size_of(comm_));
}

BoxSlices::~BoxSlices() {
  if (file_ != MPI_FILE_NULL) MPI_File_close(&file_);
}

std::vector<Box> BoxSlices::read(std::uint64_t f) const {
  std::vector<Box> boxes;
  run_collectively(comm_, [&] {
    boxes.resize(end_ - begin_);
    read_at(file_, path_, offset_ + (f * count_ + begin_) * sizeof(Box), boxes.data(),
            boxes.size() * sizeof(Box));
  });
  return boxes;
}

void check_output(const scenes::NamedFile& output, const std::vector<scenes::NamedFile>& inputs,
                  MPI_Comm comm) {
  run_collectively(comm, [&] {
    if (rank_of(comm) == 0) scenes::check_outputs({output}, inputs);
  });
}

void write_pairs(const std::string& path, const std::vector<Pair64>& pairs, MPI_Comm comm) {
  // Rank 0 chooses the names.
  std::string target, temporary;
  run_collectively(comm, [&] {
    if (rank_of(comm) != 0) return;
    target = scenes::output_target(path);
    if (target.empty())
      scenes::throw_file_error(path, "a device or a pipe", "a file, which ranks write by parts");
    temporary = scenes::temporary_name(target);
  });
  int length = static_cast<int>(temporary.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, comm);
  temporary.resize(static_cast<std::size_t>(length));
  MPI_Bcast(temporary.data(), length, MPI_CHAR, 0, comm);
  const std::uint64_t total = sum_over_ranks(pairs.size(), comm);
  std::uint64_t mine = pairs.size(), before = 0;
  MPI_Exscan(&mine, &before, 1, MPI_UINT64_T, MPI_SUM, comm);
  if (rank_of(comm) == 0) before = 0;
  const std::string header = scenes::format_npy_header(scenes::native_descr('u', 8), {total, 2});
  // Rank 0 creates the file, empty; then each rank writes its part.
  const auto open = [&](int mode, MPI_File& file) {
    check(MPI_File_open(MPI_COMM_SELF, temporary.c_str(), mode, MPI_INFO_NULL, &file), path,
          "cannot be written");
  };
  const auto write = [&](MPI_File file, std::uint64_t at, const void* data, std::size_t bytes) {
    for (std::size_t done = 0; done < bytes;) {
      const std::size_t next = std::min(piece, bytes - done);
      const std::uint64_t place = at + done;
      MPI_Status status;
      check(MPI_File_write_at(file, static_cast<MPI_Offset>(place),
                              static_cast<const char*>(data) + done, static_cast<int>(next),
                              MPI_BYTE, &status),
            path, "cannot be written");
      int got = 0;
      MPI_Get_count(&status, MPI_BYTE, &got);
      if (static_cast<std::size_t>(got) != next) {
        throw Failure(fmt::format("{}: cannot be written: is the disk full?", path));
      }
      done += next;
    }
  };
  try {
    run_collectively(comm, [&] {
      if (rank_of(comm) != 0) return;
      MPI_File file;
      open(MPI_MODE_WRONLY | MPI_MODE_CREATE | MPI_MODE_EXCL, file);
      write(file, 0, header.data(), header.size());
      MPI_File_close(&file);
    });
    run_collectively(comm, [&] {
      if (pairs.empty()) return;
      MPI_File file;
      open(MPI_MODE_WRONLY, file);
      write(file, header.size() + before * sizeof(Pair64), pairs.data(),
            pairs.size() * sizeof(Pair64));
      check(MPI_File_close(&file), path, "cannot be written");
    });
    run_collectively(comm, [&] {
      if (rank_of(comm) == 0 && std::rename(temporary.c_str(), target.c_str()) != 0) {
        throw Failure(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
      }
    });
  } catch (...) {
    if (rank_of(comm) == 0) std::remove(temporary.c_str());
    throw;
  }
}

}  // namespace throng::mpi_app
