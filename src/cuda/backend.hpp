// The GPU backend as the hall sees it: no CUDA header, so that every compiler takes it.
#pragma once

#include <cstddef>

#include <throng/cuda.hpp>
#include <throng/finder.hpp>
#include <throng/options.hpp>

#include "core/output.hpp"
#include "core/update_boxes.hpp"

namespace throng::cuda {

// All throw pipeline::Failure. The arguments are valid but for what only the device can tell.
class Engine {
 public:
  virtual ~Engine() = default;

  // Boxes and pairs in host memory. `already_held`: bytes that count towards a memory cap.
  virtual void find(const Boxes& a, const Boxes* b, const Options&, std::size_t already_held,
                    core::Output*, const Consumer*, Result&) = 0;
  virtual bool nan_in_second_set() const noexcept = 0;

  // Boxes and pairs in device memory.
  virtual void reserve(std::size_t boxes, std::size_t pairs, Stream) = 0;
  virtual void find_on_device(const Boxes& a, const Boxes* b, const Options&, Pair* out,
                              std::size_t capacity, Stream, Result&) = 0;
  // Into memory of its own, which grows.
  virtual Pairs find_growing(const Boxes& a, const Boxes* b, const Options&, Stream, Result&) = 0;
  virtual void find_async(const Boxes& a, const Boxes* b, const Options&, Pair* out,
                          std::size_t capacity, Report* report, Stream) = 0;

  virtual std::size_t held() const noexcept = 0;
};

// Whether this build has the backend at all.
bool is_built() noexcept;
// The device that is current. Failure: no_device, with what CUDA says; out_of_memory.
Engine* create(const MemoryResource&);
void check_available();

// `report` may be null.
void update_boxes_async(const core::UpdateBoxes& job, std::size_t count, BodyReport* report,
                        Stream);
// Waits; what stands in *report then.
BodyReport update_boxes(const core::UpdateBoxes& job, std::size_t count, BodyReport* report,
                        Stream);

}  // namespace throng::cuda
