/*
 * bench_objectives.c - how good registration is, and at what cost: the objective that it reaches on
 * real pairs, against the best known of each.
 *
 *   build/tests/bench/bench_objectives [DEGREE ..]
 *   build/tests/bench/bench_objectives --longer POSES [DEGREE ..] | sed -n 's/^known //p'
 *
 * 24 pairs each of brain structures, ventricles and asteroids, and 20 more of each that nothing was
 * tuned by, at degrees 15, 23 and 31, encoded by area. The best known objectives are in
 * tests/bench/objectives.txt; what is found lower than there is printed as a line for that file.
 * The second form makes that file anew: the lowest of longer searches, from the parameterization of
 * the moving surface turned at random so many times, forward, both ways, and on from their ends.
 * Cost is processor time in units of one gradient transform of three coordinates at the same
 * degree, with its field, timed in the same run; report included. Every third pair is registered
 * both ways too: how many times as long that takes, and how far its distance is from the one of
 * the single way.
 */
#include "registration/registration.h"

#include "support/compare.h"
#include "support/folders.h"
#include "support/meshes.h"
#include "support/random.h"
#include "support/shapes.h"
#include "support/timing.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define KNOWN "tests/bench/objectives.txt"
#define KNOWN_MAX ((size_t)1000)
#define SETS ((size_t)3)
#define TUNED ((size_t)24)
#define OTHERS ((size_t)20)
#define PAIRS (TUNED + OTHERS)
#define SURFACES_MAX ((size_t)40)
#define MORE 1.01 /* times the best known */
#define UNIT_SECONDS 0.01
#define BOTH_EVERY ((size_t)3)
#define GAIN 1e-3 /* of a longer search, that goes on for more */

extern void openblas_set_num_threads(int threads);

static const struct {
    const char *name, *folder;
} sets[SETS] = {
    {"brain", "tests/data/aal_subcortex"},
    {"ventricles", "../shared/data/lv_endocardium_ed"},
    {"bodies", "../shared/data/small_bodies"},
};

struct known {
    size_t degree, set, pair;
    double objective;
};

struct bench {
    struct known known[KNOWN_MAX];
    size_t count;
    double unit;
    size_t poses; /* of longer searches; 0: measure */
};

static void must(int status)
{
    if (status < 0) {
        (void)fprintf(stderr, "%s\n", srnf_strerror(status));
        exit(EXIT_FAILURE);
    }
}

/* ---- Surfaces -------------------------------------------------------------------------------- */

static void load(struct shapes_surface *s, const char *path)
{
    struct srnf_mesh mesh = {0};
    struct srnf_mesh_report report;
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_encoded encoded;

    options.degree = s->degree;
    options.parameterization = SRNF_PARAMETERIZATION_AREA;
    if (!meshes_load(path, &mesh)) {
        (void)fprintf(stderr, "%s is not there\n", path);
        exit(EXIT_FAILURE);
    }
    must(srnf_mesh_prepare(&mesh, false, &report));
    must(srnf_encode(&mesh, &report, &options, NULL, &encoded, NULL));
    memcpy(s->f, encoded.coefficients, s->count * sizeof(double));
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
    shapes_update(s);
}

/* Up to SURFACES_MAX of a set, from all over its folder. */
static size_t open_set(size_t set, size_t degree, struct shapes_surface *surfaces)
{
    char *paths[FOLDERS_FILES_MAX];
    size_t found = folders_list(sets[set].folder, paths);
    size_t n = found < SURFACES_MAX ? found : SURFACES_MAX;

    for (size_t i = 0; i < n; i++) {
        shapes_open(&surfaces[i], degree);
        load(&surfaces[i], paths[i * found / n]);
    }
    for (size_t i = 0; i < found; i++) {
        free(paths[i]);
    }
    return n;
}

/* Different ones, the same in every run. */
static void draw_pairs(size_t set, size_t n, size_t pairs[PAIRS][2])
{
    struct test_random random = test_random_seed(1600 + set);

    for (size_t k = 0; k < PAIRS; k++) {
        bool again = true;

        while (again) {
            pairs[k][0] = test_random_below(&random, n);
            pairs[k][1] = test_random_below(&random, n);
            again = pairs[k][0] == pairs[k][1];
            for (size_t j = 0; j < k; j++) {
                again = again || (pairs[j][0] == pairs[k][0] && pairs[j][1] == pairs[k][1]);
            }
        }
    }
}

