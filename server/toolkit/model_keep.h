/*
 * model_keep.h - how a process keeps a model of principal components: what its record says of its
 * making, and its numbers.
 */
#ifndef SRNFD_TOOLKIT_MODEL_KEEP_H
#define SRNFD_TOOLKIT_MODEL_KEEP_H

#include "toolkit/group.h"

/* The numbers of a model; all is borrowed. */
struct model_parts {
    const struct compute_group *group; /* its members */
    size_t n_theta, n_phi;             /* of the grid of fields */
    const struct srnf_pca *pca;
    const double *mean_q;                       /* [3][n_theta][n_phi] */
    const double *residuals;                    /* [pca->n], beyond the components */
    const double *distances;                    /* [pca->n], from the mean */
    const struct srnf_calibration *calibration; /* n 0: there is none */
};

/* Whether they are finite; otherwise the problem is set. */
bool model_is_sound(const struct model_parts *parts, struct jobs_result *result);

/* Ids as an array (new reference). */
json_t *model_ids(size_t n, const char (*ids)[STORE_ID_MAX]);

/* The member madeFrom of a record (new reference): process, job, cohort and members, with their
   residuals and distances, and how they were registered. contents: [n] what stands for each. */
json_t *model_making(struct jobs_run *run, const char *process, const struct group_input *members,
                     const struct model_parts *parts,
                     const struct srnf_register_options *registration,
                     const char (*contents)[STORE_ID_MAX]);

/*
 * Stores a model. Its id is that of its numbers and of its record, but for madeFrom.job.
 *   record [in] what it holds beside the numbers, with madeFrom; taken over. NULL: no memory
 *   mean   [in] record of its mean surface; taken over
 * Returns its record with that of the mean in it (new reference), or NULL with the problem set.
 */
json_t *model_keep(struct jobs_run *run, const struct model_parts *parts, json_t *record,
                   json_t *mean, struct jobs_result *result);

#endif
