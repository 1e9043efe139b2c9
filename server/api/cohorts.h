/*
 * cohorts.h - cohorts in the api layer: names, limits, and what the processes read of a cohort.
 */
#ifndef SRNFD_API_COHORTS_H
#define SRNFD_API_COHORTS_H

#include "api/handler.h"

struct store_cohort; /* store/cohort.h */

#define COHORT_MEMBERS_MAX 1000
#define COHORT_COVARIATES_MAX 64
#define COHORT_TEXT_MAX 200 /* characters of labels, subjects, and texts among the covariates */
#define COHORT_NAME_PATTERN "^[A-Za-z0-9._-]{1,100}$"

/* [A-Za-z0-9._-]{1,100}, and neither "." nor "..", which have a meaning of their own in paths. */
bool cohort_name_valid(const char *name);

/* The members of a stored cohort as a JSON array of {id, label, subject, covariates, mirror}; NULL
   without memory. */
json_t *cohort_members(const struct store_cohort *cohort);

/* Whose cohort of this name the caller means: its own; or, for one who sees all and has none, where
   `any`, that of the one owner who has one. False when it was answered that the owner must be
   named, or that the store failed. */
bool cohort_owner(struct api_call *call, const char *name, bool any, char owner[STORE_OWNER_MAX]);

/* mesh- or surf-, and 32 lower-case hex digits? */
bool cohort_member_id(const char *id);

#endif
