// Replaces device.cpp in builds without a GPU backend. GPU arrays are refused before.
#include "python/device.hpp"
#include "python/errors.hpp"

namespace throng::python {

struct DeviceFinder::State {};

bool gpu_is_built() noexcept { return false; }
DeviceFinder::DeviceFinder(const Options&, int device) : device_(device) {}
DeviceFinder::~DeviceFinder() = default;
std::size_t DeviceFinder::memory_bytes() const noexcept { return 0; }
nb::object DeviceFinder::find(const BoxArray&, const BoxArray*, std::uintptr_t, bool, Result&) {
  value_error("this build searches on the CPU alone; build with THRONG_CUDA=ON");
}

Result DeviceFinder::check(const BoxArray&, const BoxArray*) const { return {}; }

}  // namespace throng::python
