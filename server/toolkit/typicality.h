/*
 * typicality.h - in result documents: how a surface compares with the members of a group, and the
 * warnings where it does not belong to them.
 */
#ifndef SRNFD_TOOLKIT_TYPICALITY_H
#define SRNFD_TOOLKIT_TYPICALITY_H

#include "toolkit/process.h"
#include "toolkit/group.h"
#include "compute/mean.h"

struct compute_projection; /* compute/model.h */
struct compute_model;

/* Subjects below which a model's limits are wide enough to be told of. */
#define TYPICALITY_SUBJECTS_FEW 30

/* {value, limit, percentile, percentileInterval}, value and limit times the unit. */
json_t *typicality_json(const struct srnf_typicality *t, double unit);

/* mahalanobis and typicality of a projection, and its warnings. */
void typicality_set_projection(json_t *document, const struct compute_projection *projection);
/* The warnings alone; expected: those that hold where the surface is held against what a formula
   expects of it. */
void typicality_warn_projection(json_t *document, const struct compute_projection *projection,
                                bool expected);

/* A quarter of the pairs of the model's members are no further apart than that; 0 of few members,
   which have no twin. */
double typicality_quartile(const struct compute_model *model);
/* Whether what is so near to a member is most likely another scan of its subject. */
bool typicality_is_twin(const struct compute_model *model, double quartile, double least);
/* The warning near-duplicates where a surface that is no member of the model is far nearer to one
   than members are to each other: another scan of that subject, most likely. */
void typicality_warn_twin(json_t *warnings, const struct compute_model *model, const double *scores,
                          double residual);

/* Appends a warning for each member that is turned far against those of other subjects.
   positions: as of group_doubts. */
void typicality_warn_poses(struct jobs_run *run, const struct group_input *members,
                           const struct compute_mean_outputs *outputs, bool positions,
                           json_t *warnings);
/* 1 / m for each of the m members of a subject, by their numbers, each below n (srnf_free); NULL
   without memory. */
double *typicality_weights(size_t n, const size_t *subjects);

/* The verdicts on one member of a comparison (new reference). */
json_t *typicality_member(const struct srnf_folds_typicality *typicality, size_t member);
/* A method of classification, as warnings name it. */
struct typicality_method {
    const char *name;
    bool registers; /* icp as well; otherwise parameterization counts, or pose as well */
};

/* Appends a warning for each member that is far from all classes by one method or more.
   typicality, methods: [n_methods]; names: of the members. */
void typicality_warn_members(json_t *warnings, size_t n_methods,
                             const struct srnf_folds_typicality *typicality,
                             const struct typicality_method *methods, const json_t *names);

#endif
