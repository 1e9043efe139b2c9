/*
 * register.c - elastic registration of two surfaces: options, both directions, and the report.
 *
 * Symmetric mode runs the pair in a fixed order, whichever way it was asked for, so that d(a, b) =
 * d(b, a) to the last bit: both directions are searched, and the lower objective is kept (the
 * objective itself is symmetric). The answer is the warp or its inverse. Why the search ended is
 * the worse reason of both: one that was cut off might have ended lower than the one that is kept.
 * In exact mode, whose steps are all of one kind, two swaps follow, in which the warp is inverted
 * and optimized in the other direction. (Swaps begin where there is little to gain: that one gained
 * nothing tells nothing.)
 *
 * Fields are reported on the template's grid, from exact values; distance and objective as the
 * search measured them, on a grid that its degree cannot overfit (search.c); the least and the
 * largest Jacobian of its nodes and about the extreme ones (extremes.c). The coefficients of the
 * registered surface are a projection to degree L: truncation_error says what it costs.
 */
#include "landmarks.h"

#include <math.h>
#include <string.h>

#define SWAPS 2
#define ROUNDS ((size_t)2) /* at most, of steps in both domains in turn, for the better way */
#define SHARE_WAY 0.45     /* of the progress: one of the two searches */
#define DEGREE_MAX 32

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

struct srnf_register_options srnf_register_options_defaults(void)
{
    return (struct srnf_register_options){.rotation = true,
                                          .reparameterization = true,
                                          .degree = 12,
                                          .penalty_jacobian = 0.003,
                                          .penalty_displacement = 0.01};
}

static const char *const stop_names[] = {
    [SRNF_REGISTER_DIRECT] = "direct",
    [SRNF_REGISTER_TOLERANCE] = "tolerance",
    [SRNF_REGISTER_STATIONARY] = "stationary",
    [SRNF_REGISTER_REFUSED] = "stepRefused",
    [SRNF_REGISTER_MAX_ITERATIONS] = "maxIterations",
};

const char *srnf_register_stop_name(enum srnf_register_stop stop)
{
    return (size_t)stop < sizeof stop_names / sizeof stop_names[0] ? stop_names[stop] : "unknown";
}

void srnf_registration_clear(struct srnf_registration *r)
{
    srnf_free(r->coefficients);
    srnf_free(r->q);
    srnf_free(r->points);
    srnf_free(r->jacobian);
    srnf_warp_clear(&r->warp);
    *r = (struct srnf_registration){0};
}

/* What one call works on. */
struct call {
    const struct srnf_sht *sht;
    const struct srnf_register_options *options;
    const struct srnf_context *context;
    struct landmark_search *landmarks; /* from the template to the moving surface, or NULL */
    size_t degree, count, n;           /* count = 3 (L+1)^2, n = grid points */
    double *q1, *q2; /* [3][n] of the template and of the moving surface as given */
    void *workspace;
};

enum srnf_register_stop registration_worse_stop(enum srnf_register_stop a,
                                                enum srnf_register_stop b)
{
    return a > b ? a : b;
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
    if (!c->q1 || !c->workspace) {
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
}

static double field_distance(const struct call *c, const double *a, const double *b)
{
    const struct srnf_grid *grid = srnf_sht_grid(c->sht);
    double sum = 0.0;

    for (size_t row = 0; row < grid->n_theta; row++) {
        for (size_t k = 0; k < 3 * grid->n_phi; k++) {
            size_t at = k / grid->n_phi * c->n + row * grid->n_phi + k % grid->n_phi;
            double d = a[at] - b[at];

            sum += grid->weight[row] * d * d;
        }
    }
    return sqrt(sum);
}

/* ---- Both directions ------------------------------------------------------------------------- */

/* A share of the caller's progress; cancellation is passed on, and registration asks for nothing
   else. */
struct share {
    const struct srnf_context *outer;
    double from, to;
};

static bool share_canceled(void *user)
{
    return srnf_is_canceled(((const struct share *)user)->outer);
}

static void share_progress(void *user, double fraction, const char *message)
{
    const struct share *share = user;

    srnf_report_progress(share->outer, share->from + fraction * (share->to - share->from), message);
}

static struct srnf_context share_context(struct share *share)
{
    return (struct srnf_context){
        .user = share, .canceled = share_canceled, .progress = share_progress};
}

/* Registration with a as the template, from nothing (chain NULL) or from a chain. */
static int one_way(const struct call *c, const double *q_template, const double *surface,
                   const double *moving, const struct srnf_warp *chain,
                   struct search_result *result)
{
    struct search search;
    int status =
        search_create(&search, c->sht, q_template, surface, moving, c->options, NULL, c->context);