/* ---- What is known --------------------------------------------------------------------------- */

static void read_known(struct bench *b)
{
    FILE *file = fopen(KNOWN, "r");
    struct known k;

    while (file && b->count < KNOWN_MAX &&
           fscanf(file, "%zu %zu %zu %lf", &k.degree, &k.set, &k.pair, &k.objective) == 4) {
        b->known[b->count++] = k;
    }
    if (file) {
        (void)fclose(file);
    }
}

static double best_known(const struct bench *b, size_t degree, size_t set, size_t pair)
{
    double best = INFINITY;

    for (size_t i = 0; i < b->count; i++) {
        const struct known *k = &b->known[i];

        if (k->degree == degree && k->set == set && k->pair == pair) {
            best = compare_min(best, k->objective);
        }
    }
    return best;
}

/* ---- One pair ------------------------------------------------------------------------------- */

static void one_transform(void *argument)
{
    struct shapes_surface *s = argument;

    srnf_field(s->sht, s->f, s->q, s->workspace);
}

static double unit_seconds(struct shapes_surface *s)
{
    struct timing_case unit = {.body = one_transform, .argument = s};
    double seconds[5];

    timing_calibrate(&unit, UNIT_SECONDS);
    timing_interleave(&unit, 1, 5, seconds);
    return timing_median(5, seconds);
}

/* Returns processor seconds. */
static double run(const struct shapes_surface *a, const struct shapes_surface *b, bool symmetric,
                  double *objective, double *distance)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r;
    double seconds = timing_cpu();

    options.symmetric = symmetric;
    must(srnf_register(a->sht, a->f, NULL, b->f, &options, NULL, NULL, &r, NULL));
    seconds = timing_cpu() - seconds;
    *objective = r.objective;
    *distance = r.distance;
    srnf_registration_clear(&r);
    return seconds;
}

/* ---- Longer searches ------------------------------------------------------------------------- */

/* f o R, which screenings of rotations see from other places. */
static void turn_domain(const struct shapes_surface *s, const double rotation[9], double *out)
{
    double *points = shapes_doubles(4 * s->points);
    double *values = shapes_doubles(3 * s->points);

    registration_nodes(s->grid, points, points + 3 * s->points);
    for (size_t i = 0; i < s->points; i++) {
        shapes_rotate(rotation, 1, points + 3 * i);
    }
    must(srnf_harmonics_at_points(s->degree, 3, s->f, s->points, points, values, NULL));
    srnf_sht_analysis(s->sht, 3, values, out, s->workspace);
    srnf_free(values);
    srnf_free(points);
}

/* Forward, and on from there while that gains anything. */
static double search_forward(const struct shapes_surface *a, const double *f)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r;
    double before = INFINITY, objective;

    must(srnf_register(a->sht, a->f, NULL, f, &options, NULL, NULL, &r, NULL));
    objective = r.objective;
    while (objective < (1.0 - GAIN) * before) {
        struct srnf_registration next;

        before = objective;
        must(srnf_register(a->sht, a->f, NULL, f, &options, &r, NULL, &next, NULL));
        objective = compare_min(objective, next.objective);
        srnf_registration_clear(&r);
        r = next;
    }
    srnf_registration_clear(&r);
    return objective;
}

/* Both ways, as an objective of the forward one, relative to the template's norm. */
static double search_both_ways(const struct shapes_surface *a, double norm2_a, double norm2_b,
                               const double *f)
{
    struct srnf_register_options options = srnf_register_options_defaults();
    struct srnf_registration r;
    double square, objective;

    options.symmetric = true;
    must(srnf_register(a->sht, a->f, NULL, f, &options, NULL, NULL, &r, NULL));
    square = r.distance * r.distance;
    objective = r.objective - square / sqrt(norm2_a * norm2_b) + square / norm2_a;
    srnf_registration_clear(&r);
    return objective;
}

