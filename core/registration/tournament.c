/*
 * tournament.c - the basin of the best registration, by a tournament of rigid starts.
 *
 * On different shapes the best rigid start often lies in the wrong basin of the elastic problem. So
 * the best rotations of the screening are not refined but compete: each round takes a few steps
 * with fields of one degree on one grid and keeps the better ones; grids, surfaces and fields grow
 * while the entrants become fewer. One that will hardly come near enough to the best of its round
 * to be kept is given up before its steps are done. All rounds read from tables, and all entrants
 * share the factors of one Gauss-Newton matrix.
 */
#include "tournament.h"

#include <math.h>
#include <string.h>

#define ENTRANTS ((size_t)36)
#define ORDER ((size_t)4)
#define DECREASE 1e-3
#define RIGID_ROUND 2            /* on whose grid the curvature over rotations is measured */
#define FINE_DEGREE ((size_t)31) /* of the surfaces in the last round, at most */
#define FINE_STEPS ((size_t)12)  /* where it is above that of the table */
#define FINE_BEHIND 0.5          /* in the first round, whose surfaces tell less of finer ones */

#define SAME_CHORD2 0.02 /* of maps in one basin: rms of 8 degrees */
#define ROUNDS TOURNAMENT_ROUNDS

static const struct tournament_round rounds[ROUNDS] = {
    {12, 8, 2, 12, 5, 12, 0.4},
    {14, 10, 4, 16, 6, 6, 0.2},
    {18, 12, 8, 28, 8, 4, 0.12},
    {24, 15, 8, 28, 8, 3, 0.1},
};

/* The step that stands for the winner's; the full grid is reached by its chain. */
static const struct refit_terms refit = {20, 3e-3, &refit_rough};

struct entrant {
    struct cloud cloud;
    struct srnf_warp chain;
};

/* One grid with both surfaces. */
struct arena {
    double *memory;
    struct tabulated_target target;
    struct tabulated_problem problem;
};

struct tournament {
    const struct search *search;
    struct entrant *entrants;
    size_t count;
    size_t first; /* round */
    struct cloud spare;
    struct tabulated_fields fields[ROUNDS];
    struct tabulated_level levels[ROUNDS];
};

/* Surfaces cut to degree 15 may lie best in another basin than whole ones, so that the last round
   takes more of them, on a grid that fits, and more steps. */
struct tournament_round tournament_round(size_t k, size_t degree)
{
    struct tournament_round round = rounds[k];

    if (k + 1 == ROUNDS && degree > round.surface) {
        round.steps = FINE_STEPS;
        round.surface = degree < FINE_DEGREE ? degree : FINE_DEGREE;
        round.rows = round.rows > round.surface ? round.rows : round.surface + 1;
    }
    return round;
}

/* How far behind the best of a round an entrant may be. */
static double behind_of(const struct tournament *t, size_t k)
{
    bool fine = t->search->subject->full.degree > rounds[ROUNDS - 1].surface;

    return k == 0 && fine ? FINE_BEHIND : rounds[k].behind;
}

/* ---- Arenas ---------------------------------------------------------------------------------- */

static void close_arena(struct arena *a)
{
    srnf_free(a->memory);
    tabulated_target_clear(&a->target);
    *a = (struct arena){0};
}

static int open_arena(const struct search *s, size_t k, struct arena *a)
{
    size_t degree = s->subject->rounds[k].degree;
    size_t rows = tournament_round(k, degree).rows;
    struct target target;
    int status;

    *a = (struct arena){0};
    status = search_coarsen(s, rows, degree, &a->memory, &target);
    if (status == SRNF_OK) {
        status = tabulated_target_create(&a->target, &target);
    }
    if (status) {
        close_arena(a);
        return status;
    }
    a->problem = (struct tabulated_problem){&a->target, &s->subject->rounds[k], s->full.penalty,
                                            s->full.free_rotation};
    return SRNF_OK;
}

/* ---- Rounds ---------------------------------------------------------------------------------- */

static int open_fields(struct tournament *t)
{
    const struct search *s = t->search;
    size_t top = s->subject->top;
    int status = SRNF_OK;

    for (size_t k = t->first; k < ROUNDS && status == SRNF_OK; k++) {
        size_t degree = rounds[k].fields < top ? rounds[k].fields : top;

        if (k > t->first && rounds[k].fields == rounds[k - 1].fields) {
            continue; /* as before: see round_of */
        }
        status = tools_fields(s->tools, degree, ORDER, rounds[k].table, &t->fields[k]);
        if (status == SRNF_OK) {
            status = tabulated_level_create(&t->levels[k], degree, top, s->subject->matrix,
                                            s->full.target.norm2, s->full.penalty.displacement,
                                            s->full.free_rotation);
        }
    }
    return status;
}

/* Where fields and level of a round are. */
static size_t round_of(size_t k)
{
    while (k > 0 && rounds[k].fields == rounds[k - 1].fields) {
        k--;
    }
    return k;
}

static struct tabulated_fields *fields_of(struct tournament *t, size_t degree)
{
    for (size_t k = 0; k < ROUNDS; k++) {
        if (t->fields[k].degree == degree) {
            return &t->fields[k];
        }
    }
    return NULL;
}

