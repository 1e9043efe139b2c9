/*
 * process_group.h - what processes on several surfaces share: the inputs "surfaces" or "cohort".
 */
#ifndef SRNFD_API_PROCESS_GROUP_H
#define SRNFD_API_PROCESS_GROUP_H

#include "api/process.h"

/*
 * Reads "surfaces" [id, ..] or "cohort" (a name), exactly one of them. The canonical surfaces are
 * the ids, in order, in both cases; the canonical cohort is null, or its name with the labels and
 * subjects of its members as they are now: a cohort may be deleted, and its name given to another.
 * "mixedRoutes" is read too: surfaces that are known to have come by different routes are refused
 * unless it is true (process_routes.h). Returns their number, or 0 with a problem noted or
 * answered. degree gets the largest of theirs.
 */
size_t inputs_group(struct process_inputs *inputs, long *degree);
/* Notes a problem where n fields of that degree, `copies` of them for each surface, are beyond the
   limit on memory. */
void inputs_check_memory(struct process_inputs *inputs, size_t n, long degree, size_t copies);

/* Reads "model": canonical, and the stored model without its arrays (store_model_clear). False with
   a problem noted or answered. */
bool inputs_model(struct process_inputs *inputs, struct store_model *model);

/* The ids of canonical inputs, borrowed from them; srnf_free. */
const char **group_ids(const json_t *inputs, size_t *n);
/* A name for each surface: the label of the member, or else its subject, or else the name that the
   mesh or surface has, or else its id. */
json_t *group_labels(struct jobs_run *run, const json_t *inputs);

/* A name for each member where labels are classes: the subject, or else the name, or else the id.
   cohort: the canonical one, with the member surfaces. */
json_t *group_subjects(struct jobs_run *run, const json_t *cohort);

#endif
