// Parallel .npy files by MPI-IO: each rank reads its slice of the boxes, and writes its pairs.
#pragma once

#include <mpi.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <throng/mpi.hpp>

#include "apps/scenes/output_file.hpp"

namespace throng::mpi_app {

// The index of the first of n items of rank `rank` of `size`; rank + 1 gives the end.
std::uint64_t slice_begin(std::uint64_t n, int rank, int size) noexcept;

// A file of float32 in native byte order and C order, of shape (n, 6) or (frames, n, 6).
class BoxSlices {
 public:
  // Collective. Throws Failure on every rank if one cannot open the file, or sees a different one.
  BoxSlices(const std::string& path, MPI_Comm comm);
  ~BoxSlices();
  BoxSlices(const BoxSlices&) = delete;
  BoxSlices& operator=(const BoxSlices&) = delete;

  std::uint64_t count() const noexcept { return count_; }
  std::uint64_t frames() const noexcept { return frames_; }
  std::uint64_t begin() const noexcept { return begin_; }
  // Collective. Returns this rank's boxes of frame f.
  std::vector<Box> read(std::uint64_t f) const;

 private:
  void open();

  std::string path_;
  MPI_Comm comm_;
  MPI_File file_ = MPI_FILE_NULL;
  std::uint64_t count_ = 0, frames_ = 1, begin_ = 0, end_ = 0, offset_ = 0, file_bytes_ = 0;
};

// This rank's slice of a file with one integer per box. Each rank reads the whole file, at most a
// sixth of the size of the boxes.
template <class T>
std::vector<T> slice(std::vector<T> all, int rank, int size) {
  const auto at = [&](int r) {
    return all.begin() + static_cast<std::ptrdiff_t>(slice_begin(all.size(), r, size));
  };
  return std::vector<T>(at(rank), at(rank + 1));
}

// Collective. Rank 0 runs scenes::check_outputs.
void check_output(const scenes::NamedFile& output, const std::vector<scenes::NamedFile>& inputs,
                  MPI_Comm comm);
// Collective. Writes uint64 of shape (pairs, 2), ordered by rank. The file gets its name when it is
// complete.
void write_pairs(const std::string& path, const std::vector<Pair64>& pairs, MPI_Comm comm);

}  // namespace throng::mpi_app