    if (status) {
        return status;
    }
    search.landmarks = c->landmarks;
    *result = (struct search_result){0};
    status = chain ? search_continue(&search, chain, result) : search_run(&search, result);
    status = status ? status : search_extremes(&search, result);
    search_clear(&search);
    return status;
}

/* The same order for (a, b) and (b, a). */
static bool in_order(size_t count, const double *a, const double *b)
{
    for (size_t i = 0; i < count; i++) {
        if (a[i] < b[i] || b[i] < a[i]) {
            return a[i] < b[i];
        }
    }
    return true;
}

struct pair {
    const double *q[2], *surface[2];
    struct srnf_warp best; /* as found */
    size_t direction;      /* best has surface[direction] as its template */
    double rotation[9];    /* of its values */
    double objective, distance, gap;
    enum srnf_register_stop stopped; /* of the one that is kept */
    enum srnf_register_stop worst;   /* of both ways */
    struct search_result info;
    struct landmark_search *landmarks[2]; /* with surface[k] as the template; NULL: none */
};

static void keep(struct pair *pair, size_t direction, struct search_result *result)
{
    srnf_warp_clear(&pair->best);
    pair->best = result->warp.chain;
    result->warp.chain = (struct srnf_warp){0};
    memcpy(pair->rotation, result->warp.rotation, sizeof pair->rotation);
    pair->info.min_jacobian = result->min_jacobian;
    pair->info.max_jacobian = result->max_jacobian;
    pair->direction = direction;
    pair->objective = result->warp.objective;
    pair->distance = result->distance;
    pair->stopped = result->warp.stopped;
}

/* Another basin counts from whichever side it was seen; so does a rotation that costs little. */
static void join_ambiguities(const struct search_result *other, struct search_result *info)
{
    bool closer = info->ambiguity_objective == 0.0 ||
                  (other->ambiguity_objective > 0.0 &&
                   other->ambiguity_objective < info->ambiguity_objective);

    if (closer) {
        info->ambiguity_objective = other->ambiguity_objective;
        info->ambiguity_angle = other->ambiguity_angle;
    }
    info->rotational_curvature = fmin(info->rotational_curvature, other->rotational_curvature);
}

/* Whether both ways need only be followed to their basins. Where a way ends in one domain alone, by
   landmarks or directly, nothing short of its end tells how good it is. */
static bool basins_tell(const struct call *c)
{
    return !c->landmarks && !c->options->exact && c->options->reparameterization &&
           c->options->start != SRNF_START_RIGID;
}

/* One of the two ways, by steps in one domain alone: enough to tell which is better. */
static int search_way(const struct call *c, const struct pair *pair, size_t k,
                      struct search *search, struct search_result *result)
{
    int status = search_create(search, c->sht, pair->q[k], pair->surface[k], pair->surface[1 - k],
                               c->options, NULL, c->context);

