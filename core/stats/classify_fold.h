/*
 * classify_fold.h - the normal distributions of one fold, for every number of features at once, and
 * how likely a subject's members are under them (classify_fold.c, which has the formulae).
 */
#ifndef SRNF_STATS_CLASSIFY_FOLD_H
#define SRNF_STATS_CLASSIFY_FOLD_H

#include "classify.h"

#define CLASSIFY_KINDS 2 /* of covariances */
enum classify_kind { CLASSIFY_POOLED = 0, CLASSIFY_OWN = 1 };

/* Members of one class in a set: how many, of how many subjects, and the sum of their squares. */
struct classify_tally {
    double members, subjects, squares;
};

/* What taking members out does to a scatter. */
struct classify_removal {
    size_t r, rank;  /* members; leading features for which M is positive */
    double *z;       /* [r][d] L^-1 (x - m) */
    double *factor;  /* [d][r][r] lower factors of M, with 1, 2, .. features */
    double *log_det; /* [d] of M and K together */
    double *along;   /* [2][r] Z'z, and scratch */
};

struct classify_fold {
    const struct subjects *subjects;
    size_t n, left_out, classes, d, offset; /* d features, offset of them not components */
    const size_t *labels;
    double *memory;
    double *x;      /* [n][d] */
    double *mean;   /* [classes][d] of the training members */
    double *moved;  /* [classes][d] without the subject that is judged */
    double *factor; /* [classes + 1][d][d] lower factors; the last: pooled */
    double *z;      /* [d] */
    double
        *table; /* [largest][CLASSIFY_KINDS][d][classes] log-likelihoods of a subject's members */
    double *score;                 /* [CLASSIFY_KINDS][d] sums of log posteriors */
    size_t *rank;                  /* [classes + 1] leading features with a factor */
    struct classify_tally *class;  /* [classes] of the training members */
    struct classify_tally *inside; /* [classes] of them without the subject that is judged */
    double *own;                   /* [classes] members of that subject */
    struct classify_removal removal;
};

/* SRNF_ENOMEM. To be cleared in any case. */
SRNF_CHECKED int classify_fold_create(struct classify_fold *fold, const struct study *study);
void classify_fold_clear(struct classify_fold *fold);
/* The fold of a subject: means and factors of the others. */
void classify_fold_fit(struct classify_fold *fold, const struct study *study, size_t left_out,
                       const size_t *labels);
/* The same of given scores, [n][components of the comparison]; left_out SIZE_MAX: nobody is. */
void classify_fold_fit_scores(struct classify_fold *fold, const struct study *study,
                              const double *scores, size_t left_out, const size_t *labels);
/* Degrees of freedom of the scatter of a class. */
double classify_freedom(const struct classify_tally *tally);
/* Log-likelihoods of the members of a subject into the table, as if it were no training subject
   where it is one. members: [largest] of scratch. */
void classify_fold_judge(struct classify_fold *fold, size_t subject, size_t *members);

/* The covariance and how many features, size counted, that the options leave open, by the training
   members of a fold that is fitted; of all candidates, in order of features, the first of the best.
   members: [largest] of scratch. (classify_gauss.c) */
struct classify_choice {
    size_t kind, features;
};
struct classify_choice classify_fold_choose(struct classify_fold *fold,
                                            const struct srnf_classify_options *options,
                                            size_t *members);

#endif
