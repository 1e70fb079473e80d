// Stub of the backend for builds without a CUDA compiler.
#include "cuda/backend.hpp"
#include "pipeline/failure.hpp"

namespace throng::cuda {

bool is_built() noexcept { return false; }

void check_available() { throw pipeline::Failure{Status::no_device}; }

Engine* create(const MemoryResource&) { throw pipeline::Failure{Status::no_device}; }

Scene* create_scene(float, const Options&, const MemoryResource&) {
  throw pipeline::Failure{Status::no_device};
}

void update_boxes_async(const core::UpdateBoxes&, std::size_t, BodyReport*, Stream) {
  throw pipeline::Failure{Status::no_device};
}

BodyReport update_boxes(const core::UpdateBoxes&, std::size_t, BodyReport*, Stream) {
  throw pipeline::Failure{Status::no_device};
}

}  // namespace throng::cuda
