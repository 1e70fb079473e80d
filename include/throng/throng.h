/* throng.h: the C API. Finds all pairs of overlapping boxes and of intersecting triangles, for C
 * and for languages that call C.
 *
 * Plain structs and opaque handles. Every call returns a status; the handle's result holds the
 * error message with the number and the fix. The library never prints and throws nothing. Thread
 * safety: one thread at a time per handle; different handles are independent. Strides are in bytes.
 * What a struct points to must outlive the call (for options: the handle).
 *
 * Boxes and pairs follow the C++ API: boxes are closed, so touching counts; a box with lower >
 * upper on some axis overlaps nothing, or is an error with THRONG_INVERTED_REFUSE. A
 * zero-initialized struct is empty or the default (no boxes, no filter), except throng_options:
 * call throng_options_init.
 *
 * ABI: two structs may grow, at their end: throng_options and throng_result. Both begin with their
 * size. All other structs keep their layout; constants keep their values. */
#ifndef THRONG_THRONG_H
#define THRONG_THRONG_H

#include <stddef.h>
#include <stdint.h>

#include <throng/export.h>

/* Incremented when a struct gains a field at its end, or a function or constant is added. */
#define THRONG_C_VERSION 10

#ifdef __cplusplus
extern "C" {
#endif

typedef struct throng_box {
  float lower[3], upper[3]; /* world units */
} throng_box;

typedef struct throng_pair {
  uint32_t first, second; /* one set: first < second; two sets: an index into each */
} throng_pair;

typedef enum throng_status {
  THRONG_OK = 0,
  THRONG_BUFFER_TOO_SMALL, /* `found` is exact: raise the capacity to it */
  THRONG_STOPPED,          /* the consumer returned 0, or a stop function was called */
  THRONG_NAN_BOX,          /* also a sweep with a NaN or an infinite direction; see first_invalid */
  THRONG_BAD_BOXES,        /* a coordinate is missing, or the stride is not a multiple of 4 */
  THRONG_BAD_FILTER,       /* its stride does not fit its type, or a world is below -1 */
  THRONG_BAD_OPTION,       /* also: throng_options_init was not called */
  THRONG_TOO_MANY_BOXES,   /* more than 2^32 - 2^16 in one set */
  THRONG_OUT_OF_MEMORY,    /* see bytes_needed */
  THRONG_MEMORY_CAP_TOO_SMALL,
  THRONG_UNSUPPORTED_ISA,
  THRONG_NO_DEVICE,
  THRONG_DEVICE_ERROR,
  THRONG_NOT_RESERVED, /* not returned by C functions */
  THRONG_BAD_BODIES,   /* an array of throng_update_boxes is missing, or its stride does not fit */
  THRONG_BAD_SHAPE,    /* see first_invalid, the index of a body, and invalid_count */
  THRONG_BAD_ID,       /* not alive, or twice in one list; see first_invalid, invalid_count */
  THRONG_BUSY,         /* another call on the same handle is running; the result is that call's */
  THRONG_INVERTED_BOX = 20, /* lower > upper, where refused; see first_invalid, invalid_count */
  THRONG_BAD_MESH = 21 /* a missing array, an index out of range or a vertex that is not finite */
} throng_status;

enum { THRONG_ALGORITHM_AUTOMATIC, THRONG_ALGORITHM_ALL_PAIRS, THRONG_ALGORITHM_GRID };
enum { THRONG_ORDER_ANY, THRONG_ORDER_CANONICAL };
enum { THRONG_BACKEND_AUTOMATIC, THRONG_BACKEND_CPU, THRONG_BACKEND_CUDA, THRONG_BACKEND_EMULATED };
enum { THRONG_NAN_REFUSE, THRONG_NAN_INACTIVE };
/* What to do with a box that has lower > upper on some axis. Automatic: inactive, an empty slot.
 * Refuse: an error that names the likely mistake, such as center and size given as corners. */
enum { THRONG_INVERTED_AUTOMATIC, THRONG_INVERTED_REFUSE, THRONG_INVERTED_INACTIVE };
enum {
  THRONG_ISA_AUTOMATIC, /* the widest available, or the one named by the environment variable
                           THRONG_ISA */
  THRONG_ISA_SCALAR,
  THRONG_ISA_SSE4,
  THRONG_ISA_AVX2,
  THRONG_ISA_AVX512,
  THRONG_ISA_NEON,
  THRONG_ISA_WASM
};

/* One value per box; data NULL: absent. */
typedef struct throng_strided {
  const void* data;
  size_t stride_bytes; /* from one value to the next; 0: contiguous */
} throng_strided;

typedef struct throng_boxes {
  size_t count;
  const float* corner[6]; /* lower x, y, z, upper x, y, z of the first box; both z NULL: 2-D */
  size_t stride_bytes;    /* from one box to the next, of each coordinate; a multiple of 4. 0:
                             contiguous: 24 bytes for packed boxes, 12 for packed corners, 4 for one
                             array per coordinate; for 2-D boxes 16, 8 or 4 */
  /* Filters: a pair is reported when every given filter allows it. */
  throng_strided group, mask; /* uint32_t: (group a & mask b) and (group b & mask a) nonzero */
  throng_strided owner;       /* int32_t: equal owners never pair, -1: no owner */
  throng_strided world;       /* int32_t: different worlds never pair, -1 pairs with every world */
  throng_strided is_static;   /* uint8_t: two nonzero never pair */
} throng_boxes;

/* Views without filters: of an array of boxes; of boxes that are fields of larger structs,
 * `stride_bytes` apart (a multiple of 4; 0: an array of boxes); of separate lower and upper
 * corners, three floats each. */
THRONG_API throng_boxes throng_boxes_packed(const throng_box* boxes, size_t count);
THRONG_API throng_boxes throng_boxes_strided(const throng_box* first, size_t count,
                                             size_t stride_bytes);
THRONG_API throng_boxes throng_boxes_split(const float* lower, const float* upper, size_t count);

typedef struct throng_options {
  size_t struct_bytes; /* set by throng_options_init */
  int algorithm, order, backend, nan;
  float margin;            /* boxes are compared as lower - margin, upper + margin; >= 0 */
  unsigned threads;        /* maximum number; 0: the executor's concurrency */
  size_t memory_cap_bytes; /* throng_consume: upper bound on all memory taken; 0: no cap */
  /* Executor; run NULL: the default. run(self, count, task, context) must call task(context, i)
   * exactly once for every i below count, on any threads, and return when all calls have returned.
   */
  unsigned concurrency;
  void (*run)(void* self, unsigned count, void (*task)(void* context, unsigned index),
              void* context);
  void* run_self;
  /* Memory resource; NULL: the default. allocate returns NULL on failure. */
  void* (*allocate)(void* self, size_t bytes, size_t alignment);
  void (*deallocate)(void* self, void* p, size_t bytes, size_t alignment);
  void* memory_self;
  int isa;       /* one of THRONG_ISA_* */
  int stoppable; /* 1: throng_finder_stop and throng_broad_phase_stop can end a call; on a GPU this
                    synchronizes the stream after each stage */
  int inverted;  /* one of THRONG_INVERTED_* */
} throng_options;

/* Sets all defaults: automatic, any order, NaN refused, all threads. */
#define throng_options_init(options) throng_options_init_sized((options), sizeof *(options))
THRONG_API void throng_options_init_sized(throng_options* options, size_t struct_bytes);

typedef struct throng_result {
  size_t struct_bytes; /* size in the library; a field beyond it does not exist there */
  throng_status status;
  uint64_t found;   /* number of pairs, exact even if the buffer was too small */
  uint64_t written; /* pairs written or passed to the consumer */
  uint64_t inactive;
  uint64_t comparisons;
  uint64_t first_invalid, invalid_count, bytes_needed;
  double total_ms, plan_ms, bin_ms, find_ms, order_ms;
  const char* plan;            /* the reason for the planner's choice */
  const char* message;         /* what went wrong, and the fix; "" on success */
  int backend, algorithm, isa; /* those used, as the constants above */
  unsigned threads;
  uint64_t visited; /* cells, columns, records and tree nodes visited, in addition to comparisons; 0
                       on a GPU and with THRONG_BACKEND_EMULATED */
  uint64_t candidates;  /* meshes: pairs of triangles whose boxes overlap, each tested once */
  uint64_t exact_tests; /* meshes: candidates that floating-point arithmetic could not decide */
} throng_result;

/* Finds pairs and keeps its workspace from frame to frame. A call on a NULL handle, which a failed
 * create returns, returns THRONG_OUT_OF_MEMORY. */
typedef struct throng_finder throng_finder;

/* options NULL: the defaults. Returns NULL if out of memory. Invalid options are reported by the
 * first call. */
THRONG_API throng_finder* throng_finder_create(const throng_options* options);
THRONG_API void throng_finder_destroy(throng_finder* finder); /* NULL is allowed */

/* Finds the pairs within `a`, or, with `b` not NULL, of a box of `a` and one of `b`. The finder
 * stores them. */
THRONG_API throng_status throng_find(throng_finder* finder, const throng_boxes* a,
                                     const throng_boxes* b);
/* The pairs of the last throng_find, valid until the finder's next call. `count` may be NULL. */
THRONG_API const throng_pair* throng_finder_pairs(const throng_finder* finder, size_t* count);

/* Writes the pairs to out[0 .. capacity-1]. On THRONG_BUFFER_TOO_SMALL the first `written` pairs
 * are valid; none in canonical order. */
THRONG_API throng_status throng_find_into(throng_finder* finder, const throng_boxes* a,
                                          const throng_boxes* b, throng_pair* out, size_t capacity);

/* Passes blocks of pairs to `consumer`, one call at a time, and stores nothing else. consumer
 * returns 0 to stop. */
THRONG_API throng_status throng_consume(
    throng_finder* finder, const throng_boxes* a, const throng_boxes* b,
    int (*consumer)(void* context, const throng_pair* pairs, size_t count), void* context);

/* The result of the last call, valid until the next call. */
THRONG_API const throng_result* throng_finder_result(const throng_finder* finder);
/* Callable from any thread. Ends the running call soon, if its options are `stoppable`, with
 * THRONG_STOPPED and found = 0. No effect if no call is running. */
THRONG_API void throng_finder_stop(throng_finder* finder);
/* Bytes held now. */
THRONG_API size_t throng_finder_memory_bytes(const throng_finder* finder);

/* Persistent objects: keeps the objects from frame to frame and reports which pairs began and
 * ended. A failed call changes nothing. `found` is the number of objects after a call on objects,
 * the number of pairs after throng_broad_phase_update. The options algorithm, order and
 * memory_cap_bytes are ignored; backend must be automatic or cpu. */
typedef struct throng_broad_phase throng_broad_phase;

/* A current pair, first < second. The slot is a small number, unique among current pairs and
 * constant while the pair exists: an index for per-pair data such as contacts. */
typedef struct throng_live_pair {
  uint32_t first, second, slot;
} throng_live_pair;

/* The filter values of one object; throng_boxes holds them as arrays. */
typedef struct throng_filter {
  uint32_t group, mask;
  int32_t owner, world;
  uint8_t is_static;
} throng_filter;

/* A box that moves linearly by `by` as time goes from 0 to 1. A point box is a ray. */
typedef struct throng_sweep {
  throng_box box;
  float by[3];
} throng_sweep;

/* The closest hit of a ray. `object` is THRONG_NO_OBJECT if nothing is hit; then all else is 0. A
 * ray that starts in the box has distance 0, point its origin, normal the opposite of its
 * direction. */
typedef struct throng_ray_hit {
  uint32_t object;
  double distance; /* world units */
  float point[3];  /* a point of the object's box */
  float normal[3]; /* of length 1: of the face that the ray enters; at an edge of the first axis */
} throng_ray_hit;
#define THRONG_NO_OBJECT 0xffffffffu

/* `time` is the time of first contact between sweep and object; 0 if they touch at the start. */
typedef struct throng_sweep_hit {
  uint32_t sweep, object;
  double time;
} throng_sweep_hit;

enum {
  THRONG_HITS_ALL,  /* every object hit, sorted by id */
  THRONG_HITS_FIRST /* the first object hit; of simultaneous ones the lowest id */
};

/* As throng_finder_create and throng_finder_destroy. */
THRONG_API throng_broad_phase* throng_broad_phase_create(const throng_options* options);
THRONG_API void throng_broad_phase_destroy(throng_broad_phase* broad_phase);
/* Makes `to` a copy of `from`: ids, slots, and the events of the last update. */
THRONG_API throng_status throng_broad_phase_copy(throng_broad_phase* to,
                                                 const throng_broad_phase* from);

/* Adds one object per box, with the filters of the view. Writes boxes->count ids: 0, 1, 2, ... if
 * none was removed. The id of a removed object is reused only after an update has reported the
 * pairs that its removal ended. */
THRONG_API throng_status throng_broad_phase_add(throng_broad_phase* broad_phase,
                                                const throng_boxes* boxes, uint32_t* ids);
/* Here and below: an id that is not alive, or occurs twice in one list, is THRONG_BAD_ID. */
THRONG_API throng_status throng_broad_phase_remove(throng_broad_phase* broad_phase,
                                                   const uint32_t* ids, size_t count);
/* Sets the boxes of boxes->count objects. The last of several calls before an update wins. Ignores
 * filters. */
THRONG_API throng_status throng_broad_phase_move(throng_broad_phase* broad_phase,
                                                 const uint32_t* ids, const throng_boxes* boxes);
/* Sets the boxes of all objects: boxes[id] for every id below throng_broad_phase_id_limit. Detects
 * which boxes changed. */
THRONG_API throng_status throng_broad_phase_move_all(throng_broad_phase* broad_phase,
                                                     const throng_boxes* boxes);
/* Sets the filters of filters->count objects. Absent filters stay unchanged; the boxes of the view
 * are ignored. */
THRONG_API throng_status throng_broad_phase_set_filters(throng_broad_phase* broad_phase,
                                                        const uint32_t* ids,
                                                        const throng_boxes* filters);
/* Adds by[0], by[1], by[2] to all corners, rounded to nearest. */
THRONG_API throng_status throng_broad_phase_shift_origin(throng_broad_phase* broad_phase,
                                                         const float* by);

/* Finds the pairs that began and ended since the last update. */
THRONG_API throng_status throng_broad_phase_update(throng_broad_phase* broad_phase);
/* The begin and end events of the last update, and all pairs after it; sorted by first, then
 * second; valid until the next update. `count` may be NULL. */
THRONG_API const throng_live_pair* throng_broad_phase_begun(const throng_broad_phase* broad_phase,
                                                            size_t* count);
THRONG_API const throng_live_pair* throng_broad_phase_ended(const throng_broad_phase* broad_phase,
                                                            size_t* count);
THRONG_API const throng_live_pair* throng_broad_phase_pairs(throng_broad_phase* broad_phase,
                                                            size_t* count);

/* Returns the number of pairs of one object and writes them, sorted by the other object, if
 * `capacity` suffices; otherwise the content of `out` is unspecified. Thread-safe, also
 * concurrently with throng_query. `out` may be NULL with capacity 0. */
THRONG_API size_t throng_broad_phase_pairs_of(const throng_broad_phase* broad_phase, uint32_t id,
                                              throng_live_pair* out, size_t capacity);

/* Queries see the current objects, whether or not an update followed. Their results are valid until
 * the next query. The margin is ignored. */

/* Overlap query: finds all objects that each box overlaps. first is the index of the box, second
 * the object; sorted. */
THRONG_API throng_status throng_broad_phase_find_overlaps(throng_broad_phase* broad_phase,
                                                          const throng_boxes* boxes);
THRONG_API const throng_pair* throng_broad_phase_overlaps(const throng_broad_phase* broad_phase,
                                                          size_t* count);
/* Shape cast (ray cast for point boxes): finds the objects that each sweep hits, sorted by sweep.
 * `which` is one of THRONG_HITS_*. `filters` may be NULL; else it has `count` values per filter,
 * and its boxes are ignored. */
THRONG_API throng_status throng_broad_phase_find_hits(throng_broad_phase* broad_phase,
                                                      const throng_sweep* sweeps, size_t count,
                                                      int which, const throng_boxes* filters);
THRONG_API const throng_sweep_hit* throng_broad_phase_hits(const throng_broad_phase* broad_phase,
                                                           size_t* count);

/* Casts one ray: writes the closest hit within `max_distance` (0 to INFINITY, world units),
 * touching included, to `hit`. `origin` and `direction`: 3 finite numbers each; the direction has
 * any length but 0. An object is considered if its group has a bit of `layer_mask`; ~0u for all
 * layers. */
THRONG_API throng_status throng_broad_phase_raycast(throng_broad_phase* broad_phase,
                                                    const float* origin, const float* direction,
                                                    double max_distance, uint32_t layer_mask,
                                                    throng_ray_hit* hit);

/* Returns 1 or 0. */
THRONG_API int throng_broad_phase_is_alive(const throng_broad_phase* broad_phase, uint32_t id);
/* Reads the box given last. THRONG_BAD_ID, with `box` unchanged, if the id is not alive;
 * THRONG_BAD_BOXES if `box` is NULL. */
THRONG_API throng_status throng_broad_phase_box(const throng_broad_phase* broad_phase, uint32_t id,
                                                throng_box* box);
/* Reads the filter values likewise; THRONG_BAD_FILTER if `filter` is NULL. */
THRONG_API throng_status throng_broad_phase_filter(const throng_broad_phase* broad_phase,
                                                   uint32_t id, throng_filter* filter);
THRONG_API uint64_t throng_broad_phase_object_count(const throng_broad_phase* broad_phase);
THRONG_API uint64_t throng_broad_phase_pair_count(const throng_broad_phase* broad_phase);
/* Upper bounds: all ids, and all slots of current pairs and of pairs that ended in the last update,
 * are below these. */
THRONG_API uint64_t throng_broad_phase_id_limit(const throng_broad_phase* broad_phase);
THRONG_API uint64_t throng_broad_phase_slot_limit(const throng_broad_phase* broad_phase);
/* The result of the last call that returned a status, except throng_broad_phase_box and _filter;
 * valid until the next. */
THRONG_API const throng_result* throng_broad_phase_result(const throng_broad_phase* broad_phase);

/* As throng_finder_stop. A stopped update or query changes nothing. */
THRONG_API void throng_broad_phase_stop(throng_broad_phase* broad_phase);
THRONG_API size_t throng_broad_phase_memory_bytes(const throng_broad_phase* broad_phase);

/* Concurrent queries: several threads query one broad phase, each through its own handle. Meanwhile
 * only functions that take the broad phase as const may be called; others return THRONG_BUSY, and
 * so do queries while one of those runs. Of the options, only `nan`, `isa`, `threads`, `stoppable`,
 * executor and memory are used. */
typedef struct throng_query throng_query;
/* Exact test of a sweep against an object whose box it hits at `time`. Returns the time of contact,
 * or more than 1 for none; an earlier value counts as `time`. It may be called several times per
 * object, in any order, on each thread of the query. It must return the same value each time, and
 * must not call the broad phase or the query. */
typedef double (*throng_sweep_test)(void* context, uint32_t sweep, uint32_t object, double time);
/* Returns 0 for an object that a ray passes through. As for throng_sweep_test, but it may call
 * functions that take the broad phase as const. */
typedef int (*throng_object_filter)(void* context, uint32_t object);

/* As throng_finder_create and throng_finder_destroy. */
THRONG_API throng_query* throng_query_create(const throng_options* options);
THRONG_API void throng_query_destroy(throng_query* query);
/* As throng_broad_phase_find_overlaps and _find_hits; `test` may be NULL. */
THRONG_API throng_status throng_query_find_overlaps(throng_query* query,
                                                    const throng_broad_phase* broad_phase,
                                                    const throng_boxes* boxes);
THRONG_API const throng_pair* throng_query_overlaps(const throng_query* query, size_t* count);
THRONG_API throng_status throng_query_find_hits(throng_query* query,
                                                const throng_broad_phase* broad_phase,
                                                const throng_sweep* sweeps, size_t count, int which,
                                                const throng_boxes* filters, throng_sweep_test test,
                                                void* context);
THRONG_API const throng_sweep_hit* throng_query_hits(const throng_query* query, size_t* count);
/* As throng_broad_phase_raycast. `of_ray`: the filter values of the ray, which work as for two
 * objects; its mask is the layer mask; NULL for all. `filter` may be NULL. */
THRONG_API throng_status throng_query_raycast(throng_query* query,
                                              const throng_broad_phase* broad_phase,
                                              const float* origin, const float* direction,
                                              double max_distance, const throng_filter* of_ray,
                                              throng_object_filter filter, void* context,
                                              throng_ray_hit* hit);
/* The result of the last query, valid until the next. */
THRONG_API const throng_result* throng_query_result(const throng_query* query);
THRONG_API void throng_query_stop(throng_query* query);
THRONG_API size_t throng_query_memory_bytes(const throng_query* query);

/* Boxes of doubles, compared exactly as doubles. CPU only; takes 24 bytes more per box. */
typedef struct throng_double_boxes {
  size_t count;
  const double* corner[6]; /* as in throng_boxes */
  size_t stride_bytes;     /* a multiple of 8; 0: contiguous, as in throng_boxes */
  throng_strided group, mask, owner, world, is_static;
} throng_double_boxes;

/* Views without filters: six doubles per box in the order lower x, y, z, upper x, y, z; separate
 * corners of three doubles each. */
THRONG_API throng_double_boxes throng_double_boxes_packed(const double* boxes, size_t count);
THRONG_API throng_double_boxes throng_double_boxes_split(const double* lower, const double* upper,
                                                         size_t count);
/* As throng_find, throng_find_into and throng_consume. */
THRONG_API throng_status throng_find_doubles(throng_finder* finder, const throng_double_boxes* a,
                                             const throng_double_boxes* b);
THRONG_API throng_status throng_find_doubles_into(throng_finder* finder,
                                                  const throng_double_boxes* a,
                                                  const throng_double_boxes* b, throng_pair* out,
                                                  size_t capacity);
THRONG_API throng_status throng_consume_doubles(
    throng_finder* finder, const throng_double_boxes* a, const throng_double_boxes* b,
    int (*consumer)(void* context, const throng_pair* pairs, size_t count), void* context);
/* A shape in body coordinates, inflated by a ball of `radius`. Zeros: a point. Sphere: a box of
 * half extents 0; capsule: a box with one half extent. Half extents and radius may be infinite. */
enum { THRONG_SHAPE_BOX, THRONG_SHAPE_CONVEX };
typedef struct throng_shape {
  uint32_t kind;                     /* one of THRONG_SHAPE_* */
  float center[3];                   /* box */
  float half_extents[3];             /* box; >= 0 */
  float radius;                      /* >= 0 */
  uint32_t first_point, point_count; /* convex: the hull of these of the points; 0 points: empty */
} throng_shape;

/* Bodies: shapes with positions and rotations. */
typedef struct throng_bodies {
  size_t count;
  throng_strided position; /* float[3] */
  throng_strided rotation; /* float[4]: a unit quaternion x, y, z, w; absent: no rotation */
  /* float[3]; absent: none. The box covers the motion from `position` to position + displacement,
   * as needed for continuous collision detection. */
  throng_strided displacement;
  throng_strided shape;  /* uint32_t: an index into `shapes`; absent: one shape per body, or one for
                            all if shape_count is 1 */
  throng_strided shapes; /* throng_shape */
  size_t shape_count;
  throng_strided points; /* float[3], of convex shapes */
  size_t point_count;
} throng_bodies;

/* Writes the box of body i to the i-th box of `out`, boxes `stride_bytes` apart (a multiple of 4;
 * 0: contiguous), for bodies->count boxes, inflated by `margin` >= 0. A box contains the exact one
 * and is nearly always the tightest float box or one float larger. A position, rotation,
 * displacement, center or point that is not finite gives a box with a NaN. A body with an invalid
 * shape gets a box of NaN, and the call returns THRONG_BAD_SHAPE; after other errors nothing is
 * written. Of the options, threads, executor, isa and `stoppable` are used. The pairs of the finder
 * stay. */
THRONG_API throng_status throng_update_boxes(throng_finder* finder, const throng_bodies* bodies,
                                             float margin, throng_box* out, size_t stride_bytes);

/* Returns the smallest float box that contains the double box; three doubles each. */
THRONG_API throng_box throng_round_outward(const double* lower, const double* upper);
/* Returns the smallest float box that contains [center - half_size, center + half_size]; three
 * floats each. */
THRONG_API throng_box throng_box_from_center(const float* center, const float* half_size);

/* Vertices: three coordinates each, floats or doubles. */
typedef struct throng_vertices {
  size_t count;
  const float* floats;   /* the first vertex; NULL: doubles are given */
  const double* doubles; /* the same; NULL: floats are given */
  size_t stride_bytes; /* from one vertex to the next, a multiple of the size of one coordinate; 0:
                          contiguous */
} throng_vertices;

/* Triangles or edges: three or two indices of vertices each, counted from 0. */
typedef struct throng_elements {
  size_t count;
  const uint32_t* indices; /* those of the first element */
  size_t stride_bytes;     /* from one element to the next, a multiple of 4; 0: contiguous */
} throng_elements;

/* A triangle mesh. Triangles are closed sets of points; without area they are the segments or
 * points that they are. Vertices that no triangle uses may have any value. */
typedef struct throng_mesh {
  throng_vertices vertices;
  throng_elements triangles;
  /* NULL: none. 12 numbers, three rows of four: a vertex p is moved to (row . (p, 1)) before
   * the search, in doubles; the result is exact for the rounded vertices. */
  const double* transform;
  throng_strided group, mask, owner, world, is_static; /* per triangle; see throng_boxes */
} throng_mesh;

/* Views of contiguous arrays, without a transform and filters. `triangles` are three indices each.
 */
THRONG_API throng_mesh throng_mesh_packed(const float* vertices, size_t vertex_count,
                                          const uint32_t* triangles, size_t triangle_count);
THRONG_API throng_mesh throng_mesh_packed_doubles(const double* vertices, size_t vertex_count,
                                                  const uint32_t* triangles, size_t triangle_count);

/* Finds pairs of intersecting triangles, exactly, and keeps its memory from call to call. In one
 * mesh, two triangles form a pair if they have a common point outside of the convex hull of the
 * vertices that they share by index: without a shared vertex, any common point; with one, more than
 * this vertex; with two, more than this edge; with three, always. In two meshes, any common point.
 * Errors: THRONG_BAD_MESH, with first_invalid, the index of a triangle, and invalid_count. The
 * options nan and inverted are not used; margin must be 0. */
typedef struct throng_mesh_finder throng_mesh_finder;

/* As throng_finder_create and throng_finder_destroy. */
THRONG_API throng_mesh_finder* throng_mesh_finder_create(const throng_options* options);
THRONG_API void throng_mesh_finder_destroy(throng_mesh_finder* finder);

/* Here and below: `b` NULL: pairs within `a`, first < second; else of a triangle of `a` and one of
 * `b`. The forms are those of throng_find, throng_find_into and throng_consume. */
THRONG_API throng_status throng_mesh_finder_find(throng_mesh_finder* finder, const throng_mesh* a,
                                                 const throng_mesh* b);
THRONG_API throng_status throng_mesh_finder_find_into(throng_mesh_finder* finder,
                                                      const throng_mesh* a, const throng_mesh* b,
                                                      throng_pair* out, size_t capacity);
THRONG_API throng_status throng_mesh_finder_consume(
    throng_mesh_finder* finder, const throng_mesh* a, const throng_mesh* b,
    int (*consumer)(void* context, const throng_pair* pairs, size_t count), void* context);

/* Finds pairs of triangles at most `distance` apart, >= 0. In one mesh only triangles without a
 * shared vertex. Every pair within the distance is found; a pair that is farther apart by less than
 * one part in 10^12 may be found. */
THRONG_API throng_status throng_mesh_finder_find_within(throng_mesh_finder* finder,
                                                        const throng_mesh* a, const throng_mesh* b,
                                                        double distance);
THRONG_API throng_status throng_mesh_finder_find_within_into(throng_mesh_finder* finder,
                                                             const throng_mesh* a,
                                                             const throng_mesh* b, double distance,
                                                             throng_pair* out, size_t capacity);
THRONG_API throng_status throng_mesh_finder_consume_within(
    throng_mesh_finder* finder, const throng_mesh* a, const throng_mesh* b, double distance,
    int (*consumer)(void* context, const throng_pair* pairs, size_t count), void* context);

/* The pairs of the last call that stored them in the finder. */
THRONG_API const throng_pair* throng_mesh_finder_pairs(const throng_mesh_finder* finder,
                                                       size_t* count);

enum {
  THRONG_INTERSECTION_CROSSING, /* not coplanar; a common point is on no edge of either triangle */
  THRONG_INTERSECTION_TOUCHING, /* not coplanar otherwise */
  THRONG_INTERSECTION_COPLANAR, /* all six vertices lie in one plane */
  THRONG_INTERSECTION_NONE      /* they do not intersect */
};
/* The intersection of two triangles: a point, the ends of a segment, or the corners of a convex
 * polygon, in the order in which the first triangle winds. */
typedef struct throng_intersection {
  uint8_t kind;        /* one of THRONG_INTERSECTION_* */
  uint8_t point_count; /* 1 to 6; 0 of kind THRONG_INTERSECTION_NONE */
  double points[6][3]; /* the first point_count are set */
} throng_intersection;

/* Describes the intersection of each of `count` pairs in out[0 .. count-1]; `b` NULL: pairs within
 * `a`. Pass the meshes with the transforms of the search: a pair that is apart is of kind
 * THRONG_INTERSECTION_NONE. `kind` and `point_count` are exact; each coordinate is the exact one
 * rounded to nearest. Vertices that two triangles of one mesh share are points as any other. The
 * pairs of the finder stay. Of the options, threads, executor and `stoppable` are used.
 * THRONG_BAD_MESH also for a pair out of range. */
THRONG_API throng_status throng_mesh_finder_describe(throng_mesh_finder* finder,
                                                     const throng_mesh* a, const throng_mesh* b,
                                                     const throng_pair* pairs, size_t count,
                                                     throng_intersection* out);

/* The result of the last call, valid until the next. */
THRONG_API const throng_result* throng_mesh_finder_result(const throng_mesh_finder* finder);
THRONG_API void throng_mesh_finder_stop(throng_mesh_finder* finder); /* as throng_finder_stop */
THRONG_API size_t throng_mesh_finder_memory_bytes(const throng_mesh_finder* finder);

/* Candidates for contact and continuous collision detection. A moving mesh: each vertex moves from
 * `start` to `end` along a line. */
typedef struct throng_contact_mesh {
  throng_vertices start; /* all are elements; one of no edge and no face that is not finite takes no
                            part, see throng_result.inactive */
  throng_vertices end;   /* as many as `start`; zeros: nothing moves */
  throng_elements edges;
  throng_elements faces;
  int dimension;  /* 3 or 0: vertex-face and edge-edge candidates. 2: edge-vertex candidates; z and
                     faces are not used */
  unsigned rings; /* elements that share a vertex are no candidates; with n rings, neither are those
                     with two vertices that are joined by at most n edges */
  /* uint32_t per vertex, as in throng_boxes; one that is absent counts as all ones. Two elements
   * are candidates if any two of their vertices may collide. */
  throng_strided group, mask;
} throng_contact_mesh;

/* Keeps its memory from call to call. Errors: THRONG_BAD_MESH; first_invalid is the index of an
 * edge, or of a face if all edges are valid. The options nan, inverted and memory_cap_bytes are not
 * used; margin must be 0. */
typedef struct throng_contact_finder throng_contact_finder;

/* As throng_finder_create and throng_finder_destroy. */
THRONG_API throng_contact_finder* throng_contact_finder_create(const throng_options* options);
THRONG_API void throng_contact_finder_destroy(throng_contact_finder* finder);
/* Finds exactly the pairs of elements whose boxes overlap. The box of an element contains its
 * vertices at start and end, enlarged by `radius` on every side, rounded outward. `found` is the
 * number of candidates of all kinds. */
THRONG_API throng_status throng_contact_finder_find(throng_contact_finder* finder,
                                                    const throng_contact_mesh* mesh, double radius);
/* The candidates of the last call, valid until the next: vertex and face; two edges, first <
 * second; edge and vertex. `count` may be NULL. */
THRONG_API const throng_pair* throng_contact_finder_vertex_face(const throng_contact_finder* finder,
                                                                size_t* count);
THRONG_API const throng_pair* throng_contact_finder_edge_edge(const throng_contact_finder* finder,
                                                              size_t* count);
THRONG_API const throng_pair* throng_contact_finder_edge_vertex(const throng_contact_finder* finder,
                                                                size_t* count);
THRONG_API const throng_result* throng_contact_finder_result(const throng_contact_finder* finder);
THRONG_API void throng_contact_finder_stop(throng_contact_finder* finder);
THRONG_API size_t throng_contact_finder_memory_bytes(const throng_contact_finder* finder);

/* Returns a name such as "NaN box"; "unknown" for an invalid status. */
THRONG_API const char* throng_status_text(throng_status status);
THRONG_API const char* throng_version(void); /* "0.1.0" */
THRONG_API unsigned throng_c_version(void);  /* THRONG_C_VERSION of the library */

#ifdef __cplusplus
}
#endif
#endif
