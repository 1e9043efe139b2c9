/*
 * internal.h - what the kinds of tasks share: their numbers and sentences as bytes.
 */
#ifndef SRNFD_TASKS_INTERNAL_H
#define SRNFD_TASKS_INTERNAL_H

#include "tasks/tasks.h"

#define TASKS_DEGREE_MAX 1000
#define PI 3.14159265358979323846

void tasks_put(unsigned char bytes[8], uint64_t value);
uint64_t tasks_get(const unsigned char bytes[8]);
void tasks_put_double(unsigned char bytes[8], double value);
double tasks_get_double(const unsigned char bytes[8]);
void tasks_put_point(unsigned char *bytes, const double x[3]);
void tasks_get_point(const unsigned char *bytes, double x[3]);
/* False: one of them is not finite, and some are read. */
bool tasks_get_doubles(const unsigned char *bytes, size_t count, double *values);
/* Whether the bytes are a sentence as the core makes them: printable ASCII, and zeros behind it. */
bool tasks_is_sentence(const unsigned char *bytes, size_t size);

/* The options of a registration (options.c). */
#define TASKS_OPTIONS_SIZE 96
void tasks_put_options(unsigned char *bytes, const struct srnf_register_options *options);
/* False: these are none, or of another version. */
bool tasks_get_options(const unsigned char *bytes, struct srnf_register_options *options);

extern const struct tasks_kind tasks_pairs_kind;
extern const struct tasks_kind tasks_searches_kind;
extern const struct tasks_kind tasks_encodings_kind;

#endif
