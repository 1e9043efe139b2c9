/*
 * internal.h - what the kinds of tasks share: their numbers as bytes.
 */
#ifndef SRNFD_TASKS_INTERNAL_H
#define SRNFD_TASKS_INTERNAL_H

#include "tasks/tasks.h"

void tasks_put(unsigned char bytes[8], uint64_t value);
uint64_t tasks_get(const unsigned char bytes[8]);
void tasks_put_double(unsigned char bytes[8], double value);
double tasks_get_double(const unsigned char bytes[8]);

extern const struct tasks_kind tasks_pairs_kind;

#endif
