/*
 * design_points.c - the points at which a design predicts: covariates that are not given have their
 * mean or first level, and those beyond what members have are told.
 */
#include "toolkit/design_columns.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/alike.h"
#include "toolkit/covariates.h"

#define POINTER_SIZE 160

/* To a covariate of a point. */
static void set_pointer(const struct design_build *build, size_t index, const char *name,
                        char pointer[POINTER_SIZE])
{
    const char *where = build->where;

    if (where[strlen(where) - 1] == '/') {
        char point[POINTER_SIZE];

        (void)snprintf(point, sizeof point, "%.80s%zu", where, index);
        problem_point(point, name, pointer, POINTER_SIZE);
    } else {
        (void)snprintf(pointer, POINTER_SIZE, "%s", where);
    }
}

/* One factor at a point, into the row; notes what is wrong, and what is beyond the members. */
static void read_point(const struct design_build *build, size_t f, size_t index, json_t *point,
                       json_t *beyond, double *row)
{
    const struct design_factor *factor = &build->factor[f];
    const char *name = factor->source->name;
    const json_t *value = json_object_get(point, name);
    char text[FORMULA_NAME_MAX], pointer[POINTER_SIZE];

    set_pointer(build, index, name, pointer);
    if (!value) {
        (void)json_object_set_new(point, name,
                                  factor->categorical ? json_copy(json_array_get(factor->levels, 0))
                                                      : json_real(factor->mean));
        value = json_object_get(point, name);
    }
    if (factor->categorical) {
        bool known = design_level(value, sizeof text, text) &&
                     design_find_level(factor, text) < json_array_size(factor->levels);

        row[f] = known ? (double)design_find_level(factor, text) : 0.0;
        (void)json_object_set_new(point, name, json_string(known ? text : ""));
        if (!known) {
            char levels[400];

            alike_quote(factor->levels, levels, sizeof levels);
            problem_add(build->given->list, pointer,
                        "\"%.60s\" must be a level that members have: %s", name, levels);
        }
        return;
    }
    (void)json_object_set_new(point, name,
                              json_is_number(value) ? json_real(json_number_value(value) + 0.0)
                                                    : json_null());
    value = json_object_get(point, name);
    row[f] = json_is_number(value)
                 ? formula_apply(factor->source, &factor->state, json_number_value(value))
                 : NAN;
    if (!json_is_number(value)) {
        problem_add(build->given->list, pointer, "\"%.60s\" must be a number", name);
    } else if (!isfinite(row[f])) {
        char why[FORMULA_WHY_MAX];

        formula_why(factor->source, &factor->state, json_number_value(value), why);
        problem_add(build->given->list, pointer, "%.80s is not finite: %s", factor->source->text,
                    why);
    } else if (!covariate_takes(row[f]) || !covariate_takes(json_number_value(value))) {
        problem_add(build->given->list, pointer,
                    "%.80s is %.6g there, \"%.60s\" %.6g; " COVARIATE_TAKEN, factor->source->text,
                    row[f], name, json_number_value(value));
    } else if (json_number_value(value) < factor->lowest ||
               json_number_value(value) > factor->highest) {
        (void)json_array_append_new(beyond, json_pack("{s:I, s:s, s:f, s:f, s:f}", "index",
                                                      (json_int_t)index, "covariate", name, "value",
                                                      json_number_value(value), "lowest",
                                                      factor->lowest, "highest", factor->highest));
    }
}

static void check_point_names(const struct design_build *build, size_t index, json_t *point)
{
    const char *key;
    json_t *value;
    char pointer[POINTER_SIZE];

    json_object_foreach(point, key, value)
    {
        bool known = false;

        for (size_t f = 0; f < build->formula->factors; f++) {
            known = known ||
                    (build->factor[f].value && strcmp(build->formula->factor[f].name, key) == 0);
        }
        if (!known) {
            set_pointer(build, index, key, pointer);
            problem_add(build->given->list, pointer, "\"%.60s\" is no covariate of the formula",
                        key);
        }
    }
}

void design_set_points(const struct design_build *build, const struct design_columns *columns,
                       const json_t *at, json_t *design)
{
    json_t *points = json_array(), *rows = json_array(), *beyond = json_array();

    for (size_t k = 0; k < json_array_size(at); k++) {
        json_t *point = json_deep_copy(json_array_get(at, k));
        double row[FORMULA_FACTORS_MAX] = {0};

        check_point_names(build, k, point);
        for (size_t f = 0; f < build->formula->factors; f++) {
            if (build->factor[f].value) {
                read_point(build, f, k, point, beyond, row);
            }
        }
        (void)json_array_append_new(rows, design_columns_row(build, columns, row));
        (void)json_array_append_new(points, point);
    }
    (void)json_object_set_new(design, "at", points);
    (void)json_object_set_new(design, "atRows", rows);
    (void)json_object_set_new(design, "beyond", beyond);
}
