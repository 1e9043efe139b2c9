/*
 * design_names.h - what a name of a formula was most likely meant to be, where no covariate has it.
 */
#ifndef SRNFD_TOOLKIT_DESIGN_NAMES_H
#define SRNFD_TOOLKIT_DESIGN_NAMES_H

#include <jansson.h>
#include <stddef.h>

/* The end of a sentence: that a covariate of the object differs from the name in how its letters
   are composed (Unicode NFC and NFD), or that one begins so in the formula, is no plain word and
   needs Q(".."); "" for neither. */
void design_name_advice(const json_t *covariates, const char *formula, const char *name, char *text,
                        size_t size);

#endif