/* Puts an entrant on the nodes of an arena: a rotation, then the steps it has taken. */
static int enter_arena(struct tournament *t, const struct arena *a, struct entrant *e)
{
    int status = SRNF_OK;

    cloud_clear(&e->cloud);
    status = cloud_create(&e->cloud, a->target.n);
    if (status) {
        return status;
    }
    cloud_rotate(&e->cloud, &a->target, e->chain.links[0].values);
    for (size_t k = 1; k < e->chain.n_links; k++) {
        struct tabulated_fields *fields = fields_of(t, e->chain.links[k].degree);

        tabulated_fields_fill(fields, e->chain.links[k].values);
        (void)cloud_move(&fields->table, &e->cloud, &e->cloud);
    }
    cloud_evaluate(a->problem.moving, &e->cloud);
    cloud_measure(&a->problem, &e->cloud);
    return SRNF_OK;
}

static void clear_entrant(struct entrant *e)
{
    cloud_clear(&e->cloud);
    srnf_warp_clear(&e->chain);
}

static void sort_entrants(struct tournament *t)
{
    for (size_t i = 1; i < t->count; i++) {
        struct entrant e = t->entrants[i];
        size_t j = i;

        while (j > 0 && t->entrants[j - 1].cloud.objective > e.cloud.objective) {
            t->entrants[j] = t->entrants[j - 1];
            j--;
        }
        t->entrants[j] = e;
    }
}

/* Mean square of the chords between two maps. */
static double map_chord2(const struct tabulated_target *t, const struct cloud *a,
                         const struct cloud *b)
{
    double sum = 0.0;

    for (size_t i = 0; i < t->n; i++) {
        double square = 0.0;

        for (size_t k = 0; k < 3; k++) {
            double d = a->point[k][i] - b->point[k][i];

            square += d * d;
        }
        sum += t->weight[i] * square;
    }
    return sum / (4.0 * SRNF_PI);
}

/* Whether another one is in the basin of a better one. */
static bool is_repeated(const struct tournament *t, const struct tabulated_target *target,
                        const struct cloud *cloud, size_t kept)
{
    bool repeated = false;

    for (size_t i = 0; i < kept && !repeated; i++) {
        repeated = map_chord2(target, &t->entrants[i].cloud, cloud) < SAME_CHORD2;
    }
    return repeated;
}

/* The best ones, at most so many, that are not far behind the best and not where a better one is
   already. */
static void keep_best(struct tournament *t, const struct tabulated_target *target, size_t count,
                      double behind)
{
    double most;
    size_t kept = 0;

    sort_entrants(t);
    most = (1.0 + behind) * t->entrants[0].cloud.objective;
    for (size_t i = 0; i < t->count; i++) {
        struct entrant e = t->entrants[i];

        t->entrants[i] = (struct entrant){.cloud = {0}};
        if (kept < count && e.cloud.objective <= most && !is_repeated(t, target, &e.cloud, kept)) {
            t->entrants[kept++] = e;
        } else {
            clear_entrant(&e);
        }
    }
    t->count = kept;
}

static int play(struct tournament *t, size_t k, const struct arena *a, size_t *iterations)
{
    const struct tournament_round round = tournament_round(k, a->problem.moving->degree);
    struct schedule schedule = {round.steps, DECREASE};
    struct tabulated_optimizer o = {&a->problem,
                                    &t->fields[round_of(k)],
                                    &t->levels[round_of(k)],
                                    &t->spare,
                                    t->search->context,
                                    NULL,
                                    NULL,
                                    0.0};
    double best = INFINITY;
    int status;

    cloud_clear(&t->spare);
    status = cloud_create(&t->spare, a->target.n);
    for (size_t i = 0; i < t->count && status == SRNF_OK; i++) {
        struct entrant *e = &t->entrants[i];
        enum srnf_register_stop ignored;

        status = enter_arena(t, a, e);
        if (status == SRNF_OK) {
            status = tabulated_optimize(&o, &schedule, &e->cloud, &e->chain, &ignored, iterations);
            best = fmin(best, e->cloud.objective);
            o.limit = (1.0 + behind_of(t, k)) * best; /* keep_best drops what is above */
        }
    }
    return status;
}

/* ---- What is reported ------------------------------------------------------------------------ */

/* Mean angle between two maps, rms over the sphere. */
static double map_angle(const struct tabulated_target *t, const struct cloud *a,
                        const struct cloud *b)
{
    double sum = 0.0;

    for (size_t i = 0; i < t->n; i++) {
        double c = 0.0;

        for (size_t k = 0; k < 3; k++) {
            c += a->point[k][i] * b->point[k][i];
        }
        c = acos(fmax(-1.0, fmin(1.0, c)));
        sum += t->weight[i] * c * c;
    }
    return sqrt(sum / (4.0 * SRNF_PI));
}

/* The best of another basin beside the winner, among sorted entrants. */
static void find_ambiguity(const struct tournament *t, const struct tabulated_target *target,
                           struct search_result *result)
{
    const struct cloud *best = &t->entrants[0].cloud;

