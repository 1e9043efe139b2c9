/*
 * design.h - the design of a linear model: the columns that a formula makes of the covariates of a
 * cohort, the rows at which surfaces are predicted, and the nested models that are tested.
 */
#ifndef SRNFD_TOOLKIT_DESIGN_H
#define SRNFD_TOOLKIT_DESIGN_H

#include "toolkit/formula.h"
#include "toolkit/table.h"

#define DESIGN_COLUMNS_MAX 100
#define DESIGN_LEVELS_MAX 50
#define DESIGN_AT_MAX 20
#define DESIGN_PAIRS_LEVELS 6 /* a categorical term of more is not tested pair by pair */

/*
 * Puts "design" into the canonical cohort, with all that the computation and its result need of
 * formula and covariates as they are now; or notes problems. design:
 *     formula  as given
 *     terms    [{name, columns: [numbers of them]}]
 *     columns  [{name, term: number}]
 *     rows     [[..] of each member]
 *     at       [all covariates of each point], atRows [[..]]
 *     beyond   [{index, covariate, value, lowest, highest}] of the points outside of the members
 *     mixed    [{column, cell, numbers, others}] of texts that count as levels, though half of them
 *              or more are numbers: how many are, how many are not, and the first that is not; only
 *              where there are some
 *     missing  [{of, found: [..]}] of levels that other programs write for what is missing
 *     tests    [{kind: term, model or pair, term: number, levels, reduced, tested, merged}]; levels
 *              of a pair, and of a term of one categorical factor
 * A name is that of a covariate, or else label, group (the label as well), time or side of members.
 * Texts, true and false, and C(x) are categorical, with treatment coding against the first level,
 * but all levels where R codes them so: in an interaction without that without the factor.
 *   members  [in] as cohort_members gives them
 *   at       [in] array of objects
 *   where    [in] the pointer of problems with a point; its number follows a slash at the end
 */
void design_describe(struct process_inputs *given, const struct formula *formula,
                     const json_t *members, json_t *cohort, const json_t *at, const char *where);

/* The numbers of a design, for srnf_regress. */
struct design_input {
    struct srnf_regress_design design;
    struct srnf_nested *nested;
    double *values, *at, **columns; /* owned; columns: two for each test */
};
/* False: no memory. n: members. design_clear in any case. */
bool design_type(const json_t *design, size_t n, struct design_input *input);
void design_clear(struct design_input *input);

#endif
