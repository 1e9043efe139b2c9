/*
 * classify.h - what the files of the process classify share: its typed inputs, the classes of a
 * cohort, and what a run has come to.
 */
#ifndef SRNFD_PROCESSES_CLASSIFY_H
#define SRNFD_PROCESSES_CLASSIFY_H

#include "toolkit/group.h"
#include "toolkit/typicality.h"

#define CLASSIFY_METHODS 7

struct classify_methods {
    size_t n;
    struct srnf_method list[CLASSIFY_METHODS];
};

/* classify_methods.c: the input method, a struct classify_methods, and components, a long, which is
   0 for auto; a method by its name, without costs, or NULL. */
extern const struct input_own classify_method_own, classify_components_own;
const struct srnf_method *classify_method_find(const char *name);
/* A method as warnings name it. */
struct typicality_method classify_method_named(const struct srnf_method *method);

/* The inputs as they are typed. */
struct classify {
    struct group_input group;
    struct classify_methods methods;
    long components;
    int covariance, validation, scale, refit;
    double size_weight;
    json_t *covariates; /* names, owned */
    long permutations, seed, lmax;
    bool common_pose;
};

/* The classes of a cohort's labels, in the order in which these first appear. */
struct classify_classes {
    size_t n, count;
    size_t *labels;     /* [n] */
    size_t *sizes;      /* [count] members */
    size_t *subjects;   /* [count] */
    size_t smallest;    /* the class with the fewest subjects, the first of equals */
    size_t determined;  /* features of one covariance in any fold: srnf_class_subjects */
    const char **names; /* [count], borrowed from the labels */
};

/*
 * classify_classes.c. Of a canonical cohort.
 *   subjects  [in]  [n] group_subject_numbers
 *   missing   [out] the first member without a label, or n; the classes are then empty
 * False: no memory. classify_classes_clear in any case.
 */
bool classify_classes_find(const json_t *cohort, const size_t *subjects,
                           struct classify_classes *classes, size_t *missing);
void classify_classes_clear(struct classify_classes *classes);
/* Whether the folds of these classes have training subjects enough for what is asked of them. */
typedef void classify_check_folds(struct process_inputs *given,
                                  const struct classify_classes *classes);
/* Notes what is wrong with the labels of a canonical cohort: members without one, fewer than two,
   or one with fewer than `least` subjects. If nothing is, goes on with check. */
void classify_classes_check(struct process_inputs *given, const json_t *cohort, size_t least,
                            classify_check_folds *check);

/* classify_numbers.c. The values of the covariates of the members, an array for each, into the
   canonical cohort as "values"; problems name who lacks one. */
void classify_set_covariates(struct process_inputs *given);
/* "size", or "size of .." of each of parts, and the covariates, as they are asked for. parts:
   names, or NULL of one structure. */
/* Whether so many numbers count beside shape at most as classifiers take; a problem otherwise. */
bool classify_check_count(struct process_inputs *given, size_t numbers);
json_t *classify_number_names(bool with_size, const json_t *parts, const json_t *covariates);
/* The numbers that count beside shape, and the labels they are to tell. */
struct classify_constants {
    const json_t *covariates;
    size_t sizes, n;
    const double *numbers;  /* [n][sizes and covariates] as of classify_numbers */
    const size_t *labels;   /* [n] */
    const size_t *subjects; /* [n], or NULL: each member is one of its own */
};
/* After SRNF_ENUMERIC: names in the problem of a result the first of the covariates that is the
   same in all members of each class, and so makes covariances singular; where the error names a
   member, also without its subject, which the fold leaves out. */
void classify_name_constant(const struct classify_constants *in, const struct srnf_error *error,
                            struct jobs_result *result);
/*
 * [n][of these] logs of sizes and the covariates, of members that are loaded, part after part.
 *   n        [in]  subjects: the members of each part
 *   sizes    [in]  parts whose sizes count: all, or 0
 *   values   [in]  as in the canonical cohort
 *   numbers  [out] srnf_free in any case
 * Errors: as srnf_normalize.
 */
int classify_numbers(struct jobs_run *run, const struct srnf_sht *sht,
                     const struct group_input *members, const struct compute_group *group, size_t n,
                     size_t sizes, const json_t *values, double **numbers);

/* What a run has loaded and computed. */
struct classify_answer {
    struct compute_group group;
    struct classify_classes classes;
    struct srnf_methods_inputs asked;
    double *scales;   /* [n], or NULL: shape only */
    double *features; /* [n][of the covariates] */
    double *pairs;    /* [n][n] */
    struct srnf_classification results[CLASSIFY_METHODS];
    struct srnf_folds_typicality typicality[CLASSIFY_METHODS];
};

/* classify_result.c: the methods by name, and each pair of methods, which were asked about the same
   members by the same folds; the latter NULL without memory. subjects: names; numbers, or NULL. */
json_t *classify_methods_json(const struct classify_methods *asked,
                              const struct classify_answer *answer, const json_t *subjects);
/* The doubts of assessment_warn, of each method. */
void classify_warn_methods(json_t *warnings, const struct classify_methods *asked,
                           const struct classify_answer *answer);
json_t *classify_comparisons_json(const struct classify_methods *asked,
                                  const struct classify_answer *answer, const size_t *subjects);
/* The result document; NULL with the problem set. */
json_t *classify_document(struct jobs_run *run, const struct classify *classify,
                          const struct classify_answer *answer, struct jobs_result *result);

/* The members of a finished job as CSV (classify_table.c). */
void classify_respond_table(struct api_call *call, const struct store_job *job, int form);
bool classify_table_fits(const json_t *results, char why[API_WHY_MAX]);

#endif
