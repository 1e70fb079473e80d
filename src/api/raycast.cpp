// Public API of the cast of one ray.
#include <cmath>

#include "base/ray.hpp"
#include "broad_phase_state.hpp"

namespace throng {
namespace {

bool is_finite(const Vec3& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool refuse_vector(const char* name, const Vec3& v, const char* wanted, Status status,
                   Result& r) noexcept {
  set_message(r, "%s: found (%.9g, %.9g, %.9g), wanted %s", name, static_cast<double>(v.x),
              static_cast<double>(v.y), static_cast<double>(v.z), wanted);
  return refuse(r, status);
}

bool valid_ray(const Vec3& origin, const Vec3& direction, double max_distance, const Filter& filter,
               Result& r) noexcept {
  if (!is_finite(origin))
    return refuse_vector("origin", origin, "three finite numbers", Status::nan_box, r);
  if (!is_finite(direction)) {
    return refuse_vector("direction", direction,
                         "three finite numbers; for an unlimited ray give an infinite max_distance",
                         Status::nan_box, r);
  }
  if (direction.x == 0 && direction.y == 0 && direction.z == 0) {
    return refuse_vector("direction", direction,
                         "a vector other than 0; for the objects at a point use find_overlaps",
                         Status::bad_option, r);
  }
  if (!(max_distance >= 0)) {
    set_message(r, "max_distance: found %.9g, wanted 0 or more, or infinity for no limit",
                max_distance);
    return refuse(r, Status::bad_option);
  }
  if (filter.world < -1) {
    set_message(r, "world: found %d, wanted -1 for every world, or 0 and up for one",
                int{filter.world});
    return refuse(r, Status::bad_filter);
  }
  return true;
}

// What decides whether an object counts, in addition to its box and its filter values.
struct RayTest {
  const base::Ray& ray;
  const ObjectFilter& filter;

  double operator()(std::uint32_t, ObjectId object, double time) const {
    return ray.reaches(time) && filter(object) ? time : 2;
  }
};

}  // namespace

Result BroadPhase::raycast(const Vec3& origin, const Vec3& direction, double max_distance,
                           const Filter& of_ray, ObjectFilter filter,
                           std::optional<RayHit>& hit) const noexcept {
  hit.reset();
  return BroadPhaseAccess::read(*this, [&](tracking::Tracker* tracker, Result& r) {
    if (!valid_ray(origin, direction, max_distance, of_ray, r)) return;
    if (!tracker) {
      (void)valid(Boxes(), nullptr, options_, r);
      return;
    }
    const base::Ray ray(origin, direction, max_distance);
    const RayTest test{ray, filter};
    const SweepHit first =
        tracker->find_first_hit({ray.path(), ray.last_time(), of_ray, test}, options_, r);
    if (first.object == tracking::none) return;
    hit = ray.hit(first.object, tracker->objects().body(first.object).box, first.time);
  });
}

std::optional<RayHit> BroadPhase::raycast(const Vec3& origin, const Vec3& direction,
                                          double max_distance, std::uint32_t layer_mask,
                                          ObjectFilter filter) const {
  Filter of_ray;
  of_ray.mask = layer_mask;
  std::optional<RayHit> hit;
  const Result r = raycast(origin, direction, max_distance, of_ray, filter, hit);
  if (!r.ok()) throw Error(r);
  return hit;
}

}  // namespace throng
