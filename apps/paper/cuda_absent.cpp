#include "apps/paper/cuda.hpp"
#include "apps/paper/failure.hpp"

namespace throng::paper {

std::string why_no_cuda() {
  return "this build has no CUDA: no CUDA compiler was found, or THRONG_CUDA is OFF; put nvcc on "
         "PATH "
         "and build again, or use --device cpu";
}

std::string cuda_device_name() { return {}; }

std::unique_ptr<Stepper> make_cuda_stepper(const Job&) { throw Failure(why_no_cuda()); }

RootTime time_roots_on_cuda(RootKind, int, std::uint64_t, int) { throw Failure(why_no_cuda()); }

MappingTime time_mapping_on_cuda(const Variant&, std::uint64_t, int) {
  throw Failure(why_no_cuda());
}

double time_bodies_on_cuda(const Transform*, std::uint64_t, const Shape&, int) {
  throw Failure(why_no_cuda());
}

}  // namespace throng::paper
