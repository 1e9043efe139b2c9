/*
 * register_pair.c - the searches of one registration, in one direction or in both.
 *
 * Symmetric mode runs the pair in a fixed order, whichever way it was asked for, so that d(a, b) =
 * d(b, a) to the last bit: both directions are searched, as far as their basins where these tell
 * enough, and the one whose objective is lower goes on. (It is symmetric but for the norm that it
 * is relative to; here that is the geometric mean of both.) The answer is the warp or its inverse.
 * Why the search ended is the worst reason of all that reached the highest degree: one that was cut
 * off might have ended lower than the one that is kept. A way that is followed to its basin alone
 * has none, and one that is kept and registered to rounding leaves nothing to be doubted.
 * In exact mode, whose steps are all of one kind, two swaps follow, in which the warp is inverted
 * and optimized in the other direction. (Swaps begin where there is little to gain: that one gained
 * nothing tells nothing.)
 */
#include "register.h"

#include <math.h>
#include <string.h>

#define SWAPS 2
#define ROUNDS ((size_t)2) /* of steps in both domains in turn, at most */
/* Parts of the objective: a first round that gains less is the last one. */
#define ROUND_GAIN 0.12
#define ROUND_GAIN_BOTH 0.06
#define SHARE_WAY 0.45 /* of the progress: one of the two searches */

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

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

int register_one_way(const struct call *c, const double *q_template, const double *surface,
                     const double *moving, const struct srnf_warp *chain,
                     struct search_result *result)
{
    struct search search;
    int status = search_create(&search, c->sht, q_template, surface, moving, c->options, NULL,
                               c->tools, c->context);

    if (status) {
        return status;
    }
    search.landmarks = c->landmarks;
    if (search.rounds > 0) {
        search.rounds = ROUNDS;
        search.round_gain = ROUND_GAIN;
    }
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
    double norm2;          /* geometric mean of both ||q||^2 */
    double objective, distance, gap;
    enum srnf_register_stop stopped; /* of the one that is kept */
    enum srnf_register_stop worst;   /* of all searches of the highest degree */
    struct search_result info;
    struct landmark_search *landmarks[2]; /* with surface[k] as the template; NULL: none */
    const struct subject *subjects[2];    /* of the surfaces, or NULL */
};

/* Relative to what both ways share, whichever surface is the template. */
static double shared_objective(const struct pair *pair, const struct search_result *result)
{
    const struct warp *warp = &result->warp;
    double penalties = warp->objective - warp->energy;

    return isfinite(penalties) ? result->distance * result->distance / pair->norm2 + penalties
                               : INFINITY;
}

static void keep(struct pair *pair, size_t direction, struct search_result *result)
{
    srnf_warp_clear(&pair->best);
    pair->best = result->warp.chain;
    result->warp.chain = (struct srnf_warp){0};
    memcpy(pair->rotation, result->warp.rotation, sizeof pair->rotation);
    pair->info.min_jacobian = result->min_jacobian;
    pair->info.max_jacobian = result->max_jacobian;
    pair->direction = direction;
    pair->objective = shared_objective(pair, result);
    pair->distance = result->distance;
    pair->stopped = result->warp.stopped;
}

/* Another basin counts from whichever side it was seen; so does a rotation that costs little. A way
   that searched no rotations knows neither. */
static void join_ambiguities(const struct search_result *other, struct search_result *info)
{
    bool known = info->rotations_searched;
    bool closer = info->ambiguity_objective == 0.0 ||
                  (other->ambiguity_objective > 0.0 &&
                   other->ambiguity_objective < info->ambiguity_objective);

    if (!other->rotations_searched) {
        return;
    }
    if (!known || closer) {
        info->ambiguity_objective = other->ambiguity_objective;
        info->ambiguity_angle = other->ambiguity_angle;
    }
    if (!known || other->rotational_curvature < info->rotational_curvature) {
        info->rotational_curvature = other->rotational_curvature;
    }
    info->rotations_searched = true;
}

double register_gap(double a, double b)
{
    double larger = fmax(a, b);

    if (isinf(larger) && a != b) {
        return 1.0; /* one way folds */
    }
    return larger > 0.0 ? fabs(a - b) / larger : 0.0;
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
                               c->options, pair->subjects[1 - k], c->tools, c->context);

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
        double a = shared_objective(pair, &results[0]);
        double b = shared_objective(pair, &results[1]);

        best = b < a;
        pair->gap = register_gap(a, b);
        share = (struct share){c->context, 2.0 * SHARE_WAY, 1.0};
        pair->worst = registration_worse_stop(results[0].warp.stopped, results[1].warp.stopped);
        searches[best].basin = false;
        searches[best].rounds = ROUNDS;
        searches[best].round_gain = ROUND_GAIN_BOTH;
        status = search_refine(&searches[best], &results[best]);
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
        status = register_one_way(&back, pair->q[other], pair->surface[other],
                                  pair->surface[1 - other], &inverse, &result);
    }
    if (status == SRNF_OK) {
        bool lower = shared_objective(pair, &result) < pair->objective;

        pair->info.iterations += result.iterations;
        if (lower || result.warp.stopped == SRNF_REGISTER_MAX_ITERATIONS) {
            pair->worst = registration_worse_stop(pair->worst, result.warp.stopped);
        }
        if (lower) {
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
                               c->tools, c->context);

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

int register_both_ways(const struct call *c, const double *template_surface, const double *moving,
                       struct search_result *result, double *gap)
{
    bool order = in_order(c->count, template_surface, moving);
    struct pair pair = {
        .q = {order ? c->q1 : c->q2, order ? c->q2 : c->q1},
        .surface = {order ? template_surface : moving, order ? moving : template_surface},
        .subjects = {c->subjects[order ? 0 : 1], c->subjects[order ? 1 : 0]}};
    const struct srnf_grid *grid = srnf_sht_grid(c->sht);
    size_t wanted = order ? 0 : 1; /* the template's place in the pair */
    struct landmark_search back = {.worst = 0};
    int status;

    pair.norm2 = sqrt(srnf_inner_product(grid, pair.q[0], pair.q[0])) *
                 sqrt(srnf_inner_product(grid, pair.q[1], pair.q[1]));
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
