/* throng.h: all pairs of overlapping boxes, for C and for languages that call C.
 *
 * Plain structs and opaque handles. Every call answers with a status; what went wrong, with the
 * number and the remedy, is in the handle's result. Nothing is printed, nothing is thrown. One
 * handle serves one thread at a time; different handles are independent. Strides are in bytes. What
 * a struct points to must outlive the call (of options: the handle). The rules of boxes and pairs
 * are those of the C++ door: boxes are closed, so touching counts; lower > upper on some axis makes
 * a box overlap nothing, or with THRONG_INVERTED_REFUSE is an error. A struct whose bytes are all 0
 * is empty or the default: no boxes, no filter; options alone need throng_options_init. */
#ifndef THRONG_THRONG_H
#define THRONG_THRONG_H

#include <stddef.h>
#include <stdint.h>

#include <throng/export.h>

/* Raised when a struct gains a field at its end, or a function is added. */
#define THRONG_C_VERSION 7

#ifdef __cplusplus
extern "C" {
#endif

typedef struct throng_box {
  float lower[3], upper[3]; /* world units */
} throng_box;

typedef struct throng_pair {
  uint32_t first, second; /* one set: first < second; two sets: an index of each */
} throng_pair;

typedef enum throng_status {
  THRONG_OK = 0,
  THRONG_BUFFER_TOO_SMALL, /* `found` is exact: raise the capacity to it */
  THRONG_STOPPED,          /* the consumer returned 0 */
  THRONG_NAN_BOX,          /* also a sweep with a NaN or an infinite direction; see first_invalid */
  THRONG_BAD_BOXES,        /* a coordinate is missing, or the stride is no multiple of 4 */
  THRONG_BAD_FILTER,       /* its stride does not fit its type, or a world is below -1 */
  THRONG_BAD_OPTION,       /* also: options that throng_options_init has not seen */
  THRONG_TOO_MANY_BOXES,   /* more than 2^32 - 2^16 in one set */
  THRONG_OUT_OF_MEMORY,    /* see bytes_needed */
  THRONG_MEMORY_CAP_TOO_SMALL,
  THRONG_UNSUPPORTED_ISA,
  THRONG_NO_DEVICE,
  THRONG_DEVICE_ERROR,
  THRONG_NOT_RESERVED, /* this one and the next two: of calls that C has not */
  THRONG_BAD_BODIES,
  THRONG_BAD_SHAPE,
  THRONG_BAD_ID,           /* not alive, or twice in one list; see first_invalid, invalid_count */
  THRONG_BUSY,             /* a call on the same handle is under way, whose result it keeps */
  THRONG_INVERTED_BOX = 20 /* lower > upper, where refused; see first_invalid, invalid_count */
} throng_status;

enum { THRONG_ALGORITHM_AUTOMATIC, THRONG_ALGORITHM_ALL_PAIRS, THRONG_ALGORITHM_GRID };
enum { THRONG_ORDER_ANY, THRONG_ORDER_CANONICAL };
enum { THRONG_BACKEND_AUTOMATIC, THRONG_BACKEND_CPU, THRONG_BACKEND_CUDA, THRONG_BACKEND_EMULATED };
enum { THRONG_NAN_REFUSE, THRONG_NAN_INACTIVE };
/* A box with lower > upper on some axis. Automatic: inactive, as an empty slot. Refuse: an error
 * that names the likely mistake, as boxes given as center and size; for programs without slots. */
enum { THRONG_INVERTED_AUTOMATIC, THRONG_INVERTED_REFUSE, THRONG_INVERTED_INACTIVE };
enum {
  THRONG_ISA_AUTOMATIC, /* the widest there is, or what the environment's THRONG_ISA names */
  THRONG_ISA_SCALAR,
  THRONG_ISA_SSE4,
  THRONG_ISA_AVX2,
  THRONG_ISA_AVX512,
  THRONG_ISA_NEON
};

/* One value a box; data NULL: absent. */
typedef struct throng_strided {
  const void* data;
  size_t stride_bytes; /* from one value to the next; 0: they lie side by side */
} throng_strided;

typedef struct throng_boxes {
  size_t count;
  const float* corner[6]; /* lower x, y, z, upper x, y, z of the first box; both z NULL: 2-D */
  size_t stride_bytes;    /* from one box to the next, of each coordinate; a multiple of 4; 0: they
                             lie side by side: 24 bytes where the six of a box do, 12 where the
                             three of a corner do, 4 where each coordinate has an array; of 2-D
                             boxes 16, 8 or 4 */
  /* Filters: a pair is reported when every given one allows it. */
  throng_strided group, mask; /* uint32_t: (group a & mask b) and (group b & mask a) nonzero */
  throng_strided owner;       /* int32_t: equal owners never pair, -1 is nobody's */
  throng_strided world;       /* int32_t: different worlds never pair, -1 meets every world */
  throng_strided is_static;   /* uint8_t: two nonzero never pair */
} throng_boxes;

/* Without filters: an array of boxes; lower and upper corners apart, three floats each. */
THRONG_API throng_boxes throng_boxes_packed(const throng_box* boxes, size_t count);
THRONG_API throng_boxes throng_boxes_split(const float* lower, const float* upper, size_t count);

typedef struct throng_options {
  size_t struct_bytes; /* set by throng_options_init */
  int algorithm, order, backend, nan;
  float margin;            /* boxes are compared as lower - margin, upper + margin; >= 0 */
  unsigned threads;        /* at most so many; 0: as many as the executor offers */
  size_t memory_cap_bytes; /* of throng_consume: all memory that may be taken; 0: no cap */
  /* Where work runs; run NULL: the default. run(self, count, task, context) calls task(context, i)
   * once for every i below count, on any threads, and returns when all have returned. */
  unsigned concurrency;
  void (*run)(void* self, unsigned count, void (*task)(void* context, unsigned index),
              void* context);
  void* run_self;
  /* Where memory comes from; NULL: the default. allocate returns NULL where there is none. */
  void* (*allocate)(void* self, size_t bytes, size_t alignment);
  void (*deallocate)(void* self, void* p, size_t bytes, size_t alignment);
  void* memory_self;
  int isa;       /* THRONG_ISA_ */
  int stoppable; /* 1: throng_finder_stop and throng_broad_phase_stop end a call; on a GPU the
                    stream is then waited for after each stage */
  int inverted;  /* THRONG_INVERTED_ */
} throng_options;

/* All defaults: automatic, any order, NaN refused, all threads. */
#define throng_options_init(options) throng_options_init_sized((options), sizeof *(options))
THRONG_API void throng_options_init_sized(throng_options* options, size_t struct_bytes);

typedef struct throng_result {
  throng_status status;
  uint64_t found;   /* pairs there are, exact even where there was no room */
  uint64_t written; /* pairs written or handed to the consumer */
  uint64_t inactive;
  uint64_t comparisons;
  uint64_t first_invalid, invalid_count, bytes_needed;
  double total_ms, plan_ms, bin_ms, find_ms, order_ms;
  const char* plan;            /* why the planner chose what it did */
  const char* message;         /* what went wrong, and the remedy; "" where nothing did */
  int backend, algorithm, isa; /* that answered, by the names above */
  unsigned threads;
  uint64_t visited; /* cells, columns, records and tree nodes that were looked into, beside
                       comparisons; 0 of a search on a GPU, and on one that is emulated */
} throng_result;

/* Finds pairs, frame after frame, and keeps its memory from one to the next. A call on NULL, which
 * stands for a handle that there was no memory for, answers THRONG_OUT_OF_MEMORY. */
typedef struct throng_finder throng_finder;

/* options NULL: the defaults. NULL where there is no memory. Wrong options are told by the first
 * call. */
THRONG_API throng_finder* throng_finder_create(const throng_options* options);
THRONG_API void throng_finder_destroy(throng_finder* finder); /* NULL is taken */

/* Pairs of `a`, or with `b` not NULL of a box of `a` and one of `b`, into the finder's own memory.
 */
THRONG_API throng_status throng_find(throng_finder* finder, const throng_boxes* a,
                                     const throng_boxes* b);
/* Those pairs: good until the finder's next call. `count` may be NULL. */
THRONG_API const throng_pair* throng_finder_pairs(const throng_finder* finder, size_t* count);

/* Pairs into out[0 .. capacity-1]. THRONG_BUFFER_TOO_SMALL: the first `written` are valid, and none
 * under canonical order. */
THRONG_API throng_status throng_find_into(throng_finder* finder, const throng_boxes* a,
                                          const throng_boxes* b, throng_pair* out, size_t capacity);

/* Pairs in blocks, one call at a time; nothing else is stored. consumer returns 0 to stop. */
THRONG_API throng_status throng_consume(
    throng_finder* finder, const throng_boxes* a, const throng_boxes* b,
    int (*consumer)(void* context, const throng_pair* pairs, size_t count), void* context);

/* Of the last call; good until the next. */
THRONG_API const throng_result* throng_finder_result(const throng_finder* finder);
/* From any thread: the call that is under way, of options that are `stoppable`, ends soon, with
 * THRONG_STOPPED and nothing found. Where none is under way nothing happens. */
THRONG_API void throng_finder_stop(throng_finder* finder);
/* All that it holds. */
THRONG_API size_t throng_finder_memory_bytes(const throng_finder* finder);

/* Objects that live: it keeps them from frame to frame, and tells which pairs began and which
 * ended. A call that fails changes nothing. `found` of a call on objects is how many there are
 * then, of throng_broad_phase_update how many pairs live. Of the options algorithm, order and
 * memory_cap_bytes play no part, and backend must be automatic or cpu. */
typedef struct throng_broad_phase throng_broad_phase;

/* A pair for as long as it lives, first < second. The slot is its own meanwhile: a small number, a
 * place for what an engine keeps of it, as contacts. */
typedef struct throng_live_pair {
  uint32_t first, second, slot;
} throng_live_pair;

/* What one object pairs with; throng_boxes holds the same by arrays. */
typedef struct throng_filter {
  uint32_t group, mask;
  int32_t owner, world;
  uint8_t is_static;
} throng_filter;

/* A box that goes straight by `by` in the time from 0 to 1. A ray is a point that does. */
typedef struct throng_sweep {
  throng_box box;
  float by[3];
} throng_sweep;

/* Of sweep number `sweep`: when it first touches the object, 0 where it does from the start. */
typedef struct throng_sweep_hit {
  uint32_t sweep, object;
  double time;
} throng_sweep_hit;

enum {
  THRONG_HITS_ALL,  /* every object on the way, by id */
  THRONG_HITS_FIRST /* the one that is met first; of several at once that of the lowest id */
};

/* As throng_finder_create and throng_finder_destroy. */
THRONG_API throng_broad_phase* throng_broad_phase_create(const throng_options* options);
THRONG_API void throng_broad_phase_destroy(throng_broad_phase* broad_phase);
/* Makes `to` what `from` is: ids, slots, and what the last update told. */
THRONG_API throng_status throng_broad_phase_copy(throng_broad_phase* to,
                                                 const throng_broad_phase* from);

/* An object for each box, with the filters of the view; writes boxes->count ids: 0, 1, 2, ... where
 * none was removed. The id of a removed object is given away again only after an update has told
 * which pairs its removal ended. */
THRONG_API throng_status throng_broad_phase_add(throng_broad_phase* broad_phase,
                                                const throng_boxes* boxes, uint32_t* ids);
/* An id that is not alive, or twice in one list, is THRONG_BAD_ID, here and below. */
THRONG_API throng_status throng_broad_phase_remove(throng_broad_phase* broad_phase,
                                                   const uint32_t* ids, size_t count);
/* New boxes for boxes->count objects; of several calls before an update the last wins. Filters are
 * not looked at. */
THRONG_API throng_status throng_broad_phase_move(throng_broad_phase* broad_phase,
                                                 const uint32_t* ids, const throng_boxes* boxes);
/* The same for all objects: a box for every id below throng_broad_phase_id_limit. It finds out
 * which differ. */
THRONG_API throng_status throng_broad_phase_move_all(throng_broad_phase* broad_phase,
                                                     const throng_boxes* boxes);
/* New filters for filters->count objects, whose boxes are not looked at; a filter that is absent
 * stays as it was. */
THRONG_API throng_status throng_broad_phase_set_filters(throng_broad_phase* broad_phase,
                                                        const uint32_t* ids,
                                                        const throng_boxes* filters);
/* Adds by[0], by[1], by[2] to all corners, rounded to nearest. */
THRONG_API throng_status throng_broad_phase_shift_origin(throng_broad_phase* broad_phase,
                                                         const float* by);

/* Finds the pairs that began and ended since the last update. */
THRONG_API throng_status throng_broad_phase_update(throng_broad_phase* broad_phase);
/* What the last update told, sorted by first, then second, and all pairs there are since; good
 * until the next update. `count` may be NULL. */
THRONG_API const throng_live_pair* throng_broad_phase_begun(const throng_broad_phase* broad_phase,
                                                            size_t* count);
THRONG_API const throng_live_pair* throng_broad_phase_ended(const throng_broad_phase* broad_phase,
                                                            size_t* count);
THRONG_API const throng_live_pair* throng_broad_phase_pairs(throng_broad_phase* broad_phase,
                                                            size_t* count);

/* Those of one object, sorted by the other one: returns how many there are, and writes them if
 * `capacity` is enough; if not, what is in `out` then is of no use. Several threads may call it at
 * once, and beside each throng_query. `out` may be NULL where `capacity` is 0. */
THRONG_API size_t throng_broad_phase_pairs_of(const throng_broad_phase* broad_phase, uint32_t id,
                                              throng_live_pair* out, size_t capacity);

/* Questions to the objects as they were given last, with an update since or without. What they
 * find is good until the next question. The margin plays no part. */

/* All objects that each box overlaps: first is the number of the box, second the object; sorted. */
THRONG_API throng_status throng_broad_phase_find_overlaps(throng_broad_phase* broad_phase,
                                                          const throng_boxes* boxes);
THRONG_API const throng_pair* throng_broad_phase_overlaps(const throng_broad_phase* broad_phase,
                                                          size_t* count);
/* The objects that each sweep meets, sorted by sweep; `which` is of THRONG_HITS_. `filters` may be
 * NULL; else it has `count` values a filter, and its boxes are not looked at. */
THRONG_API throng_status throng_broad_phase_find_hits(throng_broad_phase* broad_phase,
                                                      const throng_sweep* sweeps, size_t count,
                                                      int which, const throng_boxes* filters);
THRONG_API const throng_sweep_hit* throng_broad_phase_hits(const throng_broad_phase* broad_phase,
                                                           size_t* count);

/* 1 or 0. */
THRONG_API int throng_broad_phase_is_alive(const throng_broad_phase* broad_phase, uint32_t id);
/* The box as it was given last; THRONG_BAD_ID, and `box` untouched, where the id is not alive,
 * THRONG_BAD_BOXES where `box` is NULL. */
THRONG_API throng_status throng_broad_phase_box(const throng_broad_phase* broad_phase, uint32_t id,
                                                throng_box* box);
/* Its filters, likewise; THRONG_BAD_FILTER where `filter` is NULL. */
THRONG_API throng_status throng_broad_phase_filter(const throng_broad_phase* broad_phase,
                                                   uint32_t id, throng_filter* filter);
THRONG_API uint64_t throng_broad_phase_object_count(const throng_broad_phase* broad_phase);
THRONG_API uint64_t throng_broad_phase_pair_count(const throng_broad_phase* broad_phase);
/* All ids, and all slots of pairs that live or ended in the last update, are below these. */
THRONG_API uint64_t throng_broad_phase_id_limit(const throng_broad_phase* broad_phase);
THRONG_API uint64_t throng_broad_phase_slot_limit(const throng_broad_phase* broad_phase);
/* Of the last call that answered with a status, but for throng_broad_phase_box and _filter; good
 * until the next. */
THRONG_API const throng_result* throng_broad_phase_result(const throng_broad_phase* broad_phase);

/* As throng_finder_stop; an update or question that is stopped changes nothing. */
THRONG_API void throng_broad_phase_stop(throng_broad_phase* broad_phase);
THRONG_API size_t throng_broad_phase_memory_bytes(const throng_broad_phase* broad_phase);

/* The same questions from several threads at once, each by a handle of its own, while no function
 * is called of the broad phase but those that take it as const: others are refused then
 * (THRONG_BUSY), and questions while one of those is under way. No options hold but `nan`, `isa`,
 * `threads`, the executor, memory and `stoppable`. */
typedef struct throng_query throng_query;
/* Whether a sweep meets the object itself, of whose box it is known that it meets it at `time`:
 * returns when it does, or more than 1: never. Earlier than `time` counts as `time`. It may be
 * asked several times of an object, in any order, by each thread that answers; it must say the same
 * each time, and must not call the broad phase or the query that asks. */
typedef double (*throng_sweep_test)(void* context, uint32_t sweep, uint32_t object, double time);

/* As throng_finder_create and throng_finder_destroy. */
THRONG_API throng_query* throng_query_create(const throng_options* options);
THRONG_API void throng_query_destroy(throng_query* query);
/* As those of a broad phase; `test` may be NULL. */
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
/* Of the last question; good until the next. */
THRONG_API const throng_result* throng_query_result(const throng_query* query);
THRONG_API void throng_query_stop(throng_query* query);
THRONG_API size_t throng_query_memory_bytes(const throng_query* query);

/* Boxes of doubles: the pairs are exactly those of the boxes that overlap as doubles, though floats
 * could not tell. On the CPU alone; 24 bytes a box are taken more. */
typedef struct throng_double_boxes {
  size_t count;
  const double* corner[6]; /* as of throng_boxes */
  size_t stride_bytes;     /* a multiple of 8; 0: they lie side by side, as of throng_boxes */
  throng_strided group, mask, owner, world, is_static;
} throng_double_boxes;

/* Without filters: six doubles a box, lower x, y, z, upper x, y, z; corners apart, three each. */
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
/* The smallest float box that contains the double one: three doubles each. */
THRONG_API throng_box throng_round_outward(const double* lower, const double* upper);
/* center - half_size to center + half_size, rounded outward: three floats each. */
THRONG_API throng_box throng_box_from_center(const float* center, const float* half_size);

/* Its name, as "NaN box"; "unknown" for what is no status. */
THRONG_API const char* throng_status_text(throng_status status);
THRONG_API const char* throng_version(void); /* "0.1.0" */
THRONG_API unsigned throng_c_version(void);  /* of the library; see THRONG_C_VERSION */

#ifdef __cplusplus
}
#endif
#endif