static double search_longer(size_t poses, uint64_t seed, const struct shapes_surface *a,
                            const struct shapes_surface *b)
{
    struct test_random random = test_random_seed(seed);
    double norm2_a = srnf_inner_product(a->grid, a->q, a->q);
    double norm2_b = srnf_inner_product(b->grid, b->q, b->q);
    double best = INFINITY;
    double *f = shapes_doubles(b->count);

    for (size_t k = 0; k < poses; k++) {
        double rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

        if (k > 0) {
            shapes_random_rotation(&random, rotation);
        }
        turn_domain(b, rotation, f);
        best = compare_min(best, search_forward(a, f));
        best = compare_min(best, search_both_ways(a, norm2_a, norm2_b, f));
    }
    srnf_free(f);
    return best;
}

/* ---- One set --------------------------------------------------------------------------------- */

struct tally {
    size_t pairs, above, lower, both;
    double cost[PAIRS], times[PAIRS], excess, ratio;
};

static void bench_pair(struct bench *b, size_t degree, size_t set, size_t pair,
                       const struct shapes_surface *template_surface,
                       const struct shapes_surface *moving, struct tally *t)
{
    double best = best_known(b, degree, set, pair);
    double objective, distance, seconds;

    seconds = run(template_surface, moving, false, &objective, &distance);
    t->cost[t->pairs++] = seconds / b->unit;
    t->above += objective > MORE * best;
    t->excess += isfinite(best) ? objective / best - 1.0 : 0.0;
    if (objective < best * (1.0 - 1e-6)) {
        t->lower++;
        printf("known %zu %zu %zu %.7f\n", degree, set, pair, objective);
    }
    if (pair % BOTH_EVERY == 0) {
        double other, both;

        t->times[t->both++] = run(template_surface, moving, true, &other, &both) / seconds;
        t->ratio += both / distance - 1.0;
    }
}

static void print(size_t degree, size_t set, const char *which, struct tally *t)
{
    printf(
        "%6zu  %-10s  %-6s  %2zu of %zu above by 1 %%, mean %+.2f %%, %zu lower;  %6.0f U;  both "
        "ways %.2f times, distance %+.2f %%\n",
        degree, sets[set].name, which, t->above, t->pairs, 100.0 * t->excess / (double)t->pairs,
        t->lower, timing_median(t->pairs, t->cost), timing_median(t->both, t->times),
        100.0 * t->ratio / (double)t->both);
    (void)fflush(stdout);
}

static void bench_set(struct bench *b, size_t degree, size_t set)
{
    struct shapes_surface surfaces[SURFACES_MAX];
    size_t n = open_set(set, degree, surfaces);
    size_t pairs[PAIRS][2];
    struct tally tuned = {.pairs = 0}, others = {.pairs = 0};

    if (n == 0) {
        printf("%6zu  %-10s  %s is not there\n", degree, sets[set].name, sets[set].folder);
        return;
    }
    draw_pairs(set, n, pairs);
    b->unit = unit_seconds(&surfaces[0]);
    for (size_t k = 0; k < PAIRS && b->poses > 0; k++) {
        printf("known %zu %zu %zu %.7f\n", degree, set, k,
               search_longer(b->poses, k, &surfaces[pairs[k][0]], &surfaces[pairs[k][1]]));
        (void)fflush(stdout);
    }
    for (size_t k = 0; k < PAIRS && b->poses == 0; k++) {
        bench_pair(b, degree, set, k, &surfaces[pairs[k][0]], &surfaces[pairs[k][1]],
                   k < TUNED ? &tuned : &others);
    }
    if (b->poses == 0) {
        print(degree, set, "tuned", &tuned);
        print(degree, set, "others", &others);
    }
    for (size_t i = 0; i < n; i++) {
        shapes_close(&surfaces[i]);
    }
}

int main(int argc, char **argv)
{
    static struct bench b;
    int first = 1;

    if (argc > 2 && strcmp(argv[1], "--longer") == 0) {
        b.poses = strtoul(argv[2], NULL, 10);
        first = 3;
    }
    openblas_set_num_threads(1);
    read_known(&b);
    printf("Registration, one core, processor time; U: one gradient transform with its field\n");
    for (size_t degree = 15; degree <= 31; degree += 8) {
        bool asked = argc <= first;

        for (int k = first; k < argc; k++) {
            asked = asked || strtoul(argv[k], NULL, 10) == degree;
        }
        for (size_t set = 0; set < SETS && asked; set++) {
            bench_set(&b, degree, set);
        }
    }
    return EXIT_SUCCESS;
}
