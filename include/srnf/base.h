/*
 * base.h - what every part of libsrnf shares: version, status codes, the context of a long
 * computation, memory. Conventions, units and symbols: srnf.h.
 */
#ifndef SRNF_BASE_H
#define SRNF_BASE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

#define SRNF_CHECKED __attribute__((warn_unused_result))

#define SRNF_VERSION "0.1.0"

/* Degrees the library is built and tested for. */
#define SRNF_DEGREE_MIN 4
#define SRNF_DEGREE_MAX 127

/* What srnf_sht_create accepts: no more than memory and the recurrences are fit for. */
#define SRNF_TRANSFORM_DEGREE_MAX ((size_t)1000)
#define SRNF_GRID_ROWS_MAX ((size_t)4096)

/* ---- Status ---------------------------------------------------------------------------------- */

/* 0 is success, negative values are errors (outputs are then untouched or freed), positive ones
   warnings (outputs are valid, and the result says what is wrong with them). */
enum srnf_status {
    SRNF_OK = 0,
    SRNF_ENOMEM = -1,        /* an allocation failed */
    SRNF_EINVAL = -2,        /* an argument is outside its documented range */
    SRNF_ELIMIT = -3,        /* the input is larger than the limits given */
    SRNF_ECANCELED = -4,     /* the caller asked to stop */
    SRNF_EFORMAT = -5,       /* the bytes are in no known mesh format */
    SRNF_EPARSE = -6,        /* the bytes break the rules of their format */
    SRNF_ENOT_CLOSED = -7,   /* the mesh has a boundary */
    SRNF_ENOT_MANIFOLD = -8, /* an edge with three faces or more, or a vertex that joins two fans */
    SRNF_ENOT_ORIENTED = -9, /* neighbouring faces disagree about the outside */
    SRNF_ECOMPONENTS = -10,  /* more than one connected component */
    SRNF_EGENUS = -11,       /* Euler characteristic other than 2 */
    SRNF_EDEGENERATE = -12,  /* no area, no volume, or a face that names one vertex twice */
    SRNF_ENOT_STAR = -13,    /* no point sees the whole surface, or not from the given centre */
    SRNF_ENUMERIC = -14,     /* a factorization, an eigensolver or a line search broke down */
    SRNF_EUNMATCHED = -15,   /* landmarks were not met by any warp that keeps orientation */
    SRNF_EIO = -16,          /* scratch that the caller has lent cannot be written or read */
    SRNF_WNOT_CONVERGED = 1, /* stopped before the tolerance was reached */
};

/* One sentence for each status, never NULL; static storage. */
const char *srnf_strerror(int status);

/* Where and why a call failed. Optional everywhere (NULL is accepted); untouched on success. */
struct srnf_error {
    int status;
    int64_t element;   /* the first offending face, vertex or byte, as message says; -1: none */
    char message[240]; /* one sentence in English that names the member, face or limit */
};

/* ---- Progress, cancellation, threads --------------------------------------------------------- */

struct srnf_field_search;  /* srnf/register.h */
struct srnf_pair_search;   /* srnf/stats.h */
#define SRNF_SEARCH_HERE 1 /* the caller has no other machines for a search */

/* What a long computation gets from its caller. NULL, or NULL members, mean: silent, not
   cancellable, one thread. parallel_for must call body(argument, i) once for each i in [0, count),
   in any order, on any threads, and return when all calls have returned; results never depend on
   how it spreads them. progress and canceled are called from those threads too.
   canceled is asked after every few milliseconds of work, at any degree and for any mesh. Once it
   has said true it must go on saying so: loops deep inside then break off and leave what they were
   computing unfinished, and it is the function that was called that asks once more before it
   returns, and returns SRNF_ECANCELED. */
struct srnf_context {
    void *user;
    void (*progress)(void *user, double fraction, const char *message);
    bool (*canceled)(void *user); /* once it is true it stays true */
    void (*parallel_for)(void *user, size_t count, void (*body)(void *argument, size_t index),
                         void *argument);
    double (*seconds)(void *user); /* a monotonic clock, for histories; NULL: all 0 */
    /* Parts of a computation that are dear and that an earlier attempt at the same has left:
       `count` doubles, by the series that they belong to and their place in it. recall: whether
       there is such a part of that many; then into values. keep: here is one, or, with count 0 and
       values NULL, the parts of the series are wanted no more. Both from any thread; NULL: nothing
       is kept. Kept are the distances of registered pairs (srnf_distances, srnf_metric_distances
       for srnf and srm), the first registrations of srnf_karcher_mean, those of
       srnf_folds_compare of one round, and the reconstructions and samples of srnf_model_quality.
       What is recalled has the bits that were kept, so that the result has those that it would have
       without. */
    bool (*recall)(void *user, uint64_t series, uint64_t index, size_t count, double *values);
    void (*keep)(void *user, uint64_t series, uint64_t index, size_t count, const double *values);
    /* Registers surfaces to a field where the caller has other machines for it: for each, on the
       calling thread and in any order, calls search->take once with what
       srnf_register_to_field_landmarks finds of it, or search->unmet where its landmarks cannot be
       met. Asked by srnf_karcher_mean and
       srnf_folds_compare, never inside parallel_for. Returns SRNF_OK; SRNF_SEARCH_HERE, before it
       took any; SRNF_ECANCELED, also where the caller has failed in its own way; what take
       or unmet has returned. NULL: as SRNF_SEARCH_HERE. */
    int (*search)(void *user, const struct srnf_field_search *search, struct srnf_error *error);
    /* The same for distances of pairs: fills pairs->distances with those of srnf_distances, and
       returns as search does. Asked by srnf_nearest_neighbours, which then recalls and keeps
       nothing. */
    int (*measure)(void *user, const struct srnf_pair_search *pairs, struct srnf_error *error);
};

/* ---- Memory ---------------------------------------------------------------------------------- */

/* All allocation of the library goes through these two (core/memory.c): count * size bytes, zeroed,
   aligned to 64 bytes; NULL when that overflows or is not to be had. A test replaces that file to
   make the n-th allocation fail. */
void *srnf_alloc(size_t count, size_t size) __attribute__((malloc));
void srnf_free(void *pointer);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
