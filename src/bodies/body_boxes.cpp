#include "bodies/body_boxes.hpp"

#include <algorithm>

#include "base/threads.hpp"

namespace throng::bodies {
namespace {

// Bodies per chunk: large enough to make taking one free, small enough that a cluster of convex
// bodies does not keep one task busy. A multiple of the block.
constexpr std::size_t chunk = 1024;

void put(float (*to)[BodyBlock::size], std::size_t lane, const Vec3& v) noexcept {
  to[0][lane] = v.x;
  to[1][lane] = v.y;
  to[2][lane] = v.z;
}

// A task's state: the block, and the part of it that stays valid between blocks.
class Task {
 public:
  Task(const base::UpdateBoxes& job, BlockKernel place, BlockKernel unrotated) noexcept
      : job_(job), kernel_(place), unrotated_kernel_(unrotated) {
    shared_ = !job.shape.data && job.one_shape;
    if (!shared_) return;
    per_body_ = !is_block_shape(0);
    if (per_body_) return;
    const Shape& s = job.shapes[0];
    is_sphere_ = s.center.x == 0 && s.center.y == 0 && s.center.z == 0 && s.half_extents.x == 0 &&
                 s.half_extents.y == 0 && s.half_extents.z == 0;
    for (std::size_t k = 0; k < BodyBlock::size; ++k) put_shape(k, s);
  }

  // Processes bodies first .. first + count - 1, count <= BodyBlock::size. Bodies that are no
  // boxes, or faulty, take the scalar path.
  void run(std::size_t first, std::size_t count) noexcept {
    if (per_body_) {
      for (std::size_t i = first; i < first + count; ++i) run_single(i);
      return;
    }
    for (std::size_t k = 0; k < count; ++k) put(block_.position, k, job_.position[first + k]);
    const bool rotated = job_.rotation.data && !(is_sphere_ && rotations_finite(first, count));
    if (rotated) {
      for (std::size_t k = 0; k < count; ++k) {
        const Quaternion& q = job_.rotation[first + k];
        block_.rotation[0][k] = q.x;
        block_.rotation[1][k] = q.y;
        block_.rotation[2][k] = q.z;
        block_.rotation[3][k] = q.w;
      }
    }
    if (job_.displacement.data) {
      for (std::size_t k = 0; k < count; ++k)
        put(block_.displacement, k, job_.displacement[first + k]);
    }
    std::uint64_t single_mask = 0;
    if (!shared_) {
      for (std::size_t k = 0; k < count; ++k) {
        if (is_block_shape(first + k)) {
          put_shape(k, job_.shapes[job_.shape_index(first + k)]);
        } else {
          single_mask |= std::uint64_t{1} << k;
        }
      }
    }
    (rotated ? kernel_ : unrotated_kernel_)(block_, job_.margin);
    for (std::size_t k = 0; k < count; ++k) {
      job_.box(first + k) = {{block_.lower[0][k], block_.lower[1][k], block_.lower[2][k]},
                             {block_.upper[0][k], block_.upper[1][k], block_.upper[2][k]}};
    }
    for (std::size_t k = 0; single_mask != 0; ++k, single_mask >>= 1) {
      if (single_mask & 1) run_single(first + k);
    }
  }

  const BodyReport& report() const noexcept { return report_; }

 private:
  bool is_block_shape(std::size_t i) const noexcept {
    return job_.fault(i) == base::ShapeFault::none &&
           job_.shapes[job_.shape_index(i)].kind == ShapeKind::box;
  }
  // Rotation leaves a sphere unchanged to the bit: each product of the matrix with 0 is 0 for a
  // finite matrix, which every finite quaternion gives. x - x is not 0 for an infinity.
  bool rotations_finite(std::size_t first, std::size_t count) const noexcept {
    float none = 0;
    for (std::size_t k = first; k < first + count; ++k) {
      const Quaternion& q = job_.rotation[k];
      none += (q.x - q.x) + (q.y - q.y) + (q.z - q.z) + (q.w - q.w);
    }
    return none == 0;
  }
  void put_shape(std::size_t lane, const Shape& s) noexcept {
    put(block_.center, lane, s.center);
    put(block_.half_extents, lane, s.half_extents);
    block_.radius[lane] = s.radius;
  }
  void run_single(std::size_t i) noexcept {
    if (job_(i) == base::ShapeFault::none) return;
    if (report_.invalid_count++ == 0) report_.first_invalid = i;
  }

  const base::UpdateBoxes& job_;
  BlockKernel kernel_, unrotated_kernel_;
  bool is_sphere_ = false;  // one shared shape, invariant under rotation
  bool shared_ = false;     // one shared shape, already in the block
  bool per_body_ = false;   // one shared shape, not a block shape
  BodyReport report_;
  BodyBlock block_{};
};
static_assert(BodyBlock::size == 64, "one bit per body");
static_assert(chunk % BodyBlock::size == 0);

}  // namespace

BodyReport update_boxes(const base::UpdateBoxes& job, std::size_t count, Isa isa,
                        const Executor& executor, unsigned tasks,
                        base::Cancellation& stop) noexcept {
  const BlockKernel place = find_block_kernel(isa, job.rotation.data, job.displacement.data);
  const BlockKernel unrotated = find_block_kernel(isa, false, job.displacement.data);
  const std::size_t chunks = count / chunk + (count % chunk != 0);
  tasks = static_cast<unsigned>(std::min<std::size_t>(std::max(tasks, 1u), chunks));
  base::AtomicCounter turns(chunks);
  std::atomic<std::uint64_t> first{count}, invalid{0};
  auto body = [&](unsigned) {
    Task task(job, place, unrotated);
    for (std::uint64_t k; turns.take(k) && !stop();) {
      const std::size_t begin = static_cast<std::size_t>(k) * chunk;
      const std::size_t end = std::min(count, begin + chunk);
      for (std::size_t i = begin; i < end; i += BodyBlock::size)
        task.run(i, std::min(BodyBlock::size, end - i));
    }
    const BodyReport& r = task.report();
    if (r.invalid_count == 0) return;
    invalid.fetch_add(r.invalid_count, std::memory_order_relaxed);
    std::uint64_t seen = first.load(std::memory_order_relaxed);
    while (r.first_invalid < seen && !first.compare_exchange_weak(seen, r.first_invalid)) {
    }
  };
  try {
    base::run_tasks(executor, tasks, body);
  } catch (...) {
    // The executor failed to start the tasks: the caller processes the rest.
    base::run_tasks(executor, 1, body);
  }
  return {invalid ? first.load() : 0, invalid};
}

}  // namespace throng::bodies
