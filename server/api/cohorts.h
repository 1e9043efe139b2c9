/*
 * cohorts.h - cohorts in the api layer: names, limits, and what the processes read of a cohort.
 */
#ifndef SRNFD_API_COHORTS_H
#define SRNFD_API_COHORTS_H

#include <stdio.h>

#include "api/handler.h"

struct store_cohort; /* store/cohort.h */

#define COHORT_MEMBERS_MAX 100000
#define COHORT_MEMBERS_SHOWN 1000 /* a record with more says where they are */
#define COHORT_COVARIATES_MAX 64
#define COHORT_TEXT_MAX 200 /* characters of labels, subjects, and texts among the covariates */
#define COHORT_NAME_PATTERN "^[A-Za-z0-9._-]{1,100}$"

#define COHORT_NAME_SENTENCE \
    "must be 1 to 100 letters, digits, dots, hyphens or underscores, and not . or .."

/* [A-Za-z0-9._-]{1,100}, and neither "." nor "..", which have a meaning of their own in paths. */
bool cohort_name_valid(const char *name);

/* ---- Members (cohorts_members.c) ------------------------------------------------------------- */

/* Notes each member of the object that is not among the names. */
void cohort_check_names(const json_t *value, const char *const *names, const char *pointer,
                        struct problem_list *list);
/* One member in its canonical spelling (new reference); what is wrong with it goes into the list,
   with pointers below the one given. */
json_t *cohort_read_member(const json_t *member, const char *pointer, struct problem_list *list);

/* The text of a cohort while it is made. Zero it to begin with. */
struct cohort_text {
    char *text;
    char (*ids)[STORE_ID_MAX];
    size_t used, capacity, count, id_capacity;
    bool failed; /* for want of memory */
};
/* Adds a canonical member. */
void cohort_text_add(struct cohort_text *text, const json_t *member);
/* Moves it into the cohort: record and members. False, with nothing moved, where there are none or
   memory was short. */
bool cohort_text_finish(struct cohort_text *text, struct store_cohort *cohort);
void cohort_text_clear(struct cohort_text *text);
/* Steps through the members of a canonical text: *at, first the text itself, moves on; false at its
   end. */
bool cohort_text_next(const char **at, const char **member, size_t *length);
/* One of them with all that a member can have (new reference). */
json_t *cohort_text_member(const char *text, size_t length);

/* Whether a label, subject or covariate says nothing: it is absent, null, or a text of white space
   alone, as tables give for an empty cell. */
bool cohort_says_nothing(const json_t *value);
/* The keys of an object for a sentence, in quotes, as many as fit. */
void cohort_list_names(const json_t *names, char *text, size_t size);

/* The members of a stored cohort as a JSON array of {id, label, subject, covariates, mirror, time,
   side}; NULL without memory. */
json_t *cohort_members(const struct store_cohort *cohort);

/* The record of a cohort (new reference). */
json_t *cohort_record(const struct api_call *call, const struct store_cohort *cohort,
                      bool with_members);
/* The same for a request that may have ?owner=: false when a problem was answered. What a caller
   may not see is not there. */
bool cohort_find_owner(struct api_call *call, char owner[STORE_OWNER_MAX]);
/* The entity tag: the same name may stand for another content later. */
void cohort_tag(const struct store_cohort *cohort, char tag[120]);
/* All members as CSV: id, label, subject, time, side, mirror and the covariates. */
void cohort_write_table(FILE *out, const struct store_cohort *cohort);
/* The members that a body gives, as a text (cohorts_edit.c); false without memory. */
bool cohort_read_members(const json_t *given, struct cohort_text *text, struct problem_list *list);
/* Those of the cohort "from" that are like "where" (cohorts_copy.c); false when a problem was
   answered. */
bool cohort_read_copy(struct api_call *call, const json_t *body, struct cohort_text *text,
                      struct problem_list *list);

/* The record of a cohort without its members (new reference). */
json_t *cohort_summary(const struct api_call *call, const struct store_cohort *cohort);
/* Answers what a failure of storing a cohort means; missing: the member that does not exist. */
void cohort_respond_refused(struct api_call *call, const struct store_cohort *cohort, int status,
                            size_t missing);

/* Whose cohort of this name the caller means: its own; or, for one who sees all and has none, where
   `any`, that of the one owner who has one. False when it was answered that the owner must be
   named, or that the store failed. */
bool cohort_owner(struct api_call *call, const char *name, bool any, char owner[STORE_OWNER_MAX]);

/* mesh- or surf-, and 32 lower-case hex digits? */
bool cohort_member_id(const char *id);

#endif
