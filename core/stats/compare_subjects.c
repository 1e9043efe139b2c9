/*
 * compare_subjects.c - a comparison of members made one of subjects: SRNFs and covariates averaged
 * over the members of each (why: compare.c); and which subjects can be exchanged to no effect.
 */
#include "compare.h"

void compare_averages_clear(struct compare_averages *a)
{
    srnf_free(a->memory);
    srnf_free(a->groups);
    srnf_free(a->starts);
    srnf_free(a->surfaces);
}

/* The average of the surfaces of a subject has about the average of their fields. */
static int average_surfaces(const struct subjects *s, struct compare_averages *a)
{
    a->starts = srnf_alloc(s->count, sizeof *a->starts);
    a->surfaces = srnf_alloc(s->count, a->count * sizeof(double));
    if (!a->starts || !a->surfaces) {
        return SRNF_ENOMEM;
    }
    for (size_t k = 0; k < s->count; k++) {
        double *surface = a->surfaces + k * a->count;

        for (size_t m = s->start[k]; m < s->start[k + 1]; m++) {
            const double *one = a->near[s->members[m]];

            for (size_t c = 0; c < a->count; c++) {
                surface[c] += one[c] / (double)s->size[k];
            }
        }
        a->starts[k] = surface;
    }
    a->near = a->starts;
    return SRNF_OK;
}

int compare_average(const struct subjects *s, size_t size, size_t n_covariates,
                    struct compare_averages *a, struct srnf_error *error)
{
    size_t each = size + n_covariates;
    double *covariates;

    a->n = s->count;
    a->groups = srnf_alloc(s->count, sizeof *a->groups);
    a->memory = srnf_alloc(s->count, each * sizeof(double));
    if (!a->groups || !a->memory) {
        return SRNF_ENOMEM;
    }
    covariates = a->memory + s->count * size;
    for (size_t k = 0; k < s->count; k++) {
        double members = (double)s->size[k];

        a->groups[k] = a->group[s->members[s->start[k]]];
        for (size_t m = s->start[k]; m < s->start[k + 1]; m++) {
            size_t i = s->members[m];

            if (a->group[i] != a->groups[k]) {
                return srnf_fail(error, SRNF_EINVAL, (int64_t)i,
                                 "the groups of members of one subject differ, as that of member "
                                 "%zu: subjects cannot exchange them",
                                 i);
            }
            for (size_t p = 0; p < size; p++) {
                a->memory[k * size + p] += a->q[i * size + p] / members;
            }
            /* From the first on, so that the average of equal values is that value. */
            for (size_t c = 0; c < n_covariates; c++) {
                double first = a->covariates[s->members[s->start[k]] * n_covariates + c];

                covariates[k * n_covariates + c] +=
                    i == s->members[s->start[k]]
                        ? first
                        : (a->covariates[i * n_covariates + c] - first) / members;
            }
        }
    }
    a->q = a->memory;
    a->covariates = covariates;
    a->group = a->groups;
    return a->near ? average_surfaces(s, a) : SRNF_OK;
}

static bool same_row(const struct compare_averages *a, size_t n_covariates, size_t i, size_t j)
{
    bool same = a->group[i] == a->group[j];

    for (size_t c = 0; c < n_covariates && same; c++) {
        double x = a->covariates[i * n_covariates + c];
        double y = a->covariates[j * n_covariates + c];

        same = !(x < y || x > y);
    }
    return same;
}

size_t compare_kinds(const struct compare_averages *a, size_t n_covariates, size_t *kind)
{
    size_t kinds = 0;

    for (size_t i = 0; i < a->n; i++) {
        size_t j = 0;

        while (j < i && !same_row(a, n_covariates, i, j)) {
            j++;
        }
        kind[i] = j < i ? kind[j] : kinds++;
    }
    return kinds;
}
