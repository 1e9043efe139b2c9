/*
 * compare.h - what the files of the comparison of two groups share.
 */
#ifndef SRNF_STATS_COMPARE_H
#define SRNF_STATS_COMPARE_H

#include <stdatomic.h>

#include "stats.h"
#include "subjects.h"

/* The linear model of a comparison (compare_design.c). */
struct compare_design {
    size_t n, nuisance; /* subjects; columns of U: the constant and the covariates */
    double *basis;      /* [nuisance][n] U: orthonormal, the constant first */
    double *contrast;   /* [n] what U leaves of the group's indicator */
    double squared;     /* its square */
};

/* Orthonormalizes covariates and group. SRNF_EINVAL with a sentence where they depend on one
   another, or where too few degrees of freedom are left. */
SRNF_CHECKED int compare_design_create(struct compare_design *design, size_t n, const int *group,
                                       size_t n_covariates, const double *covariates,
                                       struct srnf_error *error);
void compare_design_clear(struct compare_design *design);
/* Takes out of data, double[n][m], what U explains. */
void compare_design_residuals(const struct compare_design *design, size_t m, double *data);
/* Degrees of freedom of the residuals. */
static inline size_t compare_design_freedom(const struct compare_design *design)
{
    return design->n - design->nuisance - 1;
}

/* What is compared: as given, or averaged over the members of each subject (compare_subjects.c). */
struct compare_averages {
    size_t n;
    const double *q, *covariates;
    const int *group;
    double *memory; /* of averages; NULL where the others are borrowed */
    int *groups;
    size_t count;              /* coefficients of a surface */
    const double *const *near; /* [n] surfaces of the fields, or near them; NULL: none are known */
    const double **starts;     /* its memory, as memory */
    double *surfaces;
};
/* Turns members into subjects. size: doubles of a field. SRNF_EINVAL: a subject is in both groups.
   To be cleared in any case. */
SRNF_CHECKED int compare_average(const struct subjects *subjects, size_t size, size_t n_covariates,
                                 struct compare_averages *averages, struct srnf_error *error);
void compare_averages_clear(struct compare_averages *averages);
/* The kind of each, [n]: of one kind are those of one group with the same covariates, which must be
   numbers. Returns how many kinds there are. Compares n^2 / 2 pairs at most. */
size_t compare_kinds(const struct compare_averages *averages, size_t n_covariates, size_t *kind);

/* A permutation of 0 .. n-1 from a seed and its number; number 0 is the identity. */
void compare_permutation(uint64_t seed, uint64_t number, size_t n, uint32_t *order);
/* The order [n] of one of all relabellings where those are taken, and else of such a permutation;
   number 0 is the identity. source: [2 n] of scratch. */
void compare_relabel(const struct exchange *exchange, uint64_t seed, uint64_t number, size_t n,
                     size_t *source, uint32_t *order);

/* ---- The run --------------------------------------------------------------------------------- */

struct compare_run {
    const struct srnf_sht *sht;
    size_t n, points, permutations;
    uint64_t seed;
    struct compare_design design;
    struct exchange exchange;
    struct stats_embedding embedding;
    const double *const *near; /* [n] surfaces to search from, or NULL */
    const int *group;          /* [n] */
    double *q;                 /* [n][3][P] residual SRNFs times the roots of the weights */
    double *vectors;           /* [n][3][P] residual displacements */
    double *gram;              /* [n][n] of q */
    double *squares;           /* [P][6] Y'Y: xx xy xz yy yz zz */
    double total;              /* trace of gram; 0: nothing but rounding */
    double observed;           /* F of all nodes together */
    double *largest;    /* [permutations + 1] of T^2 over the map; the first is the observed */
    atomic_uint global; /* permutations as far apart */
    atomic_uint tied;   /* those that are as far, also all over the map, whatever the data */
    atomic_uint *count; /* [P] permutations with as large a T^2 */
    struct srnf_comparison *out;
};

/* ---- compare_blocks.c: permutations, so many at a time --------------------------------------- */

#define COMPARE_BLOCK ((size_t)32) /* permutations of one task */
struct compare_block {
    size_t first, count; /* numbers of the permutations */
    uint32_t *order;     /* [n] */
    size_t *source;      /* [n], and as many of scratch */
    double *contrasts;   /* [count][nuisance][n] */
    double *rows;        /* [count][nuisance][3][P] */
};
/* SRNF_ENOMEM; to be closed in any case. */
SRNF_CHECKED int compare_block_open(struct compare_block *block, const struct compare_run *run,
                                    size_t first, size_t count);
void compare_block_close(struct compare_block *block);
/* T^2 at a node. rows: the products of c and of the P'u with Y, one after another, [3][P] each. */
double compare_hotelling(const struct compare_run *run, const double *rows, size_t node);
/* |b|^2 of the SRNFs for the contrast c. */
double compare_square(const struct compare_run *run, const double *c);
/* F of the SRNFs. columns: [nuisance][n] the contrast, and the P'u. */
double compare_global(const struct compare_run *run, const double *columns);
/* Counts what one block of permutations gives: for stats_run. */
SRNF_CHECKED int compare_block_run(void *argument, size_t index, const struct srnf_context *context,
                                   struct srnf_error *error);

#endif
