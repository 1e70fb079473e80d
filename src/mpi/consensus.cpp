#include "mpi/consensus.hpp"

#include <algorithm>
#include <bit>
#include <cfenv>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <type_traits>
#include <vector>

namespace throng::mpi {

using ull = unsigned long long;

void set_error(Result& r, Status status, const char* format, ...) noexcept {
  r.status = status;
  std::va_list args;
  va_start(args, format);
  std::vsnprintf(r.message, sizeof r.message, format, args);
  va_end(args);
}

void set_error(Result& r, const device::Failure& failure) noexcept {
  const char* text = failure.text ? failure.text : "";
  const ull number{failure.bytes};
  switch (failure.status) {
    case Status::no_device:
      if (failure.text)
        set_error(r, failure.status, "no GPU can be used: %s; use mpi::Finder", text);
      else
        set_error(r, failure.status,
                  "this build has no GPU backend; use mpi::Finder, or build with THRONG_CUDA=ON");
      break;
    case Status::out_of_memory:
      set_error(
          r, failure.status,
          "out of device memory: allocating %llu bytes failed%s%s; free some, or use more ranks",
          number, failure.text ? ": " : "", text);
      r.bytes_needed = number;
      break;
    case Status::device_error:
      set_error(
          r, failure.status,
          "the GPU failed: %s; create a new DeviceFinder, and if that fails, too, restart the "
          "process",
          text);
      break;
    default:
      set_error(r, failure.status, "%s %s; give aligned device memory of this rank's GPU",
                failure.what ? failure.what : "an array", text);
      break;
  }
}

ConsensusSettings consensus_settings(const Settings& s, std::uint64_t form) noexcept {
  return {std::bit_cast<std::uint32_t>(s.search.margin),
          std::bit_cast<std::uint64_t>(s.imbalance),
          static_cast<std::uint64_t>(s.search.nan),
          static_cast<std::uint64_t>(s.search.order),
          s.tree_send_threshold,
          form};
}

namespace {

// Broadcasts the message of the first failed rank, prefixed with its number.
void broadcast_failure(Communicator& communicator, Result& r) {
  const auto ranks = static_cast<std::uint64_t>(communicator.size());
  std::uint64_t first = r.ok() ? 0 : ranks - static_cast<std::uint64_t>(communicator.rank());
  communicator.all_reduce_max(&first, 1);
  const int root = static_cast<int>(ranks - first);
  static_assert(std::is_trivially_copyable_v<Result>);
  Result shared_result = r;
  shared_result.plan.reason = "";  // a pointer is meaningless on other ranks
  if (communicator.rank() == root) {
    char text[sizeof r.message];
    std::memcpy(text, r.message, sizeof text);
    std::snprintf(shared_result.message, sizeof shared_result.message, "rank %d: %.200s", root,
                  text);
  }
  communicator.broadcast(root, &shared_result, sizeof shared_result);
  shared_result.plan.reason = "";
  r = shared_result;
}

// Names the setting that differs and its range. A setting is equal on all ranks if the OR of the
// values and the OR of the inverted values have no common bit.
bool report_difference(Communicator& communicator, Result& r, const ConsensusSettings& mine,
                       const std::uint64_t* differ) {
  const char* names[] = {"margin",
                         "Settings::imbalance",
                         "NaN policy",
                         "order",
                         "Settings::tree_send_threshold",
                         "form of the call (one set or two, ids given or not)"};
  std::uint64_t words[6];
  std::memcpy(words, &mine, sizeof words);
  int k = 0;
  while (differ[k] == 0) ++k;
  std::uint64_t ends[2] = {words[k], ~words[k]};
  communicator.all_reduce_max(ends, 2);
  const std::uint64_t most = ends[0], least = ~ends[1];
  double high = static_cast<double>(most), low = static_cast<double>(least);
  if (k == 0) {
    high = static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(most)));
    low = static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(least)));
  } else if (k == 1) {
    high = std::bit_cast<double>(most);
    low = std::bit_cast<double>(least);
  }
  set_error(r, Status::ranks_disagree,
            "the ranks disagree on the %s: from %g to %g; give all ranks the same", names[k], low,
            high);
  return false;
}

}  // namespace

bool consensus(Communicator& communicator, Result& r, std::uint64_t* bits, int count) {
  std::vector<std::uint64_t> words(bits, bits + count);
  words.push_back(r.ok() ? 0 : 1);
  communicator.all_reduce_or(words.data(), count + 1);
  std::copy_n(words.begin(), count, bits);
  if (words.back() == 0) return true;
  broadcast_failure(communicator, r);
  return false;
}

bool consensus(Communicator& communicator, Result& r, const ConsensusSettings& settings,
               std::uint64_t* bits, int count) {
  constexpr int fields = sizeof(ConsensusSettings) / sizeof(std::uint64_t);
  std::uint64_t mine[fields];
  std::memcpy(mine, &settings, sizeof mine);
  std::vector<std::uint64_t> words(bits, bits + count);
  for (const std::uint64_t word : mine) {
    words.push_back(word);
    words.push_back(~word);
  }
  if (!consensus(communicator, r, words.data(), static_cast<int>(words.size()))) return false;
  std::copy_n(words.begin(), count, bits);
  std::uint64_t differ[fields];
  bool same = true;
  const std::uint64_t* pair = words.data() + count;
  for (int k = 0; k < fields; ++k, pair += 2) {
    differ[k] = pair[0] & pair[1];
    same = same && differ[k] == 0;
  }
  return same || report_difference(communicator, r, settings, differ);
}

