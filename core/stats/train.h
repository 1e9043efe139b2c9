/*
 * train.h - what the files of train share.
 */
#ifndef SRNF_STATS_TRAIN_H
#define SRNF_STATS_TRAIN_H

#include "folds.h"
#include "frozen.h"

#define TRAIN_GROUPS 10       /* that the training subjects of a fold are dealt into */
#define TRAIN_NOBODY SIZE_MAX /* left out */

struct training {
    size_t n, classes;
    const size_t *labels;
    const struct srnf_train_options *options;
    struct srnf_classify_options classifier;
    size_t components; /* of scores that are kept */
    struct subjects subjects;
    const double *priors;
    double weights[SRNF_PARTS_MAX];
    struct folds_sum sum;           /* what subjects are compared by */
    struct srnf_folds *parts;       /* of each structure, kept */
    const struct srnf_folds *folds; /* of all together: the one part itself, where it is alone */
    struct srnf_trained *out;
};

/* train.c: inner products of the fold of a member, or of all (TRAIN_NOBODY); NULL without
   memory. */
double *train_products(const struct training *t, size_t member);

/* train_calibrate.c: the class of a subject, whose members have one label; the numbers beside
   shape; and the calibration of the fold that leaves a subject out, or of all. */
size_t train_class_of(const struct training *t, size_t subject);
struct frozen_numbers train_numbers(const struct training *t);
SRNF_CHECKED int train_calibrate(const struct training *t, const double *products, size_t left_out,
                                 const struct srnf_context *context, struct srnf_platt *platt,
                                 struct srnf_error *error);

/* train_freeze.c: mean, components and distances of the classifier of all, from the registered
   fields, which are let go; then what decides, and its calibration. */
SRNF_CHECKED int train_fit_components(const struct training *t, const struct srnf_grid *grid,
                                      const struct srnf_context *context);
SRNF_CHECKED int train_freeze(const struct training *t, const struct srnf_context *context,
                              struct srnf_error *error);

/* train_check.c: SRNF_EINVAL, and error says of what: labels and options as they are given; parts,
   of which weights[SRNF_PARTS_MAX] and sum are filled; labels that differ within a subject; a class
   with too few subjects, of which counts[classes] and priors[classes] are filled; and more features
   than the innermost training subjects determine. */
SRNF_CHECKED int train_check(size_t n, const size_t *labels, size_t n_classes,
                             const struct srnf_train_options *options, struct srnf_error *error);
SRNF_CHECKED int train_check_parts(const struct srnf_train_options *options, size_t n,
                                   double *weights, struct folds_sum *sum,
                                   struct srnf_error *error);
SRNF_CHECKED int train_check_labels(const struct training *t, struct srnf_error *error);
SRNF_CHECKED int train_count_classes(const struct training *t, size_t *counts, double *priors,
                                     struct srnf_error *error);
SRNF_CHECKED int train_check_components(const struct training *t, const size_t *counts,
                                        struct srnf_error *error);

#endif