    for (size_t i = 1; i < t->count; i++) {
        const struct cloud *other = &t->entrants[i].cloud;
        double angle = map_angle(target, best, other);

        if (angle > AMBIGUITY_ANGLE && best->objective > 0.0) {
            result->ambiguity_objective = other->objective / best->objective;
            result->ambiguity_angle = angle;
            return;
        }
    }
}

/* Of the best start of the screening, refined. */
static int rotational_curvature(const struct search *s, const struct arena *a,
                                const struct start_rotation *start, struct search_result *result)
{
    struct start_rotation refined = *start;
    struct moving moving = {.representation = s->options->representation,
                            .table = a->problem.moving};
    size_t n = 2 * rounds[RIGID_ROUND].rows * rounds[RIGID_ROUND].rows;
    const double *memory = a->memory;
    struct problem problem = {.target = {.n = n,
                                         .points = memory,
                                         .weight = memory + 3 * n,
                                         .q = memory + 4 * n,
                                         .norm2 = a->target.norm2},
                              .moving = &moving,
                              .free_rotation = s->full.free_rotation};

    int status;

    moving.plan.points.context = s->context;
    status = registration_rigid(&problem, &refined, &result->rotational_curvature);
    result->rigid_energy = refined.energy;
    return status;
}

/* ---- Driver ---------------------------------------------------------------------------------- */

static int open_entrants(struct tournament *t, const struct start_rotation *starts, size_t count)
{
    int status = SRNF_OK;

    t->entrants = srnf_alloc(count, sizeof *t->entrants);
    if (!t->entrants) {
        return SRNF_ENOMEM;
    }
    t->count = count;
    for (size_t i = 0; i < count && status == SRNF_OK; i++) {
        status = warp_append(&t->entrants[i].chain, SRNF_WARP_ROTATION, 0, starts[i].rotation);
    }
    return status;
}

static void close_tournament(struct tournament *t)
{
    for (size_t i = 0; i < t->count; i++) {
        clear_entrant(&t->entrants[i]);
    }
    srnf_free(t->entrants);
    cloud_clear(&t->spare);
    for (size_t k = 0; k < ROUNDS; k++) {
        tools_return_fields(t->search->tools, &t->fields[k]);
        tabulated_level_clear(&t->levels[k]);
    }
}

/* The winner's many short steps as one. */
static int refit_winner(struct tournament *t, size_t k, const struct arena *a)
{
    size_t rows = tournament_round(k, a->problem.moving->degree).rows;
    const struct nodes_of nodes = {SRNF_GRID_GAUSS_LEGENDRE, rows, 2 * rows};
    struct entrant *winner = &t->entrants[0];

    if (!search_refits(t->search)) {
        return SRNF_OK;
    }
    return warp_refit(&a->problem, &nodes, &refit, t->search->tools, &winner->cloud, &t->spare,
                      &winner->chain);
}

/* best: of the screening, NULL where there was none. */
static int run_rounds(struct tournament *t, const struct start_rotation *best,
                      struct search_result *result)
{
    int status = SRNF_OK;

    for (size_t k = t->first; k < ROUNDS && status == SRNF_OK; k++) {
        struct arena arena;

        status = open_arena(t->search, k, &arena);
        if (status) {
            break;
        }
        if (k == RIGID_ROUND && best) {
            status = rotational_curvature(t->search, &arena, best, result);
            result->rotations_searched = true;
        }
        status = status ? status : play(t, k, &arena, &result->iterations);
        if (status == SRNF_OK) {
            keep_best(t, &arena.target, rounds[k].keep, behind_of(t, k));
            status = isfinite(t->entrants[0].cloud.objective) ? SRNF_OK : SRNF_ENUMERIC;
            srnf_report_progress(t->search->context, 0.1 * (double)(k + 2), "tournament");
        }
        if (status == SRNF_OK && k + 1 == ROUNDS) {
            find_ambiguity(t, &arena.target, result);
            status = refit_winner(t, k, &arena);
        }
        close_arena(&arena);
    }
    return status;
}

static int run(struct tournament *t, const struct start_rotation *starts, size_t count,
               const struct start_rotation *best, struct search_result *result)
{
    int status = open_entrants(t, starts, count);

    if (status == SRNF_OK) {
        status = open_fields(t);
    }
    if (status == SRNF_OK) {
        status = run_rounds(t, best, result);
    }
    if (status == SRNF_OK) {
        result->warp.chain = t->entrants[0].chain;
        t->entrants[0].chain = (struct srnf_warp){0};
    }
    close_tournament(t);
    return status;
}

int tournament_run(const struct search *s, struct search_result *result)
{
    struct tournament t = {.search = s};
    struct start_rotation starts[ENTRANTS];
    int status;
    size_t count = search_screen(s, ENTRANTS, starts, &status);

    return status ? status : run(&t, starts, count, &starts[0], result);
}

int tournament_still(const struct search *s, struct search_result *result)
{
    struct tournament t = {.search = s, .first = TOURNAMENT_STILL};
    const struct start_rotation identity = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}};

    return run(&t, &identity, 1, NULL, result);
}
