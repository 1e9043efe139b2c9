/*
 * score.h - what the files of the process score share.
 */
#ifndef SRNFD_PROCESSES_SCORE_H
#define SRNFD_PROCESSES_SCORE_H

#include "toolkit/design.h"
#include "toolkit/model.h"
#include "toolkit/subject.h"

/* The covariates of the members and of the surface, as the formula takes them. */
struct score_expected {
    bool given;
    struct design_input design;
    json_t *told; /* {at, beyond, columns} of the design; borrowed of canonical */
    json_t *canonical;
};

struct score {
    char model[STORE_ID_MAX];
    struct subject_input subject;
    struct score_expected expected;
    bool map, calibration;
    int handedness; /* enum handedness */
};

/* score_inputs.c: formula and covariates, and the design that both make of the members' covariates
   as they are now. */
extern const struct input_own score_formula, score_covariates;
void score_describe(struct process_inputs *given);

/* What was found. */
struct score_found {
    struct srnf_score whole;
    struct srnf_score maps[SRNF_PARTS_MAX]; /* of each part of several; of one it is in whole */
};

/* score_result.c: the document; NULL with the problem set. sides: warnings of handedness, taken
   over. */
json_t *score_document(struct jobs_run *run, const struct score *asked,
                       const struct compute_model *model,
                       const struct compute_projection *projection,
                       const struct srnf_register_options *registration, json_t *sides,
                       struct score_found *found, struct jobs_result *result);

#endif
