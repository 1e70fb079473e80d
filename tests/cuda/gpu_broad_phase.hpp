// A throng::cuda::BroadPhase with the interface of throng::BroadPhase: arguments and results are
// copied through device memory.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include <throng/cuda_broad_phase.hpp>

#include "broad_phase/actor.hpp"
#include "cuda/gpu_fixture.hpp"

namespace throng::tests {

// A copy of a host view in device memory.
class Upload {
 public:
  explicit Upload(const Boxes& from) {
    const std::size_t n = from.size();
    for (std::size_t i = 0; i < n; ++i) list_.push_back(from[i]);
    boxes_ = std::make_unique<OnDevice<Box>>(list_);
    view_ = Boxes(boxes_->data(), n);
    copy(from.filters, n);
  }
  Upload(const Filters& from, std::size_t n) { copy(from, n); }
  const Boxes& view() const { return view_; }
  const Filters& filters() const { return view_.filters; }

 private:
  template <class T>
  void copy(const Strided<T>& from, std::unique_ptr<OnDevice<T>>& to, Strided<T>& shown,
            std::size_t n) {
    if (!from) return;
    std::vector<T> values;
    for (std::size_t i = 0; i < n; ++i) values.push_back(from[i]);
    to = std::make_unique<OnDevice<T>>(values);
    shown = {to->data(), n};
  }
  void copy(const Filters& from, std::size_t n) {
    copy(from.group, group_, view_.filters.group, n);
    copy(from.mask, mask_, view_.filters.mask, n);
    copy(from.owner, owner_, view_.filters.owner, n);
    copy(from.world, world_, view_.filters.world, n);
    copy(from.is_static, static_, view_.filters.is_static, n);
  }
  std::vector<Box> list_;
  Boxes view_;
  std::unique_ptr<OnDevice<Box>> boxes_;
  std::unique_ptr<OnDevice<std::uint32_t>> group_, mask_;
  std::unique_ptr<OnDevice<std::int32_t>> owner_, world_;
  std::unique_ptr<OnDevice<std::uint8_t>> static_;
};

// The interface of throng::BroadPhase, executed on the GPU.
class GpuBroadPhase {
 public:
  GpuBroadPhase(const Options& options, float fat_margin, const cuda::MemoryResource& memory = {})
      : scene_(fat_margin, options, memory) {}

  cuda::BroadPhase& scene() { return scene_; }
  void combine_with_update(bool at_once) { combined_ = at_once; }

  Result add(const Boxes& boxes, ObjectId* ids) {
    const Upload there(boxes);
    const OnDevice<ObjectId> given(boxes.size());
    const Result r = scene_.add(there.view(), given.data(), stream_);
    const std::vector<ObjectId> list = given.get();
    if (r.ok() && ids) std::copy(list.begin(), list.end(), ids);
    return r;
  }
  Result remove(const ObjectId* ids, std::size_t n) {
    return scene_.remove(list(ids, n).data(), n, stream_);
  }
  Result move(const ObjectId* ids, const Boxes& boxes) {
    const Upload there(boxes);
    return scene_.move(list(ids, boxes.size()).data(), there.view(), stream_);
  }
  Result move_all(const Boxes& boxes) {
    all_ = std::make_unique<Upload>(boxes);
    if (combined_) return {};
    const Result r = scene_.move_all(all_->view(), stream_);
    all_.reset();
    return r;
  }
  Result set_filters(const ObjectId* ids, std::size_t n, const Filters& filters) {
    const Upload there(filters, n);
    return scene_.set_filters(list(ids, n).data(), n, there.filters(), stream_);
  }
  Result update() {
    const Result r = all_ ? scene_.update(all_->view(), stream_) : scene_.update(stream_);
    if (r.status != Status::out_of_memory) all_.reset();
    fetch(scene_.begun(), begun_);
    fetch(scene_.ended(), ended_);
    return r;
  }
  LivePairs begun() const { return {begun_.data(), begun_.size()}; }
  LivePairs ended() const { return {ended_.data(), ended_.size()}; }
  LivePairs pairs() {
    LivePairs there;
    const Result r = scene_.pairs(there, stream_);
    EXPECT_TRUE(r.ok()) << r.message;
    fetch(there, pairs_);
    return {pairs_.data(), pairs_.size()};
  }
  // A SweepTest callback cannot run on a device.
  Result find_overlaps(const Boxes& boxes) {
    const Upload there(boxes);
    const Result r = scene_.find_overlaps(there.view(), stream_);
    fetch(scene_.overlaps(), overlaps_);
    return r;
  }
  Result find_hits(const Sweep* sweeps, std::size_t n, SweepHits which, const Filters& filters,
                   const SweepTest& = {}) {
    const OnDevice<Sweep> there(std::vector<Sweep>(sweeps, sweeps + n));
    const Upload given(filters, n);
    const Result r = scene_.find_hits(there.data(), n, which, given.filters(), stream_);
    fetch(scene_.hits(), hits_);
    return r;
  }
  Result find_first_hits(const Sweep* sweeps, std::size_t n, const Filters& filters,
                         SweepHit* out) {
    const OnDevice<Sweep> there(std::vector<Sweep>(sweeps, sweeps + n));
    const Upload given(filters, n);
    const OnDevice<SweepHit> hits(n);
    const Result r = scene_.find_first_hits(there.data(), n, given.filters(), hits.data(), stream_);
    const std::vector<SweepHit> list = hits.get();
    std::copy(list.begin(), list.end(), out);
    return r;
  }
  Pairs overlaps() const { return {overlaps_.data(), overlaps_.size()}; }
  SweepHitList hits() const { return {hits_.data(), hits_.size()}; }
  std::uint64_t object_count() const { return scene_.object_count(); }
  std::uint64_t id_limit() const { return scene_.id_limit(); }
  std::uint64_t pair_count() const { return scene_.pair_count(); }
  std::uint64_t slot_limit() const { return scene_.slot_limit(); }

 private:
  OnDevice<ObjectId> list(const ObjectId* ids, std::size_t n) const {
    return OnDevice<ObjectId>(std::vector<ObjectId>(ids, ids + n));
  }
  template <class List, class T>
  void fetch(const List& list, std::vector<T>& here) const {
    stream_.wait();
    here.resize(list.size());
    if (!here.empty())
      check_cuda(
          cudaMemcpy(here.data(), list.data(), here.size() * sizeof(T), cudaMemcpyDeviceToHost));
  }

  Stream stream_;
  cuda::BroadPhase scene_;
  std::unique_ptr<Upload> all_;
  std::vector<LivePair> begun_, ended_, pairs_;
  std::vector<Pair> overlaps_;
  std::vector<SweepHit> hits_;
  bool combined_ = false;
};

}  // namespace throng::tests
