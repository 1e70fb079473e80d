// The Finder of Python.
#pragma once

#include <functional>
#include <memory>

#include <nanobind/nanobind.h>

#include <throng/explain.hpp>
#include <throng/finder.hpp>

#include "python/arrays.hpp"
#include "python/device.hpp"
#include "python/pair_search.hpp"

namespace throng::python {

class FinderObject {
 public:
  // `once`: only the result is kept.
  FinderObject(const Options& options, Rounding rounding, bool once);

  // (m, 2) uint32. `b` may be null; both have one type. GPU results stay there, or are copied
  // `to_host`.
  nb::object find(const BoxArray& a, const BoxArray* b, const ArrayDevice& array_device,
                  bool to_host);
  void consume(const BoxArray& a, const BoxArray* b, nb::handle callback);
  // Of float32 alone.
  Explanation explain(const BoxArray& a, const BoxArray* b);

  Rounding rounding() const noexcept { return rounding_; }
  const Result& result() const noexcept { return search_.result(); }
  std::size_t memory_bytes() const;

 private:
  nb::object find_on_gpu(const BoxArray& a, const BoxArray* b, const ArrayDevice& array_device,
                         bool to_host);

  Finder finder_;
  Rounding rounding_;
  std::unique_ptr<DeviceFinder> on_gpu_;
  PairSearch search_;
};

}  // namespace throng::python
