// Stub of the backend for builds without a CUDA compiler.
#include "cuda/backend.hpp"
#include "device/failure.hpp"

namespace throng::cuda {

bool is_built() noexcept { return false; }

void check_available() { throw device::Failure{Status::no_device}; }

Engine* create(const MemoryResource&) { throw device::Failure{Status::no_device}; }

MeshEngine* create_mesh_engine(const MemoryResource&) { throw device::Failure{Status::no_device}; }

Scene* create_scene(float, const Options&, const MemoryResource&) {
  throw device::Failure{Status::no_device};
}

void update_boxes_async(const base::UpdateBoxes&, std::size_t, BodyReport*, Stream) {
  throw device::Failure{Status::no_device};
}

BodyReport update_boxes(const base::UpdateBoxes&, std::size_t, BodyReport*, Stream) {
  throw device::Failure{Status::no_device};
}

}  // namespace throng::cuda
