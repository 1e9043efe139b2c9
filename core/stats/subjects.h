/*
 * subjects.h - which members of a cohort belong to the same subject, and the relabellings of
 * subjects that a permutation test takes.
 */
#ifndef SRNF_STATS_SUBJECTS_H
#define SRNF_STATS_SUBJECTS_H

#include "stats.h"

struct subjects {
    size_t n, count, largest; /* members; subjects; members of the largest */
    size_t *of;               /* [n] subject of each member, in the order of first appearance */
    size_t *size;             /* [count] */
    size_t *start;            /* [count + 1] into members */
    size_t *members;          /* [n] by subject, ascending within each */
};

/* given: [n] as in srnf/subjects.h. SRNF_EINVAL: one is not below n. Cleared in any case. */
SRNF_CHECKED int subjects_open(struct subjects *s, size_t n, const size_t *given,
                               struct srnf_error *error);
void subjects_clear(struct subjects *s);

/* Wilson's interval of p with a count that need not be whole. */
void subjects_wilson(double p, double count, double interval[2]);
/* The same of a percentile, 0 .. 100, with `below` of the subjects below; of none 0 .. 100. */
void subjects_percentile(double below, double count, double interval[2]);

/* The .975 quantile of Student's distribution, by the first terms of its expansion about the normal
   one (R. Cornish, E. Fisher, 1938): to 1 % from 3 degrees of freedom on. */
double subjects_student(double freedom);
/* The same where that of the normal distribution is z; to 2 % up to z = 2.25. */
double subjects_student_at(double freedom, double z);

/* The label of each subject, [count]; false: the labels of the members of one differ. */
bool subjects_labels(const struct subjects *s, const size_t *labels, size_t *of_subjects);

/*
 * The relabellings of a permutation test. Items are the labels of the subjects, or, where even
 * equal labels make a difference (covariates), the subjects themselves.
 */
struct exchange {
    size_t n, kinds;
    size_t *count;  /* [kinds] items of each */
    size_t *sorted; /* [n] subjects by kind */
    uint64_t all;   /* different relabellings, where they are all taken */
    struct srnf_permutation_test test;
};

/*
 *   kind   [in] [n] below kinds; NULL: every item is a kind of its own
 *   asked  [in] relabellings that may be taken beside the observed one
 *   same   [in] how many of the relabellings always give the same statistic, as where two groups of
 *          equal size change names
 * SRNF_ENOMEM. Cleared in any case.
 */
SRNF_CHECKED int exchange_open(struct exchange *e, size_t n, const size_t *kind, size_t kinds,
                               size_t asked, double same);
void exchange_clear(struct exchange *e);
/* Where the test is exact: relabelling `number`, 1 to permutations (0 is the observed one). Subject
   i gets the item of subject source[i]. left: [kinds] of scratch. */
void exchange_arrange(const struct exchange *e, uint64_t number, size_t *left, size_t *source);

#endif
