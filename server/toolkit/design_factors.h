/*
 * design_factors.h - the factors of a formula with their values: what the files of the design
 * share.
 */
#ifndef SRNFD_TOOLKIT_DESIGN_FACTORS_H
#define SRNFD_TOOLKIT_DESIGN_FACTORS_H

#include "toolkit/design.h"

/* A factor of all members. */
struct design_factor {
    const struct formula_factor *source;
    bool categorical;
    json_t *levels;             /* of a categorical one: texts, the reference first */
    double lowest, highest;     /* of the covariate itself, before the function */
    double mean;                /* the same */
    struct formula_state state; /* of its functions */
    double *value; /* [n] numbers after the function; or of a categorical one its level */
};

struct design_build {
    struct process_inputs *given;
    const struct formula *formula;
    const json_t *members;
    const char *where; /* design_describe */
    size_t n;
    json_t *mixed;   /* array: of factors of texts, many of which are numbers (design.h) */
    json_t *alike;   /* array: of levels that may be meant to be the same (design.h) */
    json_t *missing; /* array: of levels that may be meant to be none (design.h) */
    struct design_factor factor[FORMULA_FACTORS_MAX];
};

/* The text of a level; size bytes. False: the value is none. */
bool design_level(const json_t *value, size_t size, char *text);
/* Number of a level; its length where it is none. */
size_t design_find_level(const struct design_factor *factor, const char *text);
/* Reads all factors; false with problems noted. design_factors_clear in any case. */
bool design_factors_read(struct design_build *build);
void design_factors_clear(struct design_build *build);

#endif
