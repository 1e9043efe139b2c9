/*
 * group.h - what processes on several surfaces share: the inputs "surfaces" or "cohort".
 */
#ifndef SRNFD_TOOLKIT_GROUP_H
#define SRNFD_TOOLKIT_GROUP_H

#include "toolkit/process.h"
#include "compute/group.h"

_Static_assert(PROCESS_GROUP_MAX <= COMPUTE_GROUP_MAX, "a group can be computed");

/*
 * Reads "surfaces" [id, ..] or "cohort" (a name), exactly one of them. The canonical surfaces are
 * the ids, in order, in both cases; the canonical cohort is null, or its name with the labels and
 * subjects of its members and which of them are mirrored, as they are now: a cohort may be deleted,
 * and its name given to another. "mixedRoutes" is read too: surfaces that are known to have come by
 * different routes are refused unless it is true (routes.h). Returns their number, or 0
 * with a problem noted or answered. degree gets the largest of theirs.
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
/* Which members of the canonical cohort are taken mirrored; none without a cohort. */
struct compute_mirrored group_mirrored(const json_t *inputs);
/* A name for each surface, no two the same: the subject of the member, or else the name that the
   mesh or surface has, or else its id. Where several would be the same, the name follows the
   subject in brackets, the id the name, and then the number of the member. */
json_t *group_labels(struct jobs_run *run, const json_t *inputs);
/* The label, or null, of each member of the cohort; null where there is none. */
json_t *group_groups(const json_t *inputs);

/*
 * Whose each member is: [n] numbers below n, the same where the subjects are the same text; a
 * member without a subject is one of its own. subjects: an array of texts and nulls, or NULL. count
 * gets the number of subjects, largest the members of the largest. srnf_free; NULL without memory.
 */
size_t *group_subject_numbers(const json_t *subjects, size_t n, size_t *count, size_t *largest);
/* Refuses with labels-within-subject where members of a subject have different labels; advice says
   why that matters and what to do instead. labels: of all members. True: there are none. */
bool group_check_labels(struct process_inputs *inputs, const json_t *subjects, const json_t *labels,
                        const char *advice);
/*
 * Warns, in the result document, of members with the same content (duplicate-content): the same
 * surface, or surfaces and meshes that come from one mesh. Mirror images are not the same.
 *   group     [in] what holds "surfaces": the canonical inputs, or the cohort in them
 *   cohort    [in] what holds "subjects" and "mirrored", for all members; or NULL
 *   contents  [in] [n] of compute_group, by which meshes of the same surface are known; or NULL
 */
void group_warn_duplicates(struct jobs_run *run, json_t *document, const json_t *group,
                           const json_t *cohort, const char (*contents)[STORE_ID_MAX]);

/* A name for each member where labels are classes: the subject, or else the name, or else the id.
   cohort: the canonical one, with the member surfaces. */
json_t *group_subjects(struct jobs_run *run, const json_t *cohort);

#endif
