/*
 * encode.h - what the files of the process encode share: its typed inputs, one mesh of them, and
 * how its surface is kept.
 */
#ifndef SRNFD_PROCESSES_ENCODE_H
#define SRNFD_PROCESSES_ENCODE_H

#include "compute/encode.h"
#include "toolkit/table.h"

struct store_job; /* store/job.h */

#define ENCODE_MEMBERS_MAX 2000 /* of a cohort */

/* A cohort as it is typed; n = 0: none. */
struct encode_cohort {
    size_t n;
    json_t *cohort; /* canonical: name, members [n], labels, subjects, mirrored */
};

/* Of the rays of star. */
struct encode_center {
    bool given;
    double at[3];
};

struct encoding {
    char mesh[STORE_ID_MAX], sphere[STORE_ID_MAX];
    struct encode_cohort cohort;
    long degree;
    int parameterization, scale;
    double smoothing;
    bool mirror;
    struct encode_center center;
};

/* The inputs of a mesh of those; mirror: its mirror image. */
struct compute_encode_inputs encode_inputs_of(const struct encoding *encoding, const char *mesh,
                                              bool mirror);
/* Keeps the surface of a mesh, under its name; its record, or NULL with the problem set.
     warnings  [in] an array, taken over */
json_t *encode_keep_surface(struct jobs_run *run, const struct compute_encode_inputs *of,
                            const struct srnf_encoded *encoded, json_t *warnings,
                            struct jobs_result *result);

/* ---- Cohorts (encode_cohort.c) --------------------------------------------------------------- */

extern const struct input_own encode_cohort;
/* The document of a run on a cohort, or NULL with the problem set. */
json_t *encode_run_cohort(struct jobs_run *run, const struct encoding *encoding,
                          struct jobs_result *result);
/* encode_rows.c: the document of these rows, or NULL with the problem of the first where no surface
   came of any mesh. */
json_t *encode_rows_document(const struct encoding *encoding, json_t *rows,
                             struct jobs_result *result);
/* The rows of a finished job as CSV. */
void encode_respond_table(struct api_call *call, const struct store_job *job, int form);
bool encode_table_fits(const json_t *results, char why[API_WHY_MAX]);

#endif
