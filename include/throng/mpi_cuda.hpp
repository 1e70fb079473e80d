// DeviceFinder: the search across MPI ranks for boxes in GPU memory. Each rank has one GPU; boxes,
// filters, ids and pairs lie in its memory. Requirements are those of throng/mpi.hpp; standard C++
// only. A build without the GPU backend returns Status::no_device on all ranks.
//
// Copies of boxes are sent to other ranks from device memory if MPI supports it, else through host
// memory; see Buffers.
#pragma once

#include <throng/cpp17.hpp>

#include <memory>

#include <throng/cuda.hpp>
#include <throng/mpi.hpp>

namespace throng::mpi {

// As Finder, with these differences:
// - All arrays of RankBoxes lie in the memory of the GPU that is current at the first call. One
//   stream is used at a time. The host reads only a sample of the boxes, the boxes forwarded along
//   the tree, and ids not seen before.
// - Settings::search.backend is automatic, cuda or emulated; cpu is an error. With emulated, for
//   tests and debugging, device memory is host memory, the stream is ignored, and one thread
//   executes the GPU steps around the search. Memory comes from `memory`, with emulated from
//   Settings::search.memory.
// - Settings::parts is ignored; Settings::buffers applies.
// - On a GPU the order in which boxes are sent is not deterministic. The pairs do not depend on it;
//   the counted work, and so the partition, may differ slightly from run to run.
//
// Device memory: 37 bytes per box searched and 32 per copy sent, each plus 4 per filter that some
// rank gives; the memory of cuda::Finder; 16 bytes per pair found, and with Order::canonical about
// as much again for sorting.
class DeviceFinder {
 public:
  explicit DeviceFinder(MPI_Comm comm, const Settings& settings = {},
                        const cuda::MemoryResource& memory = {}) noexcept;
  ~DeviceFinder();
  DeviceFinder(DeviceFinder&& other) noexcept;
  DeviceFinder& operator=(DeviceFinder&& other) noexcept;
  DeviceFinder(const DeviceFinder&) = delete;
  DeviceFinder& operator=(const DeviceFinder&) = delete;

  // Collective. Synchronizes with the stream; earlier work on the stream may still write the boxes.
  // Cost: that of cuda::Finder for the boxes that overlap a rank's region.
  Result find(const RankBoxes& boxes, cuda::Stream stream) noexcept;
  Result find(const RankBoxes& a, const RankBoxes& b, cuda::Stream stream) noexcept;
  // The pairs that this rank reports, in device memory; sorted with Order::canonical.
  Pairs64 pairs() const noexcept;

  const Traffic& traffic() const noexcept;
  // The rank whose region contains the box's lower corner. The box is a host value.
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
