/*
 * register.c - elastic registration of two surfaces: what is checked, and the calls.
 */
#include "register.h"
#include "tabulated.h"

#include <math.h>
#include <string.h>

void srnf_registration_clear(struct srnf_registration *r)
{
    srnf_free(r->coefficients);
    srnf_free(r->q);
    srnf_free(r->points);
    srnf_free(r->jacobian);
    srnf_warp_clear(&r->warp);
    *r = (struct srnf_registration){0};
}

static int call_create(struct call *c, const struct srnf_sht *sht, const double *template_surface,
                       const double *template_q, const double *moving)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);

    c->sht = sht;
    c->degree = srnf_sht_degree(sht);
    c->count = 3 * srnf_coefficient_count(c->degree);
    c->n = grid->n_theta * grid->n_phi;
    c->q1 = srnf_alloc(6 * c->n, sizeof(double));
    c->workspace = srnf_alloc(1, srnf_surface_workspace_size(sht));
    c->own_tools = !c->tools;
    c->tools = c->tools ? c->tools : tools_create();
    if (!c->q1 || !c->workspace || !c->tools) {
        return SRNF_ENOMEM;
    }
    c->q2 = c->q1 + 3 * c->n;
    if (template_q) {
        memcpy(c->q1, template_q, 3 * c->n * sizeof(double));
    } else {
        field_represent(sht, c->options->representation, template_surface, c->q1, c->workspace);
    }
    field_represent(sht, c->options->representation, moving, c->q2, c->workspace);
    return SRNF_OK;
}

static void call_clear(struct call *c)
{
    srnf_free(c->q1);
    srnf_free(c->workspace);
    if (c->own_tools) {
        tools_destroy(c->tools);
    }
}

/* ---- Driver ---------------------------------------------------------------------------------- */

static int check(const struct srnf_sht *sht, const double *template_surface,
                 const double *template_q, const double *moving,
                 const struct srnf_register_options *o, struct srnf_error *error)
{
    size_t count = 3 * srnf_coefficient_count(srnf_sht_degree(sht));
    int status;

    if (!template_surface && !template_q) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the template is missing");
    }
    if (o->symmetric && !template_surface) {
        return srnf_fail(error, SRNF_EINVAL, -1,
                         "symmetric registration needs the template's surface");
    }
    status = registration_check(o, error);
    if (status) {
        return status;
    }
    for (size_t i = 0; i < count; i++) {
        if (!isfinite(moving[i]) || (template_surface && !isfinite(template_surface[i]))) {
            return srnf_fail(error, SRNF_EINVAL, (int64_t)i, "a coefficient is not finite");
        }
    }
    return SRNF_OK;
}

/* Neither q may be zero; the template's may have come from outside. */
static int check_fields(const struct call *c)
{
    const struct srnf_grid *grid = srnf_sht_grid(c->sht);
    double norm1 = srnf_inner_product(grid, c->q1, c->q1);
    double norm2 = srnf_inner_product(grid, c->q2, c->q2);

    return norm1 > 0.0 && isfinite(norm1) && norm2 > 0.0 && isfinite(norm2) ? SRNF_OK : SRNF_EINVAL;
}

/* What all calls begin with: found, and what it is told from. inverse_consistency: as of a
   registration. */
static int search_call(struct call *c, const struct srnf_sht *sht, const double *template_surface,
                       const double *template_q, const double *moving,
                       const struct srnf_registration *warm, struct search_result *found,
                       double *inverse_consistency)
{
    int status = call_create(c, sht, template_surface, template_q, moving);

    status = status ? status : check_fields(c);
    if (status) {
        return status;
    }
    return c->options->symmetric
               ? register_both_ways(c, template_surface, moving, found, inverse_consistency)
               : register_one_way(c, c->q1, template_q ? NULL : template_surface, moving,
                                  warm ? &warm->warp : NULL, found);
}

/* Cancellation comes before whatever else went wrong because of it. */
static int finish(const struct srnf_context *context, const struct landmark_search *landmarks,
                  int status, struct srnf_error *error)
{
    status = srnf_is_canceled(context) ? SRNF_ECANCELED : status;
    if (status == SRNF_EUNMATCHED) {
        return landmarks_fail(landmarks, error);
    }
    return status ? srnf_fail(error, status, -1, "%s",
                              status == SRNF_EINVAL ? "a field is zero or not finite"
                                                    : srnf_strerror(status))
                  : SRNF_OK;
}

int registration_distance(const struct srnf_sht *sht, const double *template_surface,
                          const double *moving, const struct subject *template_subject,
                          const struct subject *moving_subject, struct tabulated_tools *tools,
                          const struct srnf_register_options *options,
                          const struct srnf_context *context, double *distance,
                          struct srnf_error *error)
{
    struct call call = {.options = options,
                        .context = context,
                        .subjects = {template_subject, moving_subject},
                        .tools = tools};
    struct search_result found = {.iterations = 0};
    double ignored;
    int status = check(sht, template_surface, NULL, moving, options, error);

