/*
 * alike.h - texts that were most likely meant to be the same, or to be numbers, or nothing: labels
 * that differ in case or white space alone, numbers with their unit behind, and "NA".
 */
#ifndef SRNFD_API_ALIKE_H
#define SRNFD_API_ALIKE_H

#include <jansson.h>
#include <stdbool.h>

/* Takes a text into a collection, a JSON object. Texts are alike where they differ in nothing but
   the case of letters from A to Z and white space, at their ends or within. */
void alike_add(json_t *collection, const char *text);
/* The same of the name of a subject, where zeros before a number make no difference either:
   "sub-01" and "Sub-1". */
void alike_add_subject(json_t *collection, const char *text);
/* What is alike in it: [[texts], ..], each of two or more; NULL: nothing. New reference. */
json_t *alike_found(json_t *collection);
/* The warning labels-alike for each of what was found; of: a covariate, or "label". */
void alike_warn(json_t *warnings, const char *of, const json_t *found);

/* The warning subjects-alike for what is alike in a collection of subjects. */
void alike_warn_subjects(json_t *warnings, json_t *collection);

/* Those of an array of texts that other programs write for what is missing, as "NA" and "?"; NULL:
   none. New reference. */
json_t *alike_missing(const json_t *texts);
/* The warning level-says-missing for what was found, NULL for nothing. */
void alike_warn_missing(json_t *warnings, const char *of, const json_t *found);

/* Where the texts of an array are two or more different numbers, each followed by the same unit
   ("50 y", "61 y"), that unit; NULL: they are not. */
const char *alike_unit(const json_t *texts);
/* What numbers are that are written as texts. */
enum alike_written { ALIKE_TEXTS, ALIKE_NUMBERS, ALIKE_COMMAS, ALIKE_DATES };
/* As what one text is meant: a number ("40"), one with a decimal comma ("11,5"), a date of year,
   month and day ("2021-03-01", "1.3.2021"), or a text. */
enum alike_written alike_written(const char *text);
/* The same of all texts of an array; ALIKE_TEXTS where they are not all meant so. */
enum alike_written alike_written_all(const json_t *texts);
/* Its name in figures, and what to do about it, for the end of a sentence. Not of ALIKE_TEXTS. */
const char *alike_written_name(enum alike_written written);
const char *alike_written_advice(const char *name);

/* The first few of the texts, quoted, and how many there are more. */
void alike_quote(const json_t *texts, char *quoted, size_t size);

#endif