    search->rounds = 0;
    search->basin = basins_tell(c);
    search->landmarks = pair->landmarks[k];
    return status ? status : search_run(search, result);
}

static int search_pair(const struct call *c, struct pair *pair)
{
    struct search searches[2] = {{.own = NULL}, {.own = NULL}};
    struct search_result results[2] = {{.iterations = 0}, {.iterations = 0}};
    struct share share = {c->context, 0.0, SHARE_WAY};
    struct srnf_context context = share_context(&share);
    struct call way = *c;
    int status = SRNF_OK;
    size_t best;

    way.context = &context;
    for (size_t k = 0; k < 2 && status == SRNF_OK; k++) {
        status = search_way(&way, pair, k, &searches[k], &results[k]);
        share.from += SHARE_WAY;
        share.to += SHARE_WAY;
    }
    if (status == SRNF_OK) {
        double a = results[0].warp.objective;
        double b = results[1].warp.objective;

        best = b < a;
        pair->gap = fmax(a, b) > 0.0 ? fabs(a - b) / fmax(a, b) : 0.0;
        pair->worst = registration_worse_stop(results[0].warp.stopped, results[1].warp.stopped);
        searches[best].basin = false;
        status = search_refine(&searches[best], ROUNDS, &results[best]);
        status = status ? status : search_extremes(&searches[best], &results[best]);
    }
    if (status == SRNF_OK) {
        pair->info = results[best];
        join_ambiguities(&results[1 - best], &pair->info);
        pair->info.warp = (struct warp){0};
        pair->info.iterations = results[0].iterations + results[1].iterations;
        pair->worst = registration_worse_stop(pair->worst, results[best].warp.stopped);
        keep(pair, best, &results[best]);
    }
    for (size_t k = 0; k < 2; k++) {
        search_result_clear(&results[k]);
        search_clear(&searches[k]);
    }
    return status;
}

/* Inverts the best warp and optimizes in the other direction; keeps what is lower. */
static int swap_once(const struct call *c, struct pair *pair)
{
    struct srnf_warp inverse = {0};
    struct search_result result = {.iterations = 0};
    struct share share = {c->context, 2.0 * SHARE_WAY, 1.0};
    struct srnf_context context = share_context(&share);
    struct call back = *c;
    size_t other = 1 - pair->direction;
    int status = warp_invert(&pair->best, &inverse);

    back.context = &context;

    if (status == SRNF_OK) {
        status = one_way(&back, pair->q[other], pair->surface[other], pair->surface[1 - other],
                         &inverse, &result);
    }
    if (status == SRNF_OK) {
        pair->info.iterations += result.iterations;
        if (result.warp.objective < pair->objective ||
            result.warp.stopped == SRNF_REGISTER_MAX_ITERATIONS) {
            pair->worst = registration_worse_stop(pair->worst, result.warp.stopped);
        }
        if (result.warp.objective < pair->objective) {
            keep(pair, other, &result);
        }
    }
    srnf_warp_clear(&inverse);
    search_result_clear(&result);
    /* An inverse that cannot be computed only means that there is nothing to polish. */
    return status == SRNF_ENUMERIC ? SRNF_OK : status;
}

/* The other way round: the inverse warp has the inverse rotation and Jacobians. */
static int turn_round(struct pair *pair)
{
    struct srnf_warp inverse = {0};
    struct search_result *info = &pair->info;
    const double least = info->min_jacobian;
    double transposed[9];
    int status = warp_invert(&pair->best, &inverse);

    if (status) {
        srnf_warp_clear(&inverse); /* what there is of it */
        return status;
    }
    srnf_warp_clear(&pair->best);
    pair->best = inverse;
    pair->direction = 1 - pair->direction;
    for (size_t i = 0; i < 9; i++) {
        transposed[i] = pair->rotation[3 * (i % 3) + i / 3];
    }
    memcpy(pair->rotation, transposed, sizeof transposed);
    info->min_jacobian = 1.0 / info->max_jacobian;
    info->max_jacobian = 1.0 / least;
    return SRNF_OK;
}

/* A surface and itself: no search finds the identity better than this. */
static int measure_same(const struct call *c, const double *template_surface, const double *moving,
                        struct search_result *result)
{
    struct srnf_warp chain = {0};
    struct search search;
    int status = search_create(&search, c->sht, c->q1, template_surface, moving, c->options, NULL,
                               c->context);

