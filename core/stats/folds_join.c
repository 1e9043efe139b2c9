/*
 * folds_join.c - folds of subjects of several structures, from the folds of each structure.
 *
 * Inner products of the vectors (sqrt(w_1) q_1, .., sqrt(w_P) q_P, sqrt(w) x) are sums of w_p times
 * those of the parts and w times those of the positions, which nothing has to be fitted for. A fold
 * needs nothing else (folds_scores.c). In the fold of a subject the fields of
 * a part are registered to the template that its own comparison has for that subject, a member of
 * another one; so what a fold says of the others does not depend, in any bit, on the subject left
 * out, as in the folds of one part.
 */
#include "folds.h"

#include "srnf/parts.h"

#include <math.h>
#include <string.h>

#define COMPONENTS_MAX 64

struct joining {
    const struct folds_sum *sum;
    const struct subjects *subjects;
    struct srnf_folds *out;
};

int folds_check_positions(size_t n, const struct folds_sum *sum, struct srnf_error *error)
{
    size_t each = 3 * sum->n_parts;

    if (sum->positions && !(sum->position_weight > 0.0 && isfinite(sum->position_weight))) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the weight of the positions is not above 0");
    }
    for (size_t k = 0; sum->positions && k < n * each; k++) {
        if (!isfinite(sum->positions[k])) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)(k / each),
                             "a position of member %zu is not finite", k / each);
        }
    }
    return SRNF_OK;
}

static int check(const struct folds_sum *sum, size_t components, struct srnf_error *error)
{
    size_t n_parts = sum->n_parts;
    const struct srnf_folds *parts = sum->parts;
    const double *weights = sum->weights;

    if (n_parts < 1 || n_parts > SRNF_PARTS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "%zu parts are not 1 to %zu", n_parts,
                         SRNF_PARTS_MAX);
    }
    if (components == 0 || components > COMPONENTS_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "components is %zu, not 1 to %d", components,
                         COMPONENTS_MAX);
    }
    for (size_t p = 0; p < n_parts; p++) {
        if (!(weights[p] > 0.0 && isfinite(weights[p]))) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)p,
                             "the weight of part %zu is not above 0", p);
        }
        if (parts[p].n != parts[0].n || !parts[p].templates || !parts[p].products ||
            !parts[p].subjects != !parts[0].subjects ||
            (parts[p].subjects &&
             memcmp(parts[p].subjects, parts[0].subjects, parts[0].n * sizeof(size_t)) != 0)) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)p,
                             "part %zu was not compared by the members of the first and kept", p);
        }
    }
    return folds_check_positions(parts[0].n, sum, error);
}

static void add_positions(const struct folds_sum *sum, size_t n, double *products)
{
    size_t each = 3 * sum->n_parts;

    for (size_t i = 0; i < n * n; i++) {
        const double *a = sum->positions + i / n * each;
        const double *b = sum->positions + i % n * each;
        double product = 0.0;

        for (size_t k = 0; k < each; k++) {
            product += a[k] * b[k];
        }
        products[i] += sum->position_weight * product;
    }
}

void folds_sum_products(const struct folds_sum *sum, size_t member, double *products)
{
    size_t n = sum->parts[0].n;

    memset(products, 0, n * n * sizeof(double));
    for (size_t p = 0; p < sum->n_parts; p++) {
        const struct srnf_folds *part = &sum->parts[p];
        const double *own = part->products[member < n ? part->templates[member] : part->medoid];

        for (size_t k = 0; k < n * n; k++) {
            products[k] += sum->weights[p] * own[k];
        }
    }
    if (sum->positions) {
        add_positions(sum, n, products);
    }
}

static int join_body(void *argument, size_t subject, const struct srnf_context *context,
                     struct srnf_error *error)
{
    const struct joining *j = argument;
    const struct subjects *s = j->subjects;
    struct srnf_folds *out = j->out;
    size_t n = out->n, size = n * out->components;
    size_t first = s->members[s->start[subject]];
    double *products = srnf_alloc(n, n * sizeof(double));
    int status = products ? SRNF_OK : SRNF_ENOMEM;

    (void)context;
    (void)error;
    if (status == SRNF_OK) {
        folds_sum_products(j->sum, first, products);
        status = fold_describe(s, subject, products, out->components, out->scores + first * size,
                               out->distances, out->spread + first);
    }
    for (size_t m = 1; m < s->size[subject] && status == SRNF_OK; m++) {
        size_t i = s->members[s->start[subject] + m];

        memcpy(out->scores + i * size, out->scores + first * size, size * sizeof(double));
        out->spread[i] = out->spread[first];
    }
    srnf_free(products);
    return status;
}

static int open_out(const struct srnf_folds *part, const struct subjects *s, size_t components,
                    struct srnf_folds *out)
{
    size_t n = part->n, most = n - s->largest - 1;

    out->components = components < most ? components : most;
    out->scores = srnf_alloc(n * n, out->components * sizeof(double));
    out->distances = srnf_alloc(n, n * sizeof(double));
    out->spread = srnf_alloc(n, sizeof(double));
    if (part->subjects) {
        out->subjects = srnf_alloc(n, sizeof *out->subjects);
    }
    if (!out->scores || !out->distances || !out->spread || (part->subjects && !out->subjects)) {
        return SRNF_ENOMEM;
    }
    if (part->subjects) {
        memcpy(out->subjects, part->subjects, n * sizeof *out->subjects);
    }
    return SRNF_OK;
}

int srnf_folds_join(size_t n_parts, const struct srnf_folds *parts, const double *weights,
                    const double *positions, double position_weight, size_t components,
                    const struct srnf_context *context, struct srnf_folds *joint,
                    struct srnf_error *error)
{
    const struct folds_sum sum = {n_parts, parts, weights, positions, position_weight};
    struct stats_progress progress = {0.0, 1.0, "joining the parts"};
    struct srnf_error first = {0};
    struct subjects subjects = {0};
    struct joining joining = {&sum, &subjects, joint};
    int status;

    *joint = (struct srnf_folds){.n = n_parts > 0 ? parts[0].n : 0};
    status = check(&sum, components, &first);
    status = status ? status : subjects_open(&subjects, joint->n, parts[0].subjects, &first);
    status = status ? status : open_out(&parts[0], &subjects, components, joint);
    status =
        status ? status : stats_run(context, subjects.count, join_body, &joining, progress, &first);
    subjects_clear(&subjects);
    if (status) {
        srnf_folds_clear(joint);
        return stats_fail(error, status, &first);
    }
    return SRNF_OK;
}
