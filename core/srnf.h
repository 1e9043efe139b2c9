/*
 * srnf.h - the one public header of libsrnf: elastic shape analysis of closed surfaces of genus
 * zero by square-root normal fields (SRNFs).
 *
 * Source of the method: Q. Xie, I. Jermyn, S. Kurtek, A. Srivastava, "Numerical Inversion of SRNFs
 * for Efficient Elastic Shape Analysis of Star-Shaped Objects", ECCV 2014; "the paper" below. The
 * glossary of symbols and the derivations that go beyond the paper are in core/README.md.
 *
 * CONVENTIONS, used everywhere and never departed from
 *
 *   Sphere      colatitude theta in (0, pi), longitude phi in [0, 2 pi),
 *               e = (sin theta cos phi, sin theta sin phi, cos theta). Integrals are over the area
 *               of the unit sphere, 4 pi in all.
 *   Grid        n_theta rows of n_phi equispaced longitudes phi_j = 2 pi j / n_phi. Rows run from
 *               north to south: Gauss-Legendre nodes, or equiangular rows
 *               theta_i = pi i / (n_theta - 1) with the poles. The working grid of degree L has
 *               n_theta = ceil(3 (L + 1) / 2), n_phi = 2 n_theta.
 *   Basis       real orthonormal spherical harmonics Y_lm, 0 <= l <= L, at index l*l + l + m:
 *               m > 0 carries cos(m phi), m < 0 sin(|m| phi), no Condon-Shortley sign.
 *   Surface     f : S^2 -> R^3 as double[3][(L+1)^2]: the x block, the y block, the z block.
 *   Fields      scalar fields on the grid as double[n_theta][n_phi]; a batch of b fields is
 *               double[b][n_theta][n_phi]. A vector field is a batch of three.
 *   Normal      n = f_theta x (f_phi / sin theta), outward for f = e.
 *   SRNF        q = n / |n|^(1/2), the zero vector where n = 0; integral of |q|^2 = area.
 *   Action      a rotation O acts as f -> O f and q -> O q; translations leave q unchanged;
 *               Q(-f) = Q(f).
 *
 * The library is pure: no input or output, no global state, no clock, no random device, no locale,
 * no printing. Seeds, threads, progress and cancellation come in as arguments. Every function may
 * be called from any number of threads at once on distinct outputs; objects described as immutable
 * may be shared. The one exception lies in FFTW: see srnf_sht_create.
 */
#ifndef SRNF_H
#define SRNF_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

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
    SRNF_ENUMERIC = -14,     /* a factorisation, an eigensolver or a line search broke down */
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

/* What a long computation gets from its caller. NULL, or NULL members, mean: silent, not
   cancellable, one thread. parallel_for must call body(argument, i) once for each i in [0, count),
   in any order, on any threads, and return when all calls have returned; results never depend on
   how it spreads them. Where bodies report or ask for cancellation, progress and canceled are
   called from those threads. */
struct srnf_context {
    void *user;
    void (*progress)(void *user, double fraction, const char *message);
    bool (*canceled)(void *user);
    void (*parallel_for)(void *user, size_t count, void (*body)(void *argument, size_t index),
                         void *argument);
    double (*seconds)(void *user); /* a monotonic clock, for histories; NULL: all 0 */
    /* Numbers that are dear to compute and that an earlier attempt at the same computation has
       left, by the series that they belong to and their place in it. recall: whether there is one.
       keep: here is one. Both from any thread; NULL: nothing is kept. Kept are the distances of
       registered pairs, by srnf_distances, and by srnf_metric_distances for srnf and srm. */
    bool (*recall)(void *user, uint64_t series, uint64_t index, double *value);
    void (*keep)(void *user, uint64_t series, uint64_t index, double value);
};

/* ---- Memory ---------------------------------------------------------------------------------- */

/* All allocation of the library goes through these two (core/memory.c): count * size bytes, zeroed,
   aligned to 64 bytes; NULL when that overflows or is not to be had. A test replaces that file to
   make the n-th allocation fail. */
void *srnf_alloc(size_t count, size_t size) __attribute__((malloc));
void srnf_free(void *pointer);

/* ---- The rest, by subject -------------------------------------------------------------------- */

#include "srnf/sphere.h"
#include "srnf/mesh.h"
#include "srnf/surface.h"
#include "srnf/shape.h"
#include "srnf/transport.h"
#include "srnf/register.h"
#include "srnf/stats.h"
#include "srnf/subjects.h"
#include "srnf/groups.h"
#include "srnf/pullback.h"
#include "srnf/classify.h"
#include "srnf/typicality.h"

#ifdef __cplusplus
}
#endif

#endif
