/*
 * warp.c - warps as chains: kept, replayed on other points, cleared.
 */
#include "tabulated.h"

#include <string.h>

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

void srnf_warp_clear(struct srnf_warp *warp)
{
    for (size_t k = 0; k < warp->n_links; k++) {
        srnf_free(warp->links[k].values);
    }
    srnf_free(warp->links);
    *warp = (struct srnf_warp){0};
}

static void turn(const double r[9], double *x)
{
    double y[3] = {x[0], x[1], x[2]};

    for (size_t k = 0; k < 3; k++) {
        x[k] = r[3 * k] * y[0] + r[3 * k + 1] * y[1] + r[3 * k + 2] * y[2];
    }
}

/* What the links of a chain are followed by, kept from one to the next of the same degree. */
struct follower {
    const struct srnf_context *context;
    struct fields fields;
    struct fine_steps fine;
    double *scratch;
};

static int apply_directly(struct follower *f, const struct srnf_warp_link *link, size_t n,
                          double *points, double *jacobian)
{
    if (f->fields.degree != link->degree) {
        fields_clear(&f->fields);
        if (fields_create(&f->fields, link->degree, f->context)) {
            return SRNF_ENOMEM;
        }
    }
    if (link->kind == SRNF_WARP_EXP_INVERSE) {
        return fields_apply_inverse(&f->fields, link->values, n, points, jacobian, f->scratch);
    }
    (void)fields_apply(&f->fields, link->values, n, points, jacobian, points, jacobian, f->scratch);
    return SRNF_OK;
}

static int apply_finely(struct follower *f, const struct srnf_warp_link *link, size_t n,
                        double *points, double *jacobian)
{
    if (f->fine.direct.degree != link->degree) {
        fine_steps_clear(&f->fine);
        if (fine_steps_create(&f->fine, link->degree, f->context)) {
            return SRNF_ENOMEM;
        }
    }
    return fine_steps_apply(&f->fine, link->values, link->kind == SRNF_WARP_EXP_INVERSE, f->context,
                            n, points, jacobian);
}

static int apply_link(struct follower *f, const struct srnf_warp_link *link, size_t n,
                      double *points, double *jacobian)
{
    if (link->kind == SRNF_WARP_ROTATION) {
        for (size_t i = 0; i < n; i++) {
            turn(link->values, points + 3 * i);
        }
        return SRNF_OK;
    }
    if (link->kind == SRNF_WARP_SERIES) {
        return warp_follow_series(link->degree, link->values, f->context, n, points, jacobian);
    }
    return fine_steps_pay(link->degree, link->kind == SRNF_WARP_EXP_INVERSE, n)
               ? apply_finely(f, link, n, points, jacobian)
               : apply_directly(f, link, n, points, jacobian);
}

int warp_follow(const struct srnf_warp *warp, const struct srnf_context *context, size_t n,
                double *points, double *jacobian)
{
    struct follower f = {.context = context,
                         .scratch = srnf_alloc(FIELDS_INVERSE * n, sizeof(double))};
    int status = f.scratch ? SRNF_OK : SRNF_ENOMEM;

    for (size_t k = 0; k < warp->n_links && status == SRNF_OK; k++) {
        status = apply_link(&f, &warp->links[k], n, points, jacobian);
        status = srnf_is_canceled(context) ? SRNF_ECANCELED : status;
    }
    fields_clear(&f.fields);
    fine_steps_clear(&f.fine);
    srnf_free(f.scratch);
    return status;
}

int warp_apply(const struct srnf_warp *warp, const struct srnf_context *context, size_t n,
               const double *points, double *warped, double *jacobian)
{
    double *moved = srnf_alloc(4 * n, sizeof(double));
    double *product;
    int status;

    if (!moved) {
        return SRNF_ENOMEM;
    }
    product = moved + 3 * n;
    memcpy(moved, points, 3 * n * sizeof *moved);
    for (size_t i = 0; i < n; i++) {
        product[i] = 1.0;
    }
    status = warp_follow(warp, context, n, moved, product);
    if (status == SRNF_OK) {
        memcpy(warped, moved, 3 * n * sizeof *warped);
    }
    if (jacobian && status == SRNF_OK) {
        memcpy(jacobian, product, n * sizeof *jacobian);
    }
    srnf_free(moved);
    return status;
}

