// A Device whose memory the host cannot access, like a GPU's: host threads, but boxes are copied to
// it, pairs are fetched in pieces, and a memory resource counts all memory. Counts launches and
// synchronizations.
#pragma once

#include <algorithm>
#include <cstring>

#include "base/threads.hpp"
#include "device/host_device.hpp"

namespace throng::device {

class DiscreteDevice : public HostDevice {
 public:
  explicit DiscreteDevice(std::pmr::memory_resource* memory)
      : HostDevice(memory, HostDevice::Run{base::run_tasks}) {
    begin(base::default_executor(), 2);
  }
  ~DiscreteDevice() {
    release_host_copy();
    if (staging_) release(staging_, staging_bytes);
  }
  DiscreteDevice(const DiscreteDevice&) = delete;
  DiscreteDevice& operator=(const DiscreteDevice&) = delete;

  static constexpr bool reaches_host_memory = false;
  static constexpr std::size_t piece = 100;
  static constexpr std::size_t staging_bytes = piece * sizeof(Pair);

  static std::size_t scan_bytes(std::size_t count) { return 300 + count / 100; }
  static std::size_t scan_cells_bytes(std::size_t cells) { return cells / 256 * 8; }
  // A radix sort needs more than its keys.
  static std::size_t sort_bytes(std::size_t count) {
    return count == 0 ? 0 : HostDevice::sort_bytes(count) + 1000 + count / 64;
  }
  static std::size_t boxes_bytes(const Boxes& boxes) {
    return boxes.size() * (sizeof(Box) + (boxes.filters.world ? sizeof(std::int32_t) : 0));
  }
  Boxes copy_boxes(const Boxes& boxes, char*& to) {
    auto* there = reinterpret_cast<Box*>(to);
    for (std::size_t i = 0; i < boxes.size(); ++i) there[i] = boxes[i];
    Boxes view(there, boxes.size());
    to += boxes.size() * sizeof(Box);
    if (!boxes.filters.world) return view;
    auto* worlds = reinterpret_cast<std::int32_t*>(to);
    for (std::size_t i = 0; i < boxes.size(); ++i) worlds[i] = boxes.filters.world[i];
    view.filters.world = {worlds, boxes.size()};
    to += boxes.size() * sizeof(std::int32_t);
    return view;
  }
  // Packed vertices and triangles; no filters but worlds.
  static std::size_t mesh_bytes(const TriangleMesh& mesh) {
    return aligned(mesh.vertices.size() * vertex_bytes(mesh)) +
           aligned(mesh.size() * sizeof(Triangle)) +
           (mesh.filters.world ? aligned(mesh.size() * sizeof(std::int32_t)) : 0);
  }
  TriangleMesh copy_mesh(const TriangleMesh& mesh, char*& to) {
    const std::size_t vertices = mesh.vertices.size(), n = mesh.size(), bytes = vertex_bytes(mesh);
    char* const points = to;
    for (std::size_t i = 0; i < vertices; ++i) {
      std::memcpy(points + i * bytes,
                  static_cast<const char*>(mesh.vertices.data()) + i * mesh.vertices.stride_bytes(),
                  bytes);
    }
    to += aligned(vertices * bytes);
    auto* const triangles = reinterpret_cast<Triangle*>(to);
    for (std::size_t i = 0; i < n; ++i) triangles[i] = mesh.triangles[i];
    to += aligned(n * sizeof(Triangle));
    const Vertices there = mesh.vertices.is_float()
                               ? Vertices(reinterpret_cast<const Vec3*>(points), vertices)
                               : Vertices(reinterpret_cast<const DoubleVec3*>(points), vertices);
    TriangleMesh view(there, triangles, n);
    view.transform = mesh.transform;
    if (!mesh.filters.world) return view;
    auto* const worlds = reinterpret_cast<std::int32_t*>(to);
    for (std::size_t i = 0; i < n; ++i) worlds[i] = mesh.filters.world[i];
    view.filters.world = {worlds, n};
    to += aligned(n * sizeof(std::int32_t));
    return view;
  }
  std::size_t held() const { return (staging_ ? staging_bytes : 0) + copy_bytes_; }
  void release_host_copy() {
    if (copy_) release(copy_, copy_bytes_);
    copy_ = nullptr;
    copy_bytes_ = 0;
  }
  template <class T, class F>
  bool in_pieces(const T* values, std::size_t count, const F& take) {
    if (!staging_) staging_ = allocate(staging_bytes);
    T* here = static_cast<T*>(staging_);
    for (std::size_t begin = 0; begin < count; begin += piece) {
      const std::size_t size = std::min(piece, count - begin);
      std::copy_n(values + begin, size, here);
      if (!take(here, size)) return false;
    }
    return true;
  }

  std::size_t launches = 0, syncs = 0;  // a sort counts as one

  template <class F>
  void launch(std::uint64_t count, const F& f) {
    launches += count != 0;
    HostDevice::launch(count, f);
  }
  void clear(void* p, std::size_t bytes) {
    ++launches;
    HostDevice::clear(p, bytes);
  }
  template <class... Args>
  void scan_cells(const Args&... args) {
    ++launches;
    HostDevice::scan_cells(args...);
  }
  void scan(std::uint32_t* values, std::size_t count) {
    ++launches;
    HostDevice::scan(values, count);
  }
  template <class Search, class Check = AcceptAll>
  void search(std::uint64_t bound, const Search& search, const PairSink& sink,
              const Check& check = {}) {
    ++launches;
    HostDevice::search(bound, search, sink, check);
  }
  template <class Test, class Tiles>
  void gather(std::uint64_t bound, const Test& test, const Tiles& to) {
    launches += bound != 0;
    HostDevice::gather(bound, test, to);
  }
  template <class... Args>
  void sort(Pair* pairs, void* scratch, std::size_t bytes, Pair* out, std::uint64_t capacity,
            std::uint64_t count, const Args&... args) {
    launches += count != 0;
    HostDevice::sort(pairs, scratch, bytes, out, capacity, count, args...);
  }
  template <class T>
  T take(T& value, std::size_t bytes = sizeof(T)) {
    ++launches, ++syncs;
    return HostDevice::take(value, bytes);
  }
  template <class F, class T>
  T launch_and_read(std::uint64_t count, const F& f, T& value, std::uint32_t* tickets) {
    ++launches, ++syncs;
    return HostDevice::launch_and_read(count, f, value, tickets);
  }
  template <class T>
  T read(const T& value) {
    ++launches, ++syncs;
    return HostDevice::read(value);
  }
  template <class T>
  void read(const T* from, T* to, std::size_t count) {
    in_pieces(from, count, [&](const T* values, std::size_t n) {
      to = std::copy_n(values, n, to);
      return true;
    });
  }
  template <class T>
  const T* host_copy(const T* values, std::size_t count) {
    if (count * sizeof(T) > copy_bytes_) {
      release_host_copy();
      copy_ = allocate(count * sizeof(T));
      copy_bytes_ = count * sizeof(T);
    }
    return std::copy_n(values, count, static_cast<T*>(copy_)) - count;
  }

 private:
  static std::size_t aligned(std::size_t bytes) { return (bytes + 255) / 256 * 256; }
  static std::size_t vertex_bytes(const TriangleMesh& mesh) {
    return mesh.vertices.is_float() ? sizeof(Vec3) : sizeof(DoubleVec3);
  }

  void* staging_ = nullptr;
  void* copy_ = nullptr;
  std::size_t copy_bytes_ = 0;
};

}  // namespace throng::device