    if (status) {
        return status;
    }
    status = search_call(&call, sht, template_surface, NULL, moving, NULL, &found, &ignored);
    *distance = found.distance;
    search_result_clear(&found);
    call_clear(&call);
    return finish(context, call.landmarks, status, error);
}

/* What landmarks ask of the options. */
static int check_landmarks(const struct srnf_register_options *options,
                           const struct srnf_landmarks *landmarks, struct srnf_error *error)
{
    if (options->exact) {
        return srnf_fail(error, SRNF_EINVAL, -1, "exact and landmarks exclude each other");
    }
    if (!options->reparameterization) {
        return srnf_fail(error, SRNF_EINVAL, -1, "landmarks need reparameterization");
    }
    return srnf_landmarks_check(landmarks, options->degree, error);
}

int srnf_register(const struct srnf_sht *sht, const double *template_surface,
                  const double *template_q, const double *moving,
                  const struct srnf_register_options *options, const struct srnf_registration *warm,
                  const struct srnf_context *context, struct srnf_registration *registration,
                  struct srnf_error *error)
{
    return srnf_register_landmarks(sht, template_surface, template_q, moving, options, NULL, warm,
                                   context, registration, error);
}

int srnf_register_landmarks(const struct srnf_sht *sht, const double *template_surface,
                            const double *template_q, const double *moving,
                            const struct srnf_register_options *options,
                            const struct srnf_landmarks *landmarks,
                            const struct srnf_registration *warm,
                            const struct srnf_context *context,
                            struct srnf_registration *registration, struct srnf_error *error)
{
    struct srnf_register_options defaults = srnf_register_options_defaults();
    struct call call = {.options = options ? options : &defaults, .context = context};
    struct landmark_search guide = {.worst = 0};
    struct search_result found = {.iterations = 0};
    int status;

    *registration = (struct srnf_registration){0};
    status = check(sht, template_surface, template_q, moving, call.options, error);
    if (status == SRNF_OK && landmarks) {
        guide.pairs = *landmarks;
        call.landmarks = &guide;
        status = check_landmarks(call.options, landmarks, error);
    }
    if (status) {
        return status;
    }
    status = search_call(&call, sht, template_surface, template_q, moving, warm, &found,
                         &registration->inverse_consistency);
    if (status == SRNF_OK) {
        status = register_report(&call, moving, &found, registration);
    }
    status = finish(context, call.landmarks, status, error);
    if (status) {
        srnf_registration_clear(registration);
    }
    search_result_clear(&found);
    call_clear(&call);
    return status;
}

/* The search without its search: the chain as it is, measured. */
static int measure_known(const struct call *c, const double *template_surface, const double *moving,
                         const struct srnf_warp *warp, struct search_result *found)
{
    struct search search;
    int status = search_create(&search, c->sht, c->q1, template_surface, moving, c->options, NULL,
                               c->tools, c->context);

    if (status == SRNF_OK) {
        status = search_evaluate(&search, warp, found);
        status = status ? status : search_extremes(&search, found);
        search_clear(&search);
    }
    if (status == SRNF_OK && !isfinite(found->distance)) {
        status = SRNF_ENUMERIC; /* the chain folds at a node */
    }
    return status;
}

int srnf_register_known(const struct srnf_sht *sht, const double *template_surface,
                        const double *moving, const struct srnf_register_options *options,
                        const struct srnf_warp *warp, const struct srnf_context *context,
                        struct srnf_registration *registration, struct srnf_error *error)
{
    struct srnf_register_options defaults = srnf_register_options_defaults();
    struct call call = {.options = options ? options : &defaults, .context = context};
    struct search_result found = {.iterations = 0};
    int status;

    *registration = (struct srnf_registration){0};
    status = check(sht, template_surface, NULL, moving, call.options, error);
    if (status) {
        return status;
    }
    if (warp->n_links == 0) {
        return srnf_fail(error, SRNF_EINVAL, -1, "the warp has no links");
    }
    status = call_create(&call, sht, template_surface, NULL, moving);
    if (status == SRNF_OK) {
        status = check_fields(&call);
    }
    if (status == SRNF_OK) {
        status = measure_known(&call, template_surface, moving, warp, &found);
    }
    if (status == SRNF_OK) {
        status = register_report(&call, moving, &found, registration);
    }
    status = finish(context, call.landmarks, status, error);
    if (status) {
        srnf_registration_clear(registration);
    }
    search_result_clear(&found);
    call_clear(&call);
    return status;
}
