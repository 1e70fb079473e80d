// The GPU side, without CUDA headers: implemented in cuda.cu, or in cuda_absent.cpp without a CUDA
// compiler.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <throng/update_boxes.hpp>

#include "apps/paper/stepper.hpp"

namespace throng::paper {

// Empty if a GPU can be used; else the reason and the fix.
std::string why_no_cuda();
// The name of the GPU.
std::string cuda_device_name();
// As on the host. Throws Failure where there is no GPU, or it fails.
std::unique_ptr<Stepper> make_cuda_stepper(const Job& job);
RootTime time_roots_on_cuda(RootKind kind, int steps, std::uint64_t count, int repeat);
MappingTime time_mapping_on_cuda(const Variant& variant, std::uint64_t n, int repeat);
// Median time in ms of the box update for this many bodies, all in GPU memory.
double time_bodies_on_cuda(const Transform* transforms, std::uint64_t count, const Shape& shape,
                           int repeat);

}  // namespace throng::paper
