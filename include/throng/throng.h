/* throng.h: all pairs of overlapping boxes, for C and for languages that call C.
 *
 * Plain structs and opaque handles. Every call answers with a status; what went wrong, with the
 * number and the remedy, is in the handle's result. Nothing is printed, nothing is thrown. One
 * handle serves one thread at a time; different handles are independent. Strides are in bytes. What
 * a struct points to must outlive the call (of options: the handle). The rules of boxes and pairs
 * are those of the C++ door: boxes are closed, so touching counts; lower > upper on some axis makes
 * a box overlap nothing. */
#ifndef THRONG_THRONG_H
#define THRONG_THRONG_H

#include <stddef.h>
#include <stdint.h>

/* Raised when a struct gains a field at its end, or a function is added. */
#define THRONG_C_VERSION 1

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
  THRONG_NAN_BOX,          /* see first_invalid, invalid_count */
  THRONG_BAD_BOXES,        /* a coordinate is missing, or the stride is odd */
  THRONG_BAD_FILTER,       /* its stride is odd, or a world is below -1 */
  THRONG_BAD_OPTION,       /* also: options that throng_options_init has not seen */
  THRONG_TOO_MANY_BOXES,   /* more than 2^32 - 2^16 in one set */
  THRONG_OUT_OF_MEMORY,    /* see bytes_needed */
  THRONG_MEMORY_CAP_TOO_SMALL,
  THRONG_UNSUPPORTED_ISA,
  THRONG_NO_DEVICE,
  THRONG_DEVICE_ERROR
} throng_status;

enum { THRONG_ALGORITHM_AUTOMATIC, THRONG_ALGORITHM_ALL_PAIRS, THRONG_ALGORITHM_GRID };
enum { THRONG_ORDER_ANY, THRONG_ORDER_CANONICAL };
enum { THRONG_BACKEND_AUTOMATIC, THRONG_BACKEND_CPU, THRONG_BACKEND_CUDA, THRONG_BACKEND_EMULATED };
enum { THRONG_NAN_REFUSE, THRONG_NAN_INACTIVE };

/* One value a box; data NULL: absent. */
typedef struct throng_strided {
  const void* data;
  size_t stride_bytes;
} throng_strided;

typedef struct throng_boxes {
  size_t count;
  const float* corner[6]; /* lower x, y, z, upper x, y, z of the first box; both z NULL: 2-D */
  size_t stride_bytes;    /* from one box to the next, of each coordinate; a multiple of 4 */
  /* Filters: a pair is reported when every given one allows it. */
  throng_strided group, mask; /* uint32_t: (group a & mask b) and (group b & mask a) nonzero */
  throng_strided owner;       /* int32_t: equal owners never pair, -1 is nobody's */
  throng_strided world;       /* int32_t: different worlds never pair, -1 meets every world */
  throng_strided is_static;   /* uint8_t: two nonzero never pair */
} throng_boxes;

/* Without filters: an array of boxes; lower and upper corners apart, three floats each. */
throng_boxes throng_boxes_packed(const throng_box* boxes, size_t count);
throng_boxes throng_boxes_split(const float* lower, const float* upper, size_t count);

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
} throng_options;

/* All defaults: automatic, any order, NaN refused, all threads. */
#define throng_options_init(options) throng_options_init_sized((options), sizeof *(options))
void throng_options_init_sized(throng_options* options, size_t struct_bytes);

typedef struct throng_result {
  throng_status status;
  uint64_t found;   /* pairs there are, exact even where there was no room */
  uint64_t written; /* pairs written or handed to the consumer */
  uint64_t inactive;
  uint64_t comparisons;
  uint64_t first_invalid, invalid_count, bytes_needed;
  double total_ms, plan_ms, bin_ms, find_ms, order_ms;
  const char* plan;    /* why the planner chose what it did */
  const char* message; /* what went wrong, and the remedy; "" where nothing did */
} throng_result;

typedef struct throng_finder throng_finder;

/* options NULL: the defaults. NULL where there is no memory. Wrong options are told by the first
 * call. */
throng_finder* throng_finder_create(const throng_options* options);
void throng_finder_destroy(throng_finder* finder); /* NULL is taken */

/* Pairs of `a`, or with `b` not NULL of a box of `a` and one of `b`, into the finder's own memory.
 */
throng_status throng_find(throng_finder* finder, const throng_boxes* a, const throng_boxes* b);
/* Those pairs: good until the finder's next call. `count` may be NULL. */
const throng_pair* throng_finder_pairs(const throng_finder* finder, size_t* count);

/* Pairs into out[0 .. capacity-1]. THRONG_BUFFER_TOO_SMALL: the first `written` are valid, and none
 * under canonical order. */
throng_status throng_find_into(throng_finder* finder, const throng_boxes* a, const throng_boxes* b,
                               throng_pair* out, size_t capacity);

/* Pairs in blocks, one call at a time; nothing else is stored. consumer returns 0 to stop. */
throng_status throng_consume(throng_finder* finder, const throng_boxes* a, const throng_boxes* b,
                             int (*consumer)(void* context, const throng_pair* pairs, size_t count),
                             void* context);

/* Of the last call; good until the next. */
const throng_result* throng_finder_result(const throng_finder* finder);

const char* throng_status_text(throng_status status); /* "nan_box" */
const char* throng_version(void);                     /* "0.1.0" */
unsigned throng_c_version(void);                      /* of the library; see THRONG_C_VERSION */

#ifdef __cplusplus
}
#endif
#endif
