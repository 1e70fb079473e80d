// C API of persistent objects and queries, implemented with the C++ API.
#include <throng/throng.h>

#include <cstddef>
#include <cstring>
#include <new>
#include <optional>

#include <throng/broad_phase.hpp>
#include <throng/broad_phase_query.hpp>

#include "c_api_common.hpp"

using throng::c_api::run_call;
using throng::c_api::view;

static_assert(sizeof(throng_live_pair) == sizeof(throng::LivePair) &&
              alignof(throng_live_pair) == alignof(throng::LivePair) &&
              offsetof(throng_live_pair, slot) == offsetof(throng::LivePair, slot));
static_assert(sizeof(throng_sweep) == sizeof(throng::Sweep) &&
              offsetof(throng_sweep, by) == offsetof(throng::Sweep, by));
static_assert(sizeof(throng_sweep_hit) == sizeof(throng::SweepHit) &&
              offsetof(throng_sweep_hit, object) == offsetof(throng::SweepHit, object) &&
              offsetof(throng_sweep_hit, time) == offsetof(throng::SweepHit, time));
static_assert(sizeof(throng_ray_hit) == sizeof(throng::RayHit) &&
              offsetof(throng_ray_hit, distance) == offsetof(throng::RayHit, distance) &&
              offsetof(throng_ray_hit, point) == offsetof(throng::RayHit, point) &&
              offsetof(throng_ray_hit, normal) == offsetof(throng::RayHit, normal));
static_assert(THRONG_HITS_ALL == static_cast<int>(throng::SweepHits::all) &&
              THRONG_HITS_FIRST == static_cast<int>(throng::SweepHits::first));

struct throng_broad_phase : throng::c_api::Handle {
  explicit throng_broad_phase(const throng_options& given) noexcept
      : Handle(given), objects(options()) {}

  throng::BroadPhase objects;
};

struct throng_query : throng::c_api::Handle {
  explicit throng_query(const throng_options& given) noexcept : Handle(given), queries(options()) {}

  throng::BroadPhaseQuery queries;
};

namespace {

// Returns a list of the C++ API as an array of the layout-compatible C struct.
template <class Out, class List>
const Out* as_c_list(const List& list, size_t* count) noexcept {
  if (count) *count = list.size();
  return reinterpret_cast<const Out*>(list.data());
}

// Calls write(), which writes a property of the object to `to`.
template <class Write>
throng_status read_object(const throng_broad_phase* broad_phase, std::uint32_t id, const void* to,
                          throng_status if_null, const Write& write) noexcept {
  if (!broad_phase) return THRONG_OUT_OF_MEMORY;
  if (!throng_broad_phase_is_alive(broad_phase, id)) return THRONG_BAD_ID;
  if (!to) return if_null;
  write();
  return THRONG_OK;
}

// Calls the callback with the C++ forms (sweeps, count, which, filters) of the C arguments.
template <class Cast>
throng::Result cast_sweeps(const throng_sweep* sweeps, size_t count, int which,
                           const throng_boxes* filters, const Cast& cast) noexcept {
  if (which != THRONG_HITS_ALL && which != THRONG_HITS_FIRST) {
    return throng::c_api::bad_option("`which` is none of the constants THRONG_HITS_; use one");
  }
  throng::Filters of_sweeps;
  if (filters) {
    throng_boxes counted = *filters;
    counted.count = count;
    of_sweeps = view(counted).filters;
  }
  return cast(reinterpret_cast<const throng::Sweep*>(sweeps), count,
              static_cast<throng::SweepHits>(which), of_sweeps);
}

// The name of a missing argument of a ray cast, or null.
const char* missing_of_ray(const float* origin, const float* direction,
                           const throng_ray_hit* hit) noexcept {
  if (!origin) return "origin of the ray";
  if (!direction) return "direction of the ray";
  return hit ? nullptr : "ray hit to write";
}

throng::Result cast_ray(const throng::BroadPhase& objects, const float* origin,
                        const float* direction, double max_distance, const throng::Filter& of_ray,
                        throng::ObjectFilter filter, throng_ray_hit* out) noexcept {
  std::optional<throng::RayHit> hit;
  const throng::Result r =
      objects.raycast({origin[0], origin[1], origin[2]}, {direction[0], direction[1], direction[2]},
                      max_distance, of_ray, filter, hit);
  const throng::RayHit none{THRONG_NO_OBJECT, 0, {0, 0, 0}, {0, 0, 0}};
  std::memcpy(out, hit ? &*hit : &none, sizeof *out);
  return r;
}

}  // namespace

