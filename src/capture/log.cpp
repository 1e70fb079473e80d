#include "capture/log.hpp"

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>

#include <throng/version.hpp>

#include "capture/create_file.hpp"

namespace throng::capture {
namespace {

// A setuid program must not write where its caller's environment says. So the variable is used only
// where setuid is excluded: via secure_getenv, and on Windows. Elsewhere only the option counts.
const char* variable() noexcept {
#if defined(__GLIBC__) && defined(_GNU_SOURCE)
  return secure_getenv("THRONG_CAPTURE");
#elif defined(_WIN32)
  return std::getenv("THRONG_CAPTURE");
#else
  return nullptr;
#endif
}

// Read once: searching the environment takes a tenth of a call with few boxes. A longer path is
// truncated here and refused by open().
struct Folder {
  char path[1024] = {};
  Folder() noexcept {
    if (const char* name = variable()) std::strncpy(path, name, sizeof path - 1);
  }
};

}  // namespace

const char* folder_of(const Options& options) noexcept {
  if (options.capture) return options.capture;
  static const Folder from_environment;
  return from_environment.path[0] ? from_environment.path : nullptr;
}

void Log::open(const char* folder, const Options& options) noexcept {
  using namespace std::chrono;
  const auto now = duration_cast<microseconds>(system_clock::now().time_since_epoch()).count();
  // Exclusive creation: never overwrites an existing file or follows a link. If another process or
  // thread was faster, the next number is tried.
  for (unsigned attempt = 0; !file_; ++attempt) {
    const int length = std::snprintf(name_, sizeof name_, "%s/throng-%016llx-%03u.capture", folder,
                                     static_cast<unsigned long long>(now), attempt);
    if (length < 0 || static_cast<std::size_t>(length) >= sizeof name_) return fail(ENAMETOOLONG);
    errno = 0;
    file_ = create_file(name_);
    if (file_) break;
    const int error = errno;
    name_[0] = 0;  // not our file, must not be removed
    if (error != EEXIST || attempt == 999) return fail(error);
  }
  sum_ = fold_start;
  put(magic, sizeof magic);
  put32(format_version);
  put32(0);
  put_options(options);
}

void Log::put_options(const Options& o) noexcept {
  OptionsFields f{};
  f.algorithm = static_cast<std::uint32_t>(o.algorithm);
  f.order = static_cast<std::uint32_t>(o.order);
  f.backend = static_cast<std::uint32_t>(o.backend);
  f.nan = static_cast<std::uint32_t>(o.nan);
  f.isa = static_cast<std::uint32_t>(o.isa);
  std::memcpy(&f.margin, &o.margin, sizeof o.margin);
  std::memcpy(&f.cell_scale, &o.cell_scale, sizeof o.cell_scale);
  f.threads = o.threads;
  f.concurrent_consumer = o.concurrent_consumer;
  f.measure_stages = o.measure_stages;
  f.executor = o.executor ? o.executor->concurrency : 0;
  f.memory = o.memory != nullptr;
  f.stop = o.stop != nullptr;
  const std::uint64_t cap = o.memory_cap_bytes;
  f.cap_low = static_cast<std::uint32_t>(cap);
  f.cap_high = static_cast<std::uint32_t>(cap >> 32);
  section(Tag::options, 0, sizeof f);
  for (const std::uint32_t word :
       {f.algorithm, f.order, f.backend, f.nan, f.isa, f.margin, f.cell_scale, f.threads,
        f.concurrent_consumer, f.measure_stages, f.executor, f.memory, f.stop, f.reserved,
        f.cap_low, f.cap_high}) {
    put32(word);
  }
  std::strncpy(f.library, THRONG_VERSION, sizeof f.library - 1);
  put(f.library, sizeof f.library);
  end_section();
}

void Log::begin(Operation operation, std::uint32_t sets, std::uint64_t capacity, std::uint32_t form,
                const Vec3& by) noexcept {
  if (!file_) return;
  in_operation_ = true;
  checksum_ = 0;
  section(Tag::operation, static_cast<std::uint32_t>(operation), 28);
  put64(capacity);
  put_float(by.x);
  put_float(by.y);
  put_float(by.z);
  put32(form);
  put32(sets);
  end_section();
}

void Log::boxes(const Boxes& boxes) noexcept {
  if (!file_) return;
  const Filters& f = boxes.filters;
  const std::uint32_t flags = (f.group ? has_group : 0u) | (f.mask ? has_mask : 0u) |
                              (f.owner ? has_owner : 0u) | (f.world ? has_world : 0u) |
                              (f.is_static ? has_static : 0u) | (boxes.is_flat() ? is_flat : 0u);
  const std::size_t n = boxes.size();
  const unsigned words = 6u + !!f.group + !!f.mask + !!f.owner + !!f.world;
  section(Tag::boxes, flags, 8 + std::uint64_t{n} * (4 * words + !!f.is_static));
  put64(n);
  for (std::size_t i = 0; i < n; ++i)
    for (int k = 0; k < 6; ++k) put_float(boxes.corner(i, k));
  for (std::size_t i = 0; f.group && i < n; ++i) put32(f.group[i]);
  for (std::size_t i = 0; f.mask && i < n; ++i) put32(f.mask[i]);
  for (std::size_t i = 0; f.owner && i < n; ++i) put32(static_cast<std::uint32_t>(f.owner[i]));
  for (std::size_t i = 0; f.world && i < n; ++i) put32(static_cast<std::uint32_t>(f.world[i]));
  for (std::size_t i = 0; f.is_static && i < n; ++i) put(&f.is_static[i], 1);
  end_section();
}

void Log::sweeps(const Sweep* sweeps, std::size_t count) noexcept {
  if (!file_) return;
  section(Tag::sweeps, 0, 8 + std::uint64_t{count} * 36);
  put64(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (const Vec3& v : {sweeps[i].box.lower, sweeps[i].box.upper, sweeps[i].by}) {
      put_float(v.x);
      put_float(v.y);
      put_float(v.z);
    }
  }
  end_section();
}

void Log::answer(Result& r) noexcept {
  if (file_ && in_operation_) {
    section(Tag::answer, static_cast<std::uint32_t>(r.status), 7 * 8 + 4 * 4);
    for (const std::uint64_t number : {r.found, r.written, r.inactive, r.first_invalid,
                                       r.invalid_count, r.bytes_needed, checksum_}) {
      put64(number);
    }
    put32(static_cast<std::uint32_t>(r.plan.backend));
    put32(static_cast<std::uint32_t>(r.plan.algorithm));
    put32(static_cast<std::uint32_t>(r.plan.isa));
    put32(r.plan.threads);
    end_section();
    in_operation_ = false;
  }
  if (!failed_) return;
  failed_ = false;
  if (r.message[0]) return;  // the call's own error matters more
  try {
    std::snprintf(r.message, sizeof r.message,
                  "this call succeeded, but its capture was not written: %s; see Options::capture",
                  std::generic_category().message(error_).c_str());
  } catch (...) {
    std::snprintf(r.message, sizeof r.message, "no memory to write the capture");
  }
}

// Each section is flushed before the call continues, so that the input is on disk if the process
// crashes.
void Log::section(Tag tag, std::uint32_t number, std::uint64_t bytes) noexcept {
  drain();
  sum_ = fold_start;
  put32(static_cast<std::uint32_t>(tag));
  put32(number);
  put64(bytes);
}
void Log::end_section() noexcept {
  drain();
  put64(sum_);
  drain();
  if (file_ && std::fflush(file_) != 0) fail(errno);
}

void Log::put(const void* bytes, std::size_t count) noexcept {
  if (used_ + count > sizeof buffer_) drain();
  std::memcpy(buffer_ + used_, bytes, count);  // at most 16 bytes per call
  used_ += count;
}
void Log::put32(std::uint32_t v) noexcept {
  const unsigned char bytes[4] = {static_cast<unsigned char>(v), static_cast<unsigned char>(v >> 8),
                                  static_cast<unsigned char>(v >> 16),
                                  static_cast<unsigned char>(v >> 24)};
  put(bytes, sizeof bytes);
}
void Log::put64(std::uint64_t v) noexcept {
  put32(static_cast<std::uint32_t>(v));
  put32(static_cast<std::uint32_t>(v >> 32));
}
void Log::put_float(float v) noexcept {
  std::uint32_t bits;
  std::memcpy(&bits, &v, sizeof bits);
  put32(bits);
}

void Log::drain() noexcept {
  const std::size_t count = used_;
  used_ = 0;
  if (!file_ || count == 0) return;
  sum_ = fold(sum_, buffer_, count);
  errno = 0;
  if (std::fwrite(buffer_, 1, count, file_) != count) fail(errno);
}

void Log::close() noexcept {
  if (file_) std::fclose(file_);
  file_ = nullptr;
}

// A file with a gap is useless: remove it.
void Log::fail(int error) noexcept {
  close();
  if (name_[0]) std::remove(name_);
  name_[0] = 0;
  failed_ = true;
  error_ = error;
}

}  // namespace throng::capture
