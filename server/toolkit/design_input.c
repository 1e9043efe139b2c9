/*
 * design_input.c - a described design as the numbers that srnf_regress takes.
 */
#include "toolkit/design.h"

static double *type_rows(const json_t *rows, size_t n, size_t columns)
{
    double *values = srnf_alloc(n * columns + 1, sizeof *values);

    for (size_t k = 0; values && k < n * columns; k++) {
        values[k] =
            json_number_value(json_array_get(json_array_get(rows, k / columns), k % columns));
    }
    return values;
}

/* The columns of the design with these numbers, and the sum of those to be merged as one more. */
static double *pick(const struct design_input *input, size_t n, const json_t *numbers,
                    const json_t *merged)
{
    size_t more = json_array_size(merged) > 0, count = json_array_size(numbers) + more;
    size_t columns = input->design.columns;
    double *values = srnf_alloc(n * count + 1, sizeof *values);

    for (size_t i = 0; values && i < n; i++) {
        const double *row = input->values + i * columns;

        for (size_t k = 0; k + more < count; k++) {
            values[i * count + k] = row[json_integer_value(json_array_get(numbers, k))];
        }
        for (size_t k = 0; k < json_array_size(merged); k++) {
            values[i * count + count - 1] += row[json_integer_value(json_array_get(merged, k))];
        }
    }
    return values;
}

bool design_type(const json_t *design, size_t n, struct design_input *input)
{
    const json_t *tests = json_object_get(design, "tests");
    size_t columns = json_array_size(json_object_get(design, "columns"));
    size_t points = json_array_size(json_object_get(design, "atRows"));
    size_t count = json_array_size(tests);
    bool good;

    *input =
        (struct design_input){.design = {.columns = columns, .tests = count, .points = points}};
    input->values = type_rows(json_object_get(design, "rows"), n, columns);
    input->at = type_rows(json_object_get(design, "atRows"), points, columns);
    input->nested = srnf_alloc(count + 1, sizeof *input->nested);
    input->columns = srnf_alloc(2 * count + 1, sizeof *input->columns);
    good = input->values && input->at && input->nested && input->columns;
    for (size_t t = 0; good && t < count; t++) {
        const json_t *test = json_array_get(tests, t);
        const json_t *reduced = json_object_get(test, "reduced");
        const json_t *tested = json_object_get(test, "tested");
        const json_t *merged = json_object_get(test, "merged");

        input->columns[2 * t] = pick(input, n, reduced, merged);
        input->columns[2 * t + 1] = pick(input, n, tested, NULL);
        input->nested[t] = (struct srnf_nested){
            json_array_size(reduced) + (json_array_size(merged) > 0), json_array_size(tested),
            input->columns[2 * t], input->columns[2 * t + 1]};
        good = input->columns[2 * t] && input->columns[2 * t + 1];
    }
    input->design.values = input->values;
    input->design.at = input->at;
    input->design.nested = input->nested;
    return good;
}

void design_clear(struct design_input *input)
{
    for (size_t t = 0; input->columns && t < 2 * input->design.tests; t++) {
        srnf_free(input->columns[t]);
    }
    srnf_free(input->columns);
    srnf_free(input->nested);
    srnf_free(input->values);
    srnf_free(input->at);
    *input = (struct design_input){0};
}
