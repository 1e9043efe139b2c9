/*
 * regress.h - what the files of the process regress share: its typed inputs and its result.
 */
#ifndef SRNFD_PROCESSES_REGRESS_H
#define SRNFD_PROCESSES_REGRESS_H

#include "store/surface.h"
#include "toolkit/design.h"
#include "toolkit/mean.h"

struct regress {
    struct group_input group;
    struct design_input design;
    struct mean_input mean;
    long permutations, bootstraps, seed;
    bool fields;
};

/* regress_inputs.c: formula and at; and what the computation needs of the cohort beside the
   surfaces, put into the canonical cohort once all inputs are read. */
extern const struct input_own regress_formula, regress_at, regress_cohort;
void regress_describe(struct process_inputs *given);

/* What the document of regress tells beside its own, where another process has it made. */
struct regress_more {
    const char *process, *title;               /* its id; name of the mean surface */
    const struct store_maps *maps;             /* of the mean surface, or NULL */
    const struct srnf_predicted_slope *slopes; /* [points of the design], or NULL */
    bool weighted;                             /* subjects have weights */
};

/* regress_result.c: the document with all its surfaces; NULL with the problem set. Lengths of found
   times mean_scale are in units of the input. */
json_t *regress_document(struct jobs_run *run, const struct regress *asked,
                         const struct group_mean *mean, const struct srnf_regression *found,
                         const struct regress_more *more, struct jobs_result *result);

#endif