int srnf_warp_apply(const struct srnf_warp *warp, size_t n, const double *points, double *warped,
                    double *jacobian)
{
    return warp_apply(warp, NULL, n, points, warped, jacobian);
}

int warp_append(struct srnf_warp *chain, enum srnf_warp_kind kind, size_t degree,
                const double *values)
{
    size_t blocks = kind == SRNF_WARP_SERIES ? 3 : 2;
    size_t count = kind == SRNF_WARP_ROTATION ? 9 : blocks * srnf_coefficient_count(degree);
    double *copy;

    if (chain->n_links == chain->capacity) {
        size_t capacity = 2 * chain->capacity + 16;
        struct srnf_warp_link *links = srnf_alloc(capacity, sizeof *links);

        if (!links) {
            return SRNF_ENOMEM;
        }
        if (chain->n_links > 0) {
            memcpy(links, chain->links, chain->n_links * sizeof *links);
        }
        srnf_free(chain->links);
        chain->links = links;
        chain->capacity = capacity;
    }
    copy = srnf_alloc(count, sizeof *copy);
    if (!copy) {
        return SRNF_ENOMEM;
    }
    memcpy(copy, values, count * sizeof *copy);
    chain->links[chain->n_links++] = (struct srnf_warp_link){kind, degree, copy};
    return SRNF_OK;
}

static int append_inverse(struct srnf_warp *out, const struct srnf_warp_link *link)
{
    if (link->kind == SRNF_WARP_ROTATION) {
        double transposed[9];

        for (size_t i = 0; i < 9; i++) {
            transposed[i] = link->values[3 * (i % 3) + i / 3];
        }
        return warp_append(out, SRNF_WARP_ROTATION, 0, transposed);
    }
    if (link->kind == SRNF_WARP_SERIES) {
        return SRNF_ENUMERIC;
    }
    return warp_append(out, link->kind == SRNF_WARP_EXP ? SRNF_WARP_EXP_INVERSE : SRNF_WARP_EXP,
                       link->degree, link->values);
}

int warp_invert(const struct srnf_warp *chain, struct srnf_warp *out)
{
    int status = SRNF_OK;

    for (size_t k = chain->n_links; k-- > 0 && status == SRNF_OK;) {
        status = append_inverse(out, &chain->links[k]);
    }
    return status;
}

int warp_create(struct warp *warp, const struct target *target)
{
    *warp = (struct warp){.n = target->n};
    warp->points = srnf_alloc(3 * target->n, sizeof(double));
    warp->jacobian = srnf_alloc(target->n, sizeof(double));
    memcpy(warp->rotation, identity, sizeof identity);
    if (!warp->points || !warp->jacobian || warp_rotate(warp, target, identity)) {
        warp_clear(warp);
        return SRNF_ENOMEM;
    }
    return SRNF_OK;
}

void warp_clear(struct warp *warp)
{
    srnf_free(warp->points);
    srnf_free(warp->jacobian);
    srnf_warp_clear(&warp->chain);
    *warp = (struct warp){0};
}

int warp_rotate(struct warp *warp, const struct target *target, const double rotation[9])
{
    srnf_warp_clear(&warp->chain);
    memcpy(warp->points, target->points, 3 * target->n * sizeof(double));
    for (size_t i = 0; i < target->n; i++) {
        turn(rotation, warp->points + 3 * i);
        warp->jacobian[i] = 1.0;
    }
    return warp_append(&warp->chain, SRNF_WARP_ROTATION, 0, rotation);
}

int warp_replay(struct warp *warp, const struct target *target, const struct srnf_warp *chain,
                const struct srnf_context *context)
{
    struct srnf_warp copy = {0};
    int status = SRNF_OK;

    for (size_t k = 0; k < chain->n_links && status == SRNF_OK; k++) {
        status = warp_append(&copy, chain->links[k].kind, chain->links[k].degree,
                             chain->links[k].values);
    }
    if (status == SRNF_OK) {
        status =
            warp_apply(chain, context, target->n, target->points, warp->points, warp->jacobian);
    }
    if (status) {
        srnf_warp_clear(&copy);
        return status;
    }
    srnf_warp_clear(&warp->chain);
    warp->chain = copy;
    return SRNF_OK;
}
