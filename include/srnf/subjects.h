/*
 * subjects.h - members of a cohort that belong to the same subject, and tests by permutation.
 *
 * A part of srnf.h, which states the conventions; programs include that.
 *
 * SUBJECTS. Where a function takes `subjects`, it is [n]: members with equal numbers, each below n,
 * belong to one subject; NULL: every member is a subject of its own. Members of one subject are not
 * independent, so they are left out together and exchange their labels together.
 *
 * PERMUTATION TESTS. Under the null hypothesis the labels of the subjects can be exchanged. With m
 * random relabellings, b of them as extreme as what was observed,
 *
 *     p = (1 + b) / (1 + m)
 *
 * (B. Phipson, G. K. Smyth, "Permutation p-values should never be zero", SAGMB 9, 2010). Where
 * there are no more than m + 1 different relabellings, all are taken, each once: nothing is left to
 * chance in p then. Where labels can be exchanged, P(p <= a) is at most a either way; where
 * covariates are regressed out (srnf_compare_groups) that holds only asymptotically.
 */
#ifndef SRNF_PUBLIC_SUBJECTS_H
#define SRNF_PUBLIC_SUBJECTS_H

#include "srnf/base.h"

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)

/* How many subjects the n members are of. */
size_t srnf_subject_count(size_t n, const size_t *subjects);

struct srnf_permutation_test {
    size_t permutations; /* m: relabellings beside the observed one; 0: none was asked for */
    double relabellings; /* different ones there are, the observed among them; may be INFINITY */
    bool exact;          /* all of them were taken: p is that of all relabellings, not estimated */
    double least;        /* the smallest p that this test can give */
};

/* Whether p is the smallest that the test can give: the true p may be below it. */
bool srnf_permutation_at_floor(const struct srnf_permutation_test *test, double p);
/*
 * The 95 % interval of the p that all relabellings would give: Wilson's for b of m; [p, p] where
 * the test is exact; [0, 1] where no relabelling was taken.
 */
void srnf_permutation_interval(const struct srnf_permutation_test *test, double p,
                               double interval[2]);

/* Wilson's score interval of a proportion at 95 %: successes of n. (E. Wilson, "Probable inference,
   the law of succession, and statistical inference", JASA 1927.) n = 0: [0, 1]. */
void srnf_wilson_interval(size_t successes, size_t n, double interval[2]);

/*
 * A proportion whose members belong to subjects: how many independent members it is worth, and
 * Wilson's interval with that count.
 *
 * With m_s members of subject s of which x_s are successes, p = sum x_s / n, and S subjects, the
 * variance of p allowing for any dependence within subjects is
 *
 *     v = S / (S - 1) sum_s (x_s - m_s p)^2 / n^2,
 *
 * and the effective count n' = p (1 - p) / v replaces n (J. N. K. Rao, A. J. Scott, "A simple
 * method for the analysis of clustered binary data", Biometrics 48, 1992). It is kept between
 * n^2 / sum_s m_s^2, the count where members of a subject always agree (L. Kish, "Survey sampling",
 * 1965), which also stands in where v is 0, as it is for p = 0 and 1, and n.
 *   subjects   [in]  [n], or NULL: n' = n
 *   success    [in]  [n]
 *   effective  [out] n'
 * Errors: SRNF_EINVAL (a subject not below n), SRNF_ENOMEM.
 */
SRNF_CHECKED int srnf_cluster_interval(size_t n, const size_t *subjects, const bool *success,
                                       double *effective, double interval[2],
                                       struct srnf_error *error);

#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
