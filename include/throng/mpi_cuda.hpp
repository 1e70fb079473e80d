// The search across MPI ranks for boxes in GPU memory: each rank has a GPU, boxes, filters and ids
// lie there, pairs come out there. Needs what throng/mpi.hpp needs; standard C++ only. A build
// without the GPU backend answers Status::no_device, on all ranks.
//
// What goes to other ranks, copies of the boxes that reach their regions, is read and written by
// MPI where it lies if this MPI takes device memory; else it is staged through host memory. See
// Buffers.
#pragma once

#include <throng/cpp17.hpp>

#include <memory>

#include <throng/cuda.hpp>
#include <throng/mpi.hpp>

namespace throng::mpi {

// As Finder; what differs:
// - All arrays of RankBoxes lie in the memory of the GPU that is current at the first call, of
//   which one stream is used at a time. Nothing of them is read on the host but a sample of the
//   boxes, those that are handed on along the tree, and ids that were not seen before.
// - Settings::search.backend: automatic or cuda; or emulated, and then "device memory" is host
//   memory, the stream is not looked at, and one thread does what the GPU's threads would do
//   around the search: for tests, and for finding faults. cpu is an error. Memory comes from
//   `memory`, where emulated from Settings::search.memory.
// - Settings::parts is not heeded, Settings::buffers is.
// - On a GPU it is chance in what order boxes are sent. The pairs are the same for any; what is
//   counted, and with it where space is cut, may differ a little from run to run.
//
// Device memory: 37 bytes for each box that this rank searches and 32 for each copy that it sends,
// both four more for each filter that some rank gives; what cuda::Finder takes; 16 bytes a pair
// that it finds, and under canonical order the sort's, about as many again.
class DeviceFinder {
 public:
  explicit DeviceFinder(MPI_Comm comm, const Settings& settings = {},
                        const cuda::MemoryResource& memory = {}) noexcept;
  ~DeviceFinder();
  DeviceFinder(DeviceFinder&& other) noexcept;
  DeviceFinder& operator=(DeviceFinder&& other) noexcept;
  DeviceFinder(const DeviceFinder&) = delete;
  DeviceFinder& operator=(const DeviceFinder&) = delete;

  // Collective; waits for the stream, whose work before it may still write the boxes.
  // Cost: as cuda::Finder's of the boxes that reach a rank's region.
  Result find(const RankBoxes& boxes, cuda::Stream stream) noexcept;
  Result find(const RankBoxes& a, const RankBoxes& b, cuda::Stream stream) noexcept;
  // In device memory; those that this rank tells, with Order::canonical sorted.
  Pairs64 pairs() const noexcept;

  const Traffic& traffic() const noexcept;
  // The rank in whose region a box's lower corner lies; the box is given by value, from host
  // memory.
  int home(const Box& box) const noexcept;

 private:
  struct State;
  Result find(const RankBoxes* const* sets, int count, cuda::Stream stream) noexcept;

  Settings settings_;
  cuda::MemoryResource memory_;
  MPI_Comm comm_;
  std::unique_ptr<State> state_;
};

}  // namespace throng::mpi
