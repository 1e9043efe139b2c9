/*
 * design_tests.c - the nested models that a design tests: each term beside those that do not hold
 * it, all of them, and the levels of a categorical one in pairs.
 */
#include "toolkit/design_columns.h"

/* A term is tested beside all terms that do not hold it. */
static json_t *reduced_of(const struct design_build *build, const struct design_columns *columns,
                          size_t term)
{
    uint32_t tested = build->formula->term[term];
    json_t *reduced = json_array();

    for (size_t c = 0; c < columns->count; c++) {
        if ((build->formula->term[columns->column[c].term] & tested) != tested) {
            (void)json_array_append_new(reduced, json_integer((json_int_t)c));
        }
    }
    return reduced;
}

/* The two levels of a pair are one in the smaller model: its columns are those of the others, and,
   where neither is the reference, the sum of both. */
static json_t *pair_json(const struct design_build *build, const struct design_columns *columns,
                         size_t term, const json_t *own, size_t a, size_t b)
{
    const struct design_factor *factor = NULL;
    json_t *reduced = reduced_of(build, columns, term), *merged = json_array();

    for (size_t f = 0; f < build->formula->factors; f++) {
        factor = design_has_factor(build->formula, term, f) ? &build->factor[f] : factor;
    }
    for (size_t k = 1; k <= json_array_size(own); k++) {
        if (k != a && k != b) {
            (void)json_array_append(reduced, json_array_get(own, k - 1));
        } else if (a > 0) {
            (void)json_array_append(merged, json_array_get(own, k - 1));
        }
    }
    return json_pack("{s:s, s:I, s:[O, O], s:o, s:[O], s:o}", "kind", "pair", "term",
                     (json_int_t)term, "levels", json_array_get(factor->levels, a),
                     json_array_get(factor->levels, b), "reduced", reduced, "tested",
                     json_array_get(own, b - 1), "merged", merged);
}

static bool has_pairs(const struct design_build *build, size_t term, size_t columns)
{
    bool one = false;

    for (size_t f = 0; f < build->formula->factors; f++) {
        one =
            one || (build->formula->term[term] == UINT32_C(1) << f && build->factor[f].categorical);
    }
    return one && columns >= 2 && columns < DESIGN_PAIRS_LEVELS;
}

/* The levels of a term of one categorical factor, or NULL. */
static json_t *levels_of(const struct design_build *build, size_t term)
{
    for (size_t f = 0; f < build->formula->factors; f++) {
        if (build->formula->term[term] == UINT32_C(1) << f && build->factor[f].categorical) {
            return build->factor[f].levels;
        }
    }
    return NULL;
}

json_t *design_tests(const struct design_build *build, const struct design_columns *columns,
                     const json_t *terms)
{
    json_t *tests = json_array(), *all = json_array();

    for (size_t t = 0; t < json_array_size(terms); t++) {
        const json_t *own = json_object_get(json_array_get(terms, t), "columns");

        (void)json_array_append_new(tests, json_pack("{s:s, s:I, s:o, s:O, s:[], s:O*}", "kind",
                                                     "term", "term", (json_int_t)t, "reduced",
                                                     reduced_of(build, columns, t), "tested", own,
                                                     "merged", "levels", levels_of(build, t)));
    }
    for (size_t c = 0; c < columns->count; c++) {
        (void)json_array_append_new(all, json_integer((json_int_t)c));
    }
    (void)json_array_append_new(tests, json_pack("{s:s, s:[], s:o, s:[]}", "kind", "model",
                                                 "reduced", "tested", all, "merged"));
    for (size_t t = 0; t < json_array_size(terms); t++) {
        const json_t *own = json_object_get(json_array_get(terms, t), "columns");
        size_t levels = json_array_size(own) + 1;

        for (size_t b = 1; has_pairs(build, t, levels - 1) && b < levels; b++) {
            for (size_t a = 0; a < b; a++) {
                (void)json_array_append_new(tests, pair_json(build, columns, t, own, a, b));
            }
        }
    }
    return tests;
}
