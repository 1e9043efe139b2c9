/*
 * near.h - "did you mean": the name that a mistyped one is nearest to.
 */
#ifndef SRNFD_API_NEAR_H
#define SRNFD_API_NEAR_H

#include <stddef.h>

/* The first of the names, of which the last is NULL, that few slips of the keyboard lead to; NULL:
   none is near. */
const char *near_name(const char *given, const char *const *names);

/* "BEGIN. Known: a, b, c", or "BEGIN; did you mean b? Known: a, b, c" where one is near. */
#define NEAR_SENTENCE_MAX 700
void near_sentence(char text[NEAR_SENTENCE_MAX], const char *begin, const char *given,
                   const char *const *names);

#endif