extern "C" {

throng_broad_phase* throng_broad_phase_create(const throng_options* options) {
  return new (std::nothrow) throng_broad_phase(throng::c_api::complete_options(options));
}

void throng_broad_phase_destroy(throng_broad_phase* broad_phase) { delete broad_phase; }

throng_status throng_broad_phase_copy(throng_broad_phase* to, const throng_broad_phase* from) {
  return run_call(to, from != nullptr, "broad phase to copy",
                  [&] { return to->objects.copy_from(from->objects); });
}

throng_status throng_broad_phase_add(throng_broad_phase* broad_phase, const throng_boxes* boxes,
                                     uint32_t* ids) {
  return run_call(broad_phase, boxes != nullptr, "boxes",
                  [&] { return broad_phase->objects.add(view(*boxes), ids); });
}

throng_status throng_broad_phase_remove(throng_broad_phase* broad_phase, const uint32_t* ids,
                                        size_t count) {
  return run_call(broad_phase, true, "", [&] { return broad_phase->objects.remove(ids, count); });
}

throng_status throng_broad_phase_move(throng_broad_phase* broad_phase, const uint32_t* ids,
                                      const throng_boxes* boxes) {
  return run_call(broad_phase, boxes != nullptr, "boxes",
                  [&] { return broad_phase->objects.move(ids, view(*boxes)); });
}

throng_status throng_broad_phase_move_all(throng_broad_phase* broad_phase,
                                          const throng_boxes* boxes) {
  return run_call(broad_phase, boxes != nullptr, "boxes",
                  [&] { return broad_phase->objects.move_all(view(*boxes)); });
}

throng_status throng_broad_phase_set_filters(throng_broad_phase* broad_phase, const uint32_t* ids,
                                             const throng_boxes* filters) {
  return run_call(broad_phase, filters != nullptr, "filters", [&] {
    return broad_phase->objects.set_filters(ids, filters->count, view(*filters).filters);
  });
}

throng_status throng_broad_phase_shift_origin(throng_broad_phase* broad_phase, const float* by) {
  return run_call(broad_phase, by != nullptr, "shift", [&] {
    return broad_phase->objects.shift_origin({by[0], by[1], by[2]});
  });
}

throng_status throng_broad_phase_update(throng_broad_phase* broad_phase) {
  return run_call(broad_phase, true, "", [&] { return broad_phase->objects.update(); });
}

const throng_live_pair* throng_broad_phase_begun(const throng_broad_phase* broad_phase,
                                                 size_t* count) {
  return as_c_list<throng_live_pair>(
      broad_phase ? broad_phase->objects.begun() : throng::LivePairs(), count);
}
const throng_live_pair* throng_broad_phase_ended(const throng_broad_phase* broad_phase,
                                                 size_t* count) {
  return as_c_list<throng_live_pair>(
      broad_phase ? broad_phase->objects.ended() : throng::LivePairs(), count);
}
const throng_live_pair* throng_broad_phase_pairs(throng_broad_phase* broad_phase, size_t* count) {
  return as_c_list<throng_live_pair>(
      broad_phase ? broad_phase->objects.pairs() : throng::LivePairs(), count);
}

size_t throng_broad_phase_pairs_of(const throng_broad_phase* broad_phase, uint32_t id,
                                   throng_live_pair* out, size_t capacity) {
  if (!broad_phase) return 0;
  return broad_phase->objects.pairs_of(id, reinterpret_cast<throng::LivePair*>(out),
                                       out ? capacity : 0);
}

throng_status throng_broad_phase_find_overlaps(throng_broad_phase* broad_phase,
                                               const throng_boxes* boxes) {
  return run_call(broad_phase, boxes != nullptr, "boxes",
                  [&] { return broad_phase->objects.find_overlaps(view(*boxes)); });
}
const throng_pair* throng_broad_phase_overlaps(const throng_broad_phase* broad_phase,
                                               size_t* count) {
  const throng::Pairs found = broad_phase ? broad_phase->objects.overlaps() : throng::Pairs();
  return as_c_list<throng_pair>(found, count);
}

throng_status throng_broad_phase_find_hits(throng_broad_phase* broad_phase,
                                           const throng_sweep* sweeps, size_t count, int which,
                                           const throng_boxes* filters) {
  return run_call(broad_phase, true, "", [&] {
    return cast_sweeps(sweeps, count, which, filters, [&](const auto&... arguments) {
      return broad_phase->objects.find_hits(arguments...);
    });
  });
}
const throng_sweep_hit* throng_broad_phase_hits(const throng_broad_phase* broad_phase,
                                                size_t* count) {
  const throng::SweepHitList found =
      broad_phase ? broad_phase->objects.hits() : throng::SweepHitList();
  return as_c_list<throng_sweep_hit>(found, count);
}

throng_status throng_broad_phase_raycast(throng_broad_phase* broad_phase, const float* origin,
                                         const float* direction, double max_distance,
                                         uint32_t layer_mask, throng_ray_hit* hit) {
  const char* missing = missing_of_ray(origin, direction, hit);
  return run_call(broad_phase, !missing, missing, [&] {
    throng::Filter of_ray;
    of_ray.mask = layer_mask;
    return cast_ray(broad_phase->objects, origin, direction, max_distance, of_ray, {}, hit);
  });
}

int throng_broad_phase_is_alive(const throng_broad_phase* broad_phase, uint32_t id) {
  return broad_phase && broad_phase->objects.is_alive(id);
}
throng_status throng_broad_phase_box(const throng_broad_phase* broad_phase, uint32_t id,
                                     throng_box* box) {
  return read_object(broad_phase, id, box, THRONG_BAD_BOXES, [&] {
    const throng::Box b = broad_phase->objects.box(id);
    *box = {{b.lower.x, b.lower.y, b.lower.z}, {b.upper.x, b.upper.y, b.upper.z}};
  });
}
throng_status throng_broad_phase_filter(const throng_broad_phase* broad_phase, uint32_t id,
                                        throng_filter* filter) {
  return read_object(broad_phase, id, filter, THRONG_BAD_FILTER, [&] {
    const throng::Filter f = broad_phase->objects.filter(id);
    *filter = {f.group, f.mask, f.owner, f.world, f.is_static};
  });
}
uint64_t throng_broad_phase_object_count(const throng_broad_phase* broad_phase) {
  return broad_phase ? broad_phase->objects.object_count() : 0;
}
uint64_t throng_broad_phase_pair_count(const throng_broad_phase* broad_phase) {
  return broad_phase ? broad_phase->objects.pair_count() : 0;
}
uint64_t throng_broad_phase_id_limit(const throng_broad_phase* broad_phase) {
  return broad_phase ? broad_phase->objects.id_limit() : 0;
}
uint64_t throng_broad_phase_slot_limit(const throng_broad_phase* broad_phase) {
  return broad_phase ? broad_phase->objects.slot_limit() : 0;
}
void throng_broad_phase_stop(throng_broad_phase* broad_phase) {
  if (broad_phase) broad_phase->stop();
}
size_t throng_broad_phase_memory_bytes(const throng_broad_phase* broad_phase) {
  return broad_phase ? broad_phase->objects.memory_bytes() : 0;
}
const throng_result* throng_broad_phase_result(const throng_broad_phase* broad_phase) {
  return throng::c_api::result_of(broad_phase);
}

throng_query* throng_query_create(const throng_options* options) {
  return new (std::nothrow) throng_query(throng::c_api::complete_options(options));
}

void throng_query_destroy(throng_query* query) { delete query; }

throng_status throng_query_find_overlaps(throng_query* query, const throng_broad_phase* broad_phase,
                                         const throng_boxes* boxes) {
  return run_call(query, broad_phase && boxes, boxes ? "broad phase" : "boxes",
                  [&] { return query->queries.find_overlaps(broad_phase->objects, view(*boxes)); });
}
const throng_pair* throng_query_overlaps(const throng_query* query, size_t* count) {
  return as_c_list<throng_pair>(query ? query->queries.overlaps() : throng::Pairs(), count);
}

throng_status throng_query_find_hits(throng_query* query, const throng_broad_phase* broad_phase,
                                     const throng_sweep* sweeps, size_t count, int which,
                                     const throng_boxes* filters, throng_sweep_test test,
                                     void* context) {
  return run_call(query, broad_phase != nullptr, "broad phase", [&] {
    return cast_sweeps(sweeps, count, which, filters, [&](const auto&... arguments) {
      return query->queries.find_hits(broad_phase->objects, arguments..., {test, context});
    });
  });
}
const throng_sweep_hit* throng_query_hits(const throng_query* query, size_t* count) {
  return as_c_list<throng_sweep_hit>(query ? query->queries.hits() : throng::SweepHitList(), count);
}

throng_status throng_query_raycast(throng_query* query, const throng_broad_phase* broad_phase,
                                   const float* origin, const float* direction, double max_distance,
                                   const throng_filter* of_ray, throng_object_filter filter,
                                   void* context, throng_ray_hit* hit) {
  const char* missing = broad_phase ? missing_of_ray(origin, direction, hit) : "broad phase";
  return run_call(query, !missing, missing, [&] {
    throng::Filter values;
    if (of_ray)
      values = {of_ray->group, of_ray->mask, of_ray->owner, of_ray->world, of_ray->is_static};
    const auto allowed = [&](throng::ObjectId id) { return filter(context, id) != 0; };
    return cast_ray(broad_phase->objects, origin, direction, max_distance, values,
                    filter ? throng::ObjectFilter(allowed) : throng::ObjectFilter(), hit);
  });
}

const throng_result* throng_query_result(const throng_query* query) {
  return throng::c_api::result_of(query);
}
void throng_query_stop(throng_query* query) {
  if (query) query->stop();
}
size_t throng_query_memory_bytes(const throng_query* query) {
  return query ? query->queries.memory_bytes() : 0;
}

}  // extern "C"
