/*
 * paired_measured.h - what the files of repeatedly measured sides share (paired_measured.c).
 */
#ifndef SRNF_STATS_PAIRED_MEASURED_H
#define SRNF_STATS_PAIRED_MEASURED_H

#include "paired.h"

#include <stdatomic.h>

struct measured_run {
    const struct srnf_sht *sht;
    const struct srnf_measurements *given;
    const struct srnf_paired_options *options;
    const struct srnf_context *context;
    struct subjects subjects;
    size_t n, count;     /* measurements; subjects */
    size_t *of_side;     /* [count][2] measurements of each */
    size_t *order;       /* [count] subjects, those with repeated measurements first */
    double *gram;        /* [n][n] of z */
    double *weight;      /* [count] w_s */
    double *within;      /* [count] T_s */
    double *about;       /* [count] a_s of what was observed */
    double *differences; /* [count][count] products of the d_s, of z */
    double sum;          /* W */
    double observed;     /* F */
    atomic_size_t as_large;
    struct srnf_asymmetry_test *out;
};

/* The part of a measurement in the difference of its subject's sides. */
static inline double measured_part(const struct measured_run *run, size_t subject, int side)
{
    double part = 1.0 / (double)run->of_side[2 * subject + (size_t)side];

    return side ? part : -part;
}

/* paired_measured_intervals.c: all intervals, once what was observed is known. */
SRNF_CHECKED int measured_intervals(struct measured_run *run, struct srnf_error *error);
/* paired_measured_squares.c: those of the mean squares, once measured_intervals has counted. */
SRNF_CHECKED int measured_squares(struct measured_run *run);

#endif