    if (status) {
        return status;
    }
    status = warp_append(&chain, SRNF_WARP_ROTATION, 0, identity);
    status = status ? status : search_evaluate(&search, &chain, result);
    status = status ? status : search_extremes(&search, result);
    result->warp.stopped = SRNF_REGISTER_TOLERANCE;
    srnf_warp_clear(&chain);
    search_clear(&search);
    return status;
}

static int symmetric_search(const struct call *c, const double *template_surface,
                            const double *moving, struct search_result *result, double *gap)
{
    bool order = in_order(c->count, template_surface, moving);
    struct pair pair = {
        .q = {order ? c->q1 : c->q2, order ? c->q2 : c->q1},
        .surface = {order ? template_surface : moving, order ? moving : template_surface}};
    size_t wanted = order ? 0 : 1; /* the template's place in the pair */
    struct landmark_search back = {.worst = 0};
    int status;

    if (c->landmarks) {
        back.pairs = c->landmarks->pairs;
        back.pairs.fixed = c->landmarks->pairs.moving;
        back.pairs.moving = c->landmarks->pairs.fixed;
        pair.landmarks[wanted] = c->landmarks;
        pair.landmarks[1 - wanted] = &back;
    }
    if (!c->landmarks && order && in_order(c->count, moving, template_surface)) {
        return measure_same(c, template_surface, moving, result);
    }
    status = search_pair(c, &pair);
    for (int k = 0; k < SWAPS && status == SRNF_OK && c->options->exact; k++) {
        status = swap_once(c, &pair);
    }
    if (status == SRNF_OK && pair.direction != wanted) {
        status = turn_round(&pair);
    }
    if (status == SRNF_OK) {
        *result = pair.info;
        *gap = pair.gap;
        result->warp.chain = pair.best;
        pair.best = (struct srnf_warp){0};
        memcpy(result->warp.rotation, pair.rotation, sizeof pair.rotation);
        /* Measured once, for both directions. */
        result->warp.objective = pair.objective;
        result->distance = pair.distance;
        result->warp.stopped = pair.stopped == SRNF_REGISTER_TOLERANCE ? pair.stopped : pair.worst;
    }
    if (status == SRNF_EUNMATCHED && back.worst > 0) {
        c->landmarks->worst = back.worst; /* of the way that failed */
    }
    srnf_warp_clear(&pair.best);
    return status;
}

/* ---- Report ---------------------------------------------------------------------------------- */

/* gamma, q and the points of the surface, [3][n], on the template's grid, where the search may have
   worked on a finer one; distance, rotation. */
static int report_field(const struct call *c, const double *moving,
                        const struct search_result *found, double *surface,
                        struct srnf_registration *r)
{
    r->points = srnf_alloc(3 * c->n, sizeof(double));
    r->jacobian = srnf_alloc(c->n, sizeof(double));
    r->q = srnf_alloc(3 * c->n, sizeof(double));
    if (!r->points || !r->jacobian || !r->q) {
        return SRNF_ENOMEM;
    }
    r->distance = found->distance;
    memcpy(r->rotation, found->warp.rotation, sizeof r->rotation);
    return registration_lay(c->sht, c->options->representation, moving, found->warp.rotation,
                            &found->warp.chain, c->context, r->points, r->jacobian, r->q, surface);
}

int srnf_registration_apply(const struct srnf_sht *sht,
                            const struct srnf_registration *registration,
                            const double *coefficients, const struct srnf_context *context,
                            double *out)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t n = grid->n_theta * grid->n_phi;
    double *values = srnf_alloc(6 * n, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(sht, 3));
    int status = SRNF_ENOMEM;

