/*
 * giveaways.h - covariates that tell the label of every member by themselves.
 */
#ifndef SRNFD_TOOLKIT_GIVEAWAYS_H
#define SRNFD_TOOLKIT_GIVEAWAYS_H

#include "toolkit/process.h"

/* Adds the warning covariate-is-label for each covariate that canonical inputs have of the members
   of a cohort with labels, and that gives these away. Members of a subject count once. */
void giveaways_warn(const json_t *inputs, json_t *document);

/* Adds the warning labels-alike (api/alike.h) where the members of a cohort have labels that were
   most likely meant to be the same. The levels of a formula are told of by outliers_warn_design. */
void giveaways_warn_labels(const json_t *inputs, json_t *document);

/* Adds the warning subjects-alike where subjects of a cohort have names that differ in spelling
   alone. */
void giveaways_warn_subjects(const json_t *inputs, json_t *document);

struct giveaway {
    double value;
    size_t label;
};
/*
 * Whether n values give their labels away: equal values have equal labels, and labels that were
 * dealt out at random would do so less than once in a thousand. With K labels of n_k values each
 * there are n! / prod n_k! ways to deal them out. Of m different values at most K^m of these leave
 * no value with two labels, and K! give each label a range of its own.
 *   pairs    [in/out] [n] sorted by value
 *   classes  [in]     labels are below that
 */
bool giveaways_find(size_t n, struct giveaway *pairs, size_t classes);

#endif
