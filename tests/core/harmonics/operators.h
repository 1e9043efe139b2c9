/*
 * operators.h - the five transforms as a table, on arrays that can all be either input or output.
 */
#ifndef TESTS_SPHERE_OPERATORS_H
#define TESTS_SPHERE_OPERATORS_H

#include "fixture.h"

/* Arrays of one batch: coefficients, and one or two sets of fields. */
struct arrays {
    double *coefficients, *first, *second;
};

struct transform {
    const char *name;
    bool from_fields; /* fields to coefficients; otherwise the other way */
    bool derivatives; /* works on both sets of fields */
    void (*apply)(const struct fixture *f, size_t batch, const struct arrays *a, void *workspace);
};

static inline void synthesis(const struct fixture *f, size_t batch, const struct arrays *a,
                             void *workspace)
{
    srnf_sht_synthesis(f->sht, batch, a->coefficients, a->first, workspace);
}

static inline void synthesis_adjoint(const struct fixture *f, size_t batch, const struct arrays *a,
                                     void *workspace)
{
    srnf_sht_synthesis_adjoint(f->sht, batch, a->first, a->coefficients, workspace);
}

static inline void analysis(const struct fixture *f, size_t batch, const struct arrays *a,
                            void *workspace)
{
    srnf_sht_analysis(f->sht, batch, a->first, a->coefficients, workspace);
}

static inline void gradient(const struct fixture *f, size_t batch, const struct arrays *a,
                            void *workspace)
{
    srnf_sht_gradient(f->sht, batch, a->coefficients, a->first, a->second, workspace);
}

static inline void gradient_adjoint(const struct fixture *f, size_t batch, const struct arrays *a,
                                    void *workspace)
{
    srnf_sht_gradient_adjoint(f->sht, batch, a->first, a->second, a->coefficients, workspace);
}

static const struct transform operators[] = {
    {"synthesis", false, false, synthesis},
    {"synthesis_adjoint", true, false, synthesis_adjoint},
    {"analysis", true, false, analysis},
    {"gradient", false, true, gradient},
    {"gradient_adjoint", true, true, gradient_adjoint},
};
#define OPERATORS (sizeof operators / sizeof operators[0])

static inline struct arrays arrays_create(const struct fixture *f, size_t batch)
{
    struct arrays a;

    a.coefficients = fixture_doubles(batch * f->coefficients);
    a.first = fixture_doubles(batch * f->points);
    a.second = fixture_doubles(batch * f->points);
    return a;
}

static inline void arrays_free(struct arrays *a)
{
    srnf_free(a->coefficients);
    srnf_free(a->first);
    srnf_free(a->second);
}

/* Random input, NaN for output. */
static inline void arrays_fill(const struct transform *op, const struct fixture *f, size_t batch,
                               struct test_random *random, struct arrays *a)
{
    for (size_t i = 0; i < batch * f->coefficients; i++) {
        a->coefficients[i] = op->from_fields ? NAN : test_random_normal(random);
    }
    for (size_t i = 0; i < batch * f->points; i++) {
        a->first[i] = op->from_fields ? test_random_normal(random) : NAN;
        a->second[i] = op->from_fields && op->derivatives ? test_random_normal(random) : NAN;
    }
}

/* Input copied, NaN for output. */
static inline void arrays_copy_input(const struct transform *op, const struct fixture *f,
                                     size_t batch, const struct arrays *from, struct arrays *to)
{
    for (size_t i = 0; i < batch * f->coefficients; i++) {
        to->coefficients[i] = op->from_fields ? NAN : from->coefficients[i];
    }
    for (size_t i = 0; i < batch * f->points; i++) {
        to->first[i] = op->from_fields ? from->first[i] : NAN;
        to->second[i] = op->from_fields ? from->second[i] : NAN;
    }
}

#endif
