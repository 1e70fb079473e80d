// The boxes that a rank searches: its own, and ghosts that overlap its region.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <throng/boxes.hpp>

#include "mpi/communicator.hpp"
#include "mpi/record.hpp"

namespace throng::mpi {

class LocalSet {
 public:
  explicit LocalSet(unsigned filters = 0) : filters_(filters) {}

  std::size_t size() const noexcept { return boxes_.size(); }
  std::size_t record_bytes() const noexcept { return mpi::record_bytes(filters_); }
  const Box& box(std::size_t i) const noexcept { return boxes_[i]; }
  std::uint64_t id(std::size_t i) const noexcept { return ids_[i]; }
  unsigned filters() const noexcept { return filters_; }

  // Appends box i of the caller's set to `out` as a record.
  void write(const Boxes& boxes, std::size_t i, std::uint64_t id, Bytes& out) const {
    const Filters& f = boxes.filters;
    const std::size_t at = out.size();
    out.resize(at + record_bytes());
    std::byte* p = out.data() + at;
    put(p, boxes[i]);
    put(p, id);
    if (filters_ & has_group) put(p, f.group ? f.group[i] : 0xffffffffu);
    if (filters_ & has_mask) put(p, f.mask ? f.mask[i] : 0xffffffffu);
    if (filters_ & has_owner) put(p, f.owner ? f.owner[i] : std::int32_t{-1});
    if (filters_ & has_world) put(p, f.world ? f.world[i] : std::int32_t{-1});
    if (filters_ & has_static) put(p, static_word(f.is_static && f.is_static[i]));
  }
  static Box box_of(const std::byte* record) noexcept {
    Box box;
    std::memcpy(&box, record, sizeof box);
    return box;
  }

  // Appends the box of a record.
  void read(const std::byte* p) {
    boxes_.push_back(take<Box>(p));
    ids_.push_back(take<std::uint64_t>(p));
    if (filters_ & has_group) group_.push_back(take<std::uint32_t>(p));
    if (filters_ & has_mask) mask_.push_back(take<std::uint32_t>(p));
    if (filters_ & has_owner) owner_.push_back(take<std::int32_t>(p));
    if (filters_ & has_world) world_.push_back(take<std::int32_t>(p));
    if (filters_ & has_static) static_.push_back(static_cast<std::uint8_t>(take<std::uint32_t>(p)));
  }

  void read_all(const Bytes& records) {
    for (std::size_t at = 0; at < records.size(); at += record_bytes()) read(records.data() + at);
  }

  // Replaces the content by a subset of `other`. Keeps its memory.
  void gather(const LocalSet& other, const std::uint32_t* boxes, std::size_t count) {
    filters_ = other.filters_;
    const auto copy = [&](auto& to, const auto& from) {
      to.resize(from.empty() ? 0 : count);
      for (std::size_t i = 0; i < to.size(); ++i) to[i] = from[boxes[i]];
    };
    copy(boxes_, other.boxes_);
    copy(ids_, other.ids_);
    copy(group_, other.group_);
    copy(mask_, other.mask_);
    copy(owner_, other.owner_);
    copy(world_, other.world_);
    copy(static_, other.static_);
  }

  Boxes view() const {
    Boxes view(boxes_.data(), boxes_.size());
    const std::size_t n = size();
    if (filters_ & has_group) view.filters.group = {group_.data(), n};
    if (filters_ & has_mask) view.filters.mask = {mask_.data(), n};
    if (filters_ & has_owner) view.filters.owner = {owner_.data(), n};
    if (filters_ & has_world) view.filters.world = {world_.data(), n};
    if (filters_ & has_static) view.filters.is_static = {static_.data(), n};
    return view;
  }

 private:
  template <class T>
  static void put(std::byte*& p, const T& value) noexcept {
    std::memcpy(p, &value, sizeof value);
    p += sizeof value;
  }
  template <class T>
  static T take(const std::byte*& p) noexcept {
    T value;
    std::memcpy(&value, p, sizeof value);
    p += sizeof value;
    return value;
  }

  unsigned filters_;
  std::vector<Box> boxes_;
  std::vector<std::uint64_t> ids_;
  std::vector<std::uint32_t> group_, mask_;
  std::vector<std::int32_t> owner_, world_;
  std::vector<std::uint8_t> static_;
};

}  // namespace throng::mpi