bool valid(const Settings& s, Result& r) noexcept {
  if (!(s.search.margin >= 0) || !std::isfinite(s.search.margin)) {
    set_error(r, Status::bad_option, "the margin is %g; it must be finite and not negative",
              static_cast<double>(s.search.margin));
  } else if (!(s.imbalance >= 1)) {
    set_error(r, Status::bad_option, "Settings::imbalance is %g; it must be at least 1",
              s.imbalance);
  } else if (std::isnan(s.timeout_seconds)) {
    set_error(r, Status::bad_option,
              "Settings::timeout_seconds is not a number; give 0 to wait without limit");
  } else if (s.tree_send_threshold == 0) {
    set_error(r, Status::bad_option, "Settings::tree_send_threshold is 0; it must be at least 1");
  }
  return r.ok();
}

namespace {

template <class T>
bool valid(const Strided<T>& filter, std::size_t boxes, const char* name, Result& r) noexcept {
  if (!filter) return true;
  if (filter.count != boxes) {
    set_error(r, Status::bad_filter,
              "filter '%s' has %llu values for %llu boxes; give one value per box", name,
              ull{filter.count}, ull{boxes});
  } else if (filter.stride_bytes % alignof(T) != 0) {
    set_error(r, Status::bad_filter,
              "the stride of filter '%s' is %llu bytes; it must be a multiple of %llu", name,
              ull{filter.stride_bytes}, ull{alignof(T)});
  }
  return r.ok();
}

bool valid_filter_arrays(const Filters& f, std::size_t n, Result& r) noexcept {
  return valid(f.group, n, "group", r) && valid(f.mask, n, "mask", r) &&
         valid(f.owner, n, "owner", r) && valid(f.world, n, "world", r) &&
         valid(f.is_static, n, "static", r);
}

}  // namespace

bool no_bad_worlds(Result& r) noexcept {
  if (r.invalid_count != 0) {
    set_error(r, Status::bad_filter,
              "%llu boxes have a world below -1, the first is its box %llu; use -1 "
              "for every world, 0 and up for one",
              ull{r.invalid_count}, ull{r.first_invalid});
  }
  return r.ok();
}

bool no_nans(Result& r) noexcept {
  if (r.invalid_count != 0) {
    set_error(r, Status::nan_box,
              "%llu boxes have a NaN, the first is its box %llu; fix them, or treat "
              "them as inactive by Options::nan",
              ull{r.invalid_count}, ull{r.first_invalid});
  }
  return r.ok();
}

namespace {

bool valid_worlds(const Filters& f, std::size_t n, Result& r) noexcept {
  for (std::size_t i = 0; f.world && i < n; ++i) {
    if (f.world[i] < -1 && r.invalid_count++ == 0) r.first_invalid = i;
  }
  return no_bad_worlds(r);
}

}  // namespace

bool valid_filters(const Filters& f, std::size_t n, Result& r) noexcept {
  return valid_filter_arrays(f, n, r) && valid_worlds(f, n, r);
}

bool valid_arrays(const Boxes& boxes, Result& r) noexcept {
  const std::size_t n = boxes.size();
  if (n > max_box_count) {
    set_error(r, Status::too_many_boxes, "%llu boxes, at most %llu on a rank; use more ranks",
              ull{n}, ull{max_box_count});
  } else if (!boxes.complete()) {
    set_error(r, Status::bad_boxes,
              "a coordinate array is null; only both z arrays may be missing");
  } else if (boxes.stride_bytes() % alignof(float) != 0) {
    set_error(r, Status::bad_boxes,
              "the stride of the boxes is %llu bytes; it must be a multiple of 4",
              ull{boxes.stride_bytes()});
  }
  return r.ok() && valid_filter_arrays(boxes.filters, n, r);
}

bool valid(const Boxes& boxes, const Options& options, Result& r) noexcept {
  const std::size_t n = boxes.size();
  if (!valid_arrays(boxes, r) || !valid_worlds(boxes.filters, n, r)) return false;
  for (std::size_t i = 0; options.nan == NanPolicy::refuse && i < n; ++i) {
    for (int k = 0; k < 6; ++k) {
      if (!std::isnan(boxes.corner(i, k))) continue;
      if (r.invalid_count++ == 0) r.first_invalid = i;
      break;
    }
  }
  return no_nans(r);
}

DefaultFloats::DefaultFloats() noexcept {
  static_assert(sizeof(std::fenv_t) <= sizeof saved_ && alignof(std::fenv_t) <= 16);
  std::fegetenv(reinterpret_cast<std::fenv_t*>(saved_));
  std::fesetenv(FE_DFL_ENV);
}
DefaultFloats::~DefaultFloats() { std::fesetenv(reinterpret_cast<const std::fenv_t*>(saved_)); }

}  // namespace throng::mpi
