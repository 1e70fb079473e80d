// The GPU side, seen without CUDA: cuda.cu has it, cuda_absent.cpp stands in where there is no CUDA
// compiler.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <throng/update_boxes.hpp>

#include "paper/stepper.hpp"

namespace throng::paper {

// Empty where a GPU can be used; else why not, and what to do.
std::string why_no_cuda();
// The name of the GPU.
std::string cuda_device_name();
// As on the host. Failure where there is no GPU, or it fails.
std::unique_ptr<Stepper> make_cuda_stepper(const Job& job);
RootTime time_roots_on_cuda(RootKind kind, int steps, std::uint64_t count, int repeat);
MappingTime time_mapping_on_cuda(const Variant& variant, std::uint64_t n, int repeat);
// ms of the update of so many bodies' boxes, all in the GPU's memory: the median.
double time_bodies_on_cuda(const Transform* transforms, std::uint64_t count, const Shape& shape,
                           int repeat);

}  // namespace throng::paper
