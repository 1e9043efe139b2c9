/*
 * names.h - what members of groups are called in results and warnings.
 */
#ifndef SRNFD_TOOLKIT_NAMES_H
#define SRNFD_TOOLKIT_NAMES_H

#include "toolkit/process.h"

/* The name that a mesh or surface has, or its id (new reference). */
json_t *group_name_of(struct jobs_run *run, const char *id);
/* A member as warnings name it: "Member 3 (Ada)", by the name that its mesh or surface has, or else
   its subject, or else the id. The number is that among the ids; subjects: an array of texts and
   nulls, or NULL. */
#define GROUP_WHO 128
void group_who(struct jobs_run *run, const json_t *surfaces, const json_t *subjects, size_t i,
               char text[GROUP_WHO]);

#endif