    if (values && workspace) {
        status = sphere_harmonics_at_points(context, srnf_sht_degree(sht), 3, coefficients, n,
                                            registration->points, values, NULL);
    }
    if (status == SRNF_OK) {
        double *turned = values + 3 * n;

        for (size_t k = 0; k < 3; k++) {
            const double *o = registration->rotation + 3 * k;

            for (size_t i = 0; i < n; i++) {
                turned[k * n + i] =
                    o[0] * values[i] + o[1] * values[n + i] + o[2] * values[2 * n + i];
            }
        }
        srnf_sht_analysis(sht, 3, turned, out, workspace);
    }
    srnf_free(workspace);
    srnf_free(values);
    return status;
}

/* Coefficients of O f2 o gamma, from its values at the nodes, and what their truncation costs. */
static int report_surface(const struct call *c, const double *surface, struct srnf_registration *r)
{
    double *q = srnf_alloc(3 * c->n, sizeof(double));
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(c->sht, 3));
    double norm;
    int status = SRNF_ENOMEM;

    r->coefficients = srnf_alloc(c->count, sizeof(double));
    if (q && workspace && r->coefficients) {
        srnf_sht_analysis(c->sht, 3, surface, r->coefficients, workspace);
        field_represent(c->sht, c->options->representation, r->coefficients, q, c->workspace);
        norm = sqrt(srnf_inner_product(srnf_sht_grid(c->sht), r->q, r->q));
        r->truncation_distance = field_distance(c, q, r->q);
        r->truncation_error = norm > 0.0 ? r->truncation_distance / norm : 0.0;
        status = SRNF_OK;
    }
    srnf_free(workspace);
    srnf_free(q);
    return status;
}

static int report(const struct call *c, const double *moving, struct search_result *found,
                  struct srnf_registration *r)
{
    double *surface = srnf_alloc(3 * c->n, sizeof(double));
    int status = surface ? report_field(c, moving, found, surface, r) : SRNF_ENOMEM;

    status = status ? status : report_surface(c, surface, r);
    srnf_free(surface);
    if (status) {
        return status;
    }
    r->warp = found->warp.chain;
    found->warp.chain = (struct srnf_warp){0};
    r->objective = found->warp.objective;
    r->distance_before = field_distance(c, c->q1, c->q2);
    r->rotations_searched = found->rotations_searched;
    r->ambiguity_objective = found->ambiguity_objective;
    r->ambiguity_angle = found->ambiguity_angle;
    r->rotational_curvature = found->rotational_curvature;
    r->iterations = found->iterations;
    r->stopped = found->warp.stopped;
    r->converged = r->stopped != SRNF_REGISTER_MAX_ITERATIONS;
    r->min_jacobian = found->min_jacobian;
    r->max_jacobian = found->max_jacobian;
    return SRNF_OK;
}

/* ---- Driver ---------------------------------------------------------------------------------- */

int registration_check(const struct srnf_register_options *o, struct srnf_error *error)
{
    if (o->degree < 1 || o->degree > DEGREE_MAX) {
        return srnf_fail(error, SRNF_EINVAL, -1, "degree %zu is not in 1 to %d", o->degree,
                         DEGREE_MAX);
    }
    if (!(o->penalty_jacobian >= 0.0) || !(o->penalty_displacement >= 0.0) ||
        !isfinite(o->penalty_jacobian) || !isfinite(o->penalty_displacement)) {
        return srnf_fail(error, SRNF_EINVAL, -1, "a penalty is not a number from 0 up");
    }
    return SRNF_OK;
}

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
               ? symmetric_search(c, template_surface, moving, found, inverse_consistency)
               : one_way(c, c->q1, template_q ? NULL : template_surface, moving,
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
                          const double *moving, const struct srnf_register_options *options,
                          const struct srnf_context *context, double *distance,
                          struct srnf_error *error)
{
    struct call call = {.options = options, .context = context};
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
        status = report(&call, moving, &found, registration);
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
                               c->context);

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
        status = report(&call, moving, &found, registration);
    }
    status = finish(context, call.landmarks, status, error);
    if (status) {
        srnf_registration_clear(registration);
    }
    search_result_clear(&found);
    call_clear(&call);
    return status;
}
