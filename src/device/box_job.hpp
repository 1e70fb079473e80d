// What Engine searches: boxes. Another job has the same members (device/mesh_job.hpp).
#pragma once

#include <cstddef>
#include <cstdint>

#include <throng/boxes.hpp>
#include <throng/options.hpp>

#include "device/input.hpp"
#include "device/pipeline.hpp"
#include "device/search_result.hpp"

namespace throng::device {

template <class Device>
class BoxJob {
 public:
  // b null: one set.
  BoxJob(const Boxes& a, const Boxes* b, const Options& options) noexcept
      : a_(a), b_(b), options_(options) {}

  std::uint64_t size() const noexcept { return std::uint64_t{a_.size()} + (b_ ? b_->size() : 0); }
  // Counts and filters; the arrays need not be on the device.
  Input shape() const noexcept { return make_input(a_, b_, options_); }
  // Device memory that prepare() needs.
  std::size_t bytes() const noexcept {
    return Device::boxes_bytes(a_) + (b_ ? Device::boxes_bytes(*b_) : 0);
  }
  // Returns the boxes in memory that the device reads.
  Input prepare(Device& device, char* to) const {
    const Boxes first = device.copy_boxes(a_, to);
    const Boxes second = b_ ? device.copy_boxes(*b_, to) : Boxes();
    return make_input(first, b_ ? &second : nullptr, options_);
  }
  // Where the report is, instead of in the workspace.
  static Report* report(Report* in_workspace) noexcept { return in_workspace; }
  static Report read(Device& device, const Report& report) { return device.read(report); }
  // After the boxes have been read: false, with a status, if they are refused.
  static bool accept(Device&, const Report& report, const Input& in, NanPolicy policy, Result& r,
                     bool& in_second_set) noexcept {
    return device::accept(report, in, policy, r, in_second_set);
  }
  // Around each search; what passes the check is a pair.
  static void begin_search(Device&) noexcept {}
  static AcceptAll check() noexcept { return {}; }
  static void end_search(Device&, const PairSink&) noexcept {}
  // The searches that follow repeat parts of the last one and are not counted.
  static void keep_counts() noexcept {}

 private:
  const Boxes& a_;
  const Boxes* b_;
  const Options& options_;
};

}  // namespace throng::device
