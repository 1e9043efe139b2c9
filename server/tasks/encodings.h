/*
 * encodings.h - what the files of the kind "encodings" share.
 */
#ifndef SRNFD_TASKS_ENCODINGS_H
#define SRNFD_TASKS_ENCODINGS_H

#include "tasks/tasks.h"

/* encodings_found.c: what became of one mesh, as bytes. SRNF_ENOMEM, also beyond
   TASKS_RESULT_MAX. */
SRNF_CHECKED int encodings_add_failure(struct tasks_bytes *result, int status,
                                       const struct srnf_error *error);
SRNF_CHECKED int encodings_add_surface(struct tasks_bytes *result, const struct srnf_encoded *e);
/* Whether a status is a result. */
bool encodings_is_result(int64_t status);
/* What is at *at, which moves on; its coefficients are the caller's to free. SRNF_EINVAL: it is
   none. */
SRNF_CHECKED int encodings_read_one(const unsigned char **at, const unsigned char *end,
                                    struct tasks_encoded *found);

#endif
