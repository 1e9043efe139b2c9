/*
 * likeness.c - members that repeat, stand out, are mirrored or turned: which of them are tried
 * (core/stats/likeness.c judges).
 *
 * What is beyond its robust limit among the distances from the mean of the others stands out.
 * Whether it is mirrored or turned is asked of rigid registration at degree 8, which
 * mirror.c has found to be enough.
 */
#include "compute/likeness.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "store/digest.h"

#define MATCH_DEGREE ((size_t)8)
#define GAINS 0.5 /* of the distance: what turns leave of it where they are told of */
#define SPHERE_TURNED (30.0 * 3.14159265358979323846 / 180.0)
#define ALIKE 2.0  /* times what a turn in space leaves: what one of the sphere alone may leave */
#define SLIGHT 0.1 /* of the norm of an SRNF: distances of which turns gain nothing that counts */
#define SPECTRUM ((size_t)4)
#define COPIED 0.5  /* of what the medoid's mirror image is away: that of a member told instead */
#define NOTICED 1.1 /* times the median distance from which a member is tried */

struct likeness_run {
    struct jobs_run *run;
    const struct compute_likeness_inputs *inputs;
    const struct srnf_sht *sht; /* of MATCH_DEGREE, or of the group where that is lower */
    struct srnf_context context;
    size_t degree, count;
    double *ends; /* two surfaces at that degree, and one number that says how they are matched */
};

void compute_likeness_clear(struct compute_likeness *likeness)
{
    srnf_free(likeness->distances);
    *likeness = (struct compute_likeness){0};
}

/* ---- Matches --------------------------------------------------------------------------------- */

/* Of what stands in ends. rotation: of the surface in space, and not of its sphere alone. */
static int match_rigidly(const struct likeness_run *l, bool rotation,
                         struct srnf_registration *registration, struct srnf_error *error)
{
    struct srnf_register_options options = srnf_register_options_defaults();

    options.rotation = rotation;
    options.reparameterization = false;
    options.start = SRNF_START_RIGID;
    return srnf_register(l->sht, l->ends, NULL, l->ends + l->count, &options, NULL, &l->context,
                         registration, error);
}

/* angle and unturned may be NULL. */
static int match_ends(const struct likeness_run *l, double *distance, double *unturned,
                      double *angle, struct srnf_error *error)
{
    struct srnf_registration registration;
    int status = match_rigidly(l, true, &registration, error);

    if (status < 0) {
        return status;
    }
    *distance = registration.distance;
    if (unturned) {
        *unturned = registration.distance_before;
        *angle = srnf_rotation_angle(registration.rotation);
    }
    srnf_registration_clear(&registration);
    return 0;
}

bool compute_match_on_sphere(const struct compute_match *match)
{
    return match->sphere_angle > SPHERE_TURNED &&
           match->on_sphere < GAINS * match->match.unturned &&
           (!srnf_match_is_turned(&match->match) || match->on_sphere < ALIKE * match->match.plain);
}

/* The same with the sphere alone turned, and by how much. */
static int match_sphere(const struct likeness_run *l, double *distance, double *angle,
                        struct srnf_error *error)
{
    struct srnf_registration registration;
    int status = match_rigidly(l, false, &registration, error);

    if (status < 0) {
        return status;
    }
    *distance = registration.distance;
    *angle = 0.0;
    for (size_t i = 0; i < registration.warp.n_links; i++) {
        if (registration.warp.links[i].kind == SRNF_WARP_ROTATION) {
            *angle = srnf_rotation_angle(registration.warp.links[i].values);
        }
    }
    srnf_registration_clear(&registration);
    return 0;
}

/* What a match comes to, in the order in which jobs keep it. */
enum { PLAIN, MIRRORED, UNTURNED, ANGLE, ON_SPHERE, SPHERE_ANGLE };

/* The match of the ends. */
static int compute_figures(const struct likeness_run *l, bool rotates, bool mirrors,
                           double figures[JOBS_FIGURES], struct srnf_error *error)
{
    int status = match_ends(l, &figures[PLAIN], &figures[UNTURNED], &figures[ANGLE], error);

    figures[ON_SPHERE] = figures[UNTURNED];
    figures[SPHERE_ANGLE] = INFINITY;
    if (status == 0 && !rotates && figures[PLAIN] < GAINS * figures[UNTURNED]) {
        status = match_sphere(l, &figures[ON_SPHERE], &figures[SPHERE_ANGLE], error);
    }
    figures[MIRRORED] = figures[PLAIN];
    if (status == 0 && mirrors) {
        srnf_surface_mirror(l->degree, l->ends + l->count);
        status = match_ends(l, &figures[MIRRORED], NULL, NULL, error);
    }
    return status;
}

/* Adds the match of the ends, as the share-th part of it, to the figures: as an earlier job has
   found it, if one has. */
static int add_match(const struct likeness_run *l, bool rotates, bool mirrors, double share,
                     struct compute_match *match, struct srnf_error *error)
{
    double figures[JOBS_FIGURES] = {0.0};
    struct jobs *jobs = jobs_run_jobs(l->run);
    char digest[65];
    int status = 0;

    l->ends[2 * l->count] = (rotates ? 1.0 : 0.0) + (mirrors ? 2.0 : 0.0);
    store_sha256_hex(digest, l->ends, (2 * l->count + 1) * sizeof *l->ends);
    if (!jobs_figures_find(jobs, digest, figures)) {
        status = compute_figures(l, rotates, mirrors, figures, error);
        if (status < 0) {
            return status;
        }
        jobs_figures_keep(jobs, digest, figures);
    }
    match->match.plain += share * figures[PLAIN];
    match->match.mirrored += share * figures[MIRRORED];
    match->match.unturned += share * figures[UNTURNED];
    match->match.angle = fmin(match->match.angle, figures[ANGLE]);
    match->on_sphere += share * figures[ON_SPHERE];
    match->sphere_angle = fmin(match->sphere_angle, figures[SPHERE_ANGLE]);
    return status;
}

/* The same of members i and j. Where nothing rotates, turns gain no more than they would of the
   distance that the process itself found between the two: its warps may have turned the sphere. */
static int match(const struct likeness_run *l, size_t i, size_t j, bool mirrors, double share,
                 struct compute_match *match, struct srnf_error *error)
{
    const struct compute_group *group = l->inputs->group;
    const struct compute_match before = *match;
    int status;

    srnf_surface_change_degree(group->degree, group->surfaces[i], l->degree, l->ends);
    srnf_surface_change_degree(group->degree, group->surfaces[j], l->degree, l->ends + l->count);
    status = add_match(l, l->inputs->rotates, mirrors, share, match, error);
    if (!l->inputs->rotates) {
        double apart = share * l->inputs->pairs[i * group->n + j];

        match->match.unturned = fmin(match->match.unturned, before.match.unturned + apart);
        match->on_sphere = fmin(match->on_sphere, before.on_sphere + apart);
    }
    return status;
}

static struct compute_match no_match(size_t first, size_t second)
{
    return (struct compute_match){
        .first = first, .second = second, .match.angle = INFINITY, .sphere_angle = INFINITY};
}

/* Where the ends are nearly the same as they lie, so that they differ no more than encodings of one
   shape, or turns leave more than that share of their distance: as if turns gained nothing. */
static int overlook_slight(const struct likeness_run *l, double share, struct compute_match *match)
{
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(l->sht));
    struct srnf_surface_measures measures;
    double unturned = match->match.unturned;

    if (!workspace) {
        return SRNF_ENOMEM;
    }
    srnf_surface_measure(l->sht, l->ends, &measures, workspace);
    srnf_free(workspace);
    if (unturned < SLIGHT * sqrt(measures.area) ||
        !(fmin(match->match.plain, match->on_sphere) < share * unturned)) {
        match->match.plain = match->match.mirrored = match->on_sphere = unturned;
        match->sphere_angle = INFINITY;
    }
    return 0;
}

/* ---- Members --------------------------------------------------------------------------------- */

static double median_distance(const struct compute_likeness *likeness)
{
    for (size_t i = 0; i < likeness->n; i++) {
        if (fabs(likeness->distances[i].percentile - 50.0) < 50.0 / (double)likeness->n + 1e-9) {
            return likeness->distances[i].value;
        }
    }
    return 0.0;
}

/* The furthest member that was not tried; n where there is none worth it. */
static size_t next_member(const struct compute_likeness_inputs *inputs,
                          const struct compute_likeness *likeness, double from, const bool *taken)
{
    size_t best = likeness->n;

    for (size_t i = 0; i < likeness->n; i++) {
        const struct srnf_typicality *t = &likeness->distances[i];

        if (!taken[i] && (t->far || t->value > from || !inputs->rotates) &&
            (best == likeness->n || t->value > likeness->distances[best].value)) {
            best = i;
        }
    }
    return best;
}

/* Norms of the coefficients of degrees 1 to SPECTRUM: the same of a surface that is turned or
   mirrored, or whose sphere is. */
static void find_spectrum(const struct likeness_run *l, size_t member, double spectrum[SPECTRUM])
{
    const struct compute_group *group = l->inputs->group;
    size_t count = srnf_coefficient_count(group->degree);

    for (size_t degree = 1; degree <= SPECTRUM; degree++) {
        double sum = 0.0;

        for (size_t k = degree * degree; k < (degree + 1) * (degree + 1); k++) {
            for (size_t axis = 0; axis < 3 && degree <= group->degree; axis++) {
                double value = group->surfaces[member][axis * count + k];

                sum += value * value;
            }
        }
        spectrum[degree - 1] = sqrt(sum);
    }
}

/* The member that has the most alike spectrum but for the two of the match. */
static size_t most_alike(const struct likeness_run *l, const struct compute_match *m)
{
    size_t best = l->inputs->group->n;
    double own[SPECTRUM], least = INFINITY;

    find_spectrum(l, m->second, own);
    for (size_t i = 0; i < l->inputs->group->n; i++) {
        double other[SPECTRUM], sum = 0.0;

        find_spectrum(l, i, other);
        for (size_t k = 0; k < SPECTRUM; k++) {
            sum += (other[k] - own[k]) * (other[k] - own[k]);
        }
        if (i != m->first && i != m->second && sum < least) {
            best = i;
            least = sum;
        }
    }
    return best;
}

/* Whose mirror image a mirrored member is, where one of the group is far nearer than the medoid:
   most often a copy. */
static int match_copies(const struct likeness_run *l, struct compute_likeness *likeness,
                        struct srnf_error *error)
{
    int status = 0;

    for (size_t k = 0; k < likeness->n_members && status == 0; k++) {
        struct compute_match *m = &likeness->members[k];
        size_t i = srnf_match_is_mirrored(&m->match) ? most_alike(l, m) : likeness->n;

        if (i < likeness->n) {
            struct compute_match other = no_match(i, m->second);

            status = match(l, i, m->second, true, 1.0, &other, error);
            if (status == 0 && other.match.mirrored < COPIED * m->match.mirrored) {
                *m = other;
            }
        }
    }
    return status;
}

static int match_members(const struct likeness_run *l, struct compute_likeness *likeness,
                         struct srnf_error *error)
{
    bool taken[COMPUTE_GROUP_MAX] = {false};
    double from = NOTICED * median_distance(likeness);
    int status = 0;

    taken[likeness->medoid] = true;
    while (likeness->n_members < LIKENESS_TRIED_MAX && status == 0) {
        size_t i = next_member(l->inputs, likeness, from, taken);
        struct compute_match *m = &likeness->members[likeness->n_members];

        if (i == likeness->n) {
            break;
        }
        taken[i] = true;
        *m = no_match(likeness->medoid, i);
        status = match(l, likeness->medoid, i, l->inputs->mirrors, 1.0, m, error);
        likeness->n_members++;
    }
    return status == 0 && l->inputs->mirrors ? match_copies(l, likeness, error) : status;
}

/* Too few to say which of them stands out: each is matched with the medoid. */
static int match_few(const struct likeness_run *l, struct compute_likeness *likeness,
                     struct srnf_error *error)
{
    int status = 0;

    for (size_t i = 0; i < likeness->n && status == 0; i++) {
        if (i != likeness->medoid) {
            struct compute_match *m = &likeness->members[likeness->n_members++];

            *m = no_match(likeness->medoid, i);
            status = match(l, likeness->medoid, i, false, 1.0, m, error);
            status = status ? status : overlook_slight(l, LIKENESS_FEW_LEFT, m);
        }
    }
    return status;
}

/* ---- Classes --------------------------------------------------------------------------------- */

/* The members that stand for each class, n where there are fewer. chosen: [n_classes]. */
static void choose_members(const struct compute_likeness_inputs *inputs,
                           size_t chosen[][LIKENESS_OF_CLASS])
{
    bool taken[COMPUTE_GROUP_MAX] = {false};

    for (size_t c = 0; c < inputs->n_classes; c++) {
        for (size_t k = 0; k < LIKENESS_OF_CLASS; k++) {
            chosen[c][k] = srnf_medoid(inputs->group->n, inputs->pairs, inputs->classes, c, taken);
            if (chosen[c][k] < inputs->group->n) {
                taken[chosen[c][k]] = true;
            }
        }
    }
}

static int match_classes(const struct likeness_run *l, struct compute_likeness *likeness,
                         struct srnf_error *error)
{
    size_t chosen[LIKENESS_CLASSES_MAX][LIKENESS_OF_CLASS], n = l->inputs->group->n;
    int status = 0;

    choose_members(l->inputs, chosen);
    for (size_t a = 0; a < l->inputs->n_classes; a++) {
        for (size_t b = a + 1; b < l->inputs->n_classes && status == 0; b++) {
            struct compute_match *m = &likeness->classes[likeness->n_classes++];
            size_t count = 0;

            while (count < LIKENESS_OF_CLASS && chosen[a][count] < n && chosen[b][count] < n) {
                count++;
            }
            *m = no_match(a, b);
            for (size_t k = 0; k < count && status == 0; k++) {
                status = match(l, chosen[a][k], chosen[b][k], l->inputs->mirrors,
                               1.0 / (double)count, m, error);
            }
        }
    }
    return status;
}

/* Room for two surfaces at the degree of matches, and how they are matched; close_run in any
   case. */
static int open_run(struct jobs_run *run, size_t degree, struct likeness_run *l)
{
    int status;

    *l = (struct likeness_run){.run = run,
                               .context = *jobs_run_context(run),
                               .degree = degree < MATCH_DEGREE ? degree : MATCH_DEGREE};
    l->context.progress = NULL;
    l->count = 3 * srnf_coefficient_count(l->degree);
    status = jobs_transform_acquire(jobs_run_jobs(run), l->degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0,
                                    &l->sht);
    if (status) {
        return status;
    }
    l->ends = srnf_alloc(2 * l->count + 1, sizeof(double));
    return l->ends ? 0 : SRNF_ENOMEM;
}

static void close_run(struct likeness_run *l)
{
    srnf_free(l->ends);
    if (l->sht) {
        jobs_transform_release(jobs_run_jobs(l->run), l->sht);
    }
}

static int match_all(struct jobs_run *run, const struct compute_likeness_inputs *inputs,
                     struct compute_likeness *likeness, struct srnf_error *error)
{
    struct likeness_run l;
    int status = open_run(run, inputs->group->degree, &l);

    l.inputs = inputs;
    if (status == 0 && likeness->n < LIKENESS_MEMBERS_MIN) {
        status = match_few(&l, likeness, error);
    } else if (status == 0 && likeness->distances) {
        status = match_members(&l, likeness, error);
    }
    if (status == 0 && likeness->distances && inputs->classes &&
        inputs->n_classes <= LIKENESS_CLASSES_MAX) {
        status = match_classes(&l, likeness, error);
    }
    close_run(&l);
    return status;
}

int compute_match_pair(struct jobs_run *run, size_t degree, const double *first,
                       const double *second, double share, struct compute_match *match,
                       struct jobs_result *result)
{
    struct srnf_error error = {0};
    struct likeness_run l;
    int status = open_run(run, degree, &l);

    *match = no_match(0, 1);
    if (status == 0) {
        srnf_surface_change_degree(degree, first, l.degree, l.ends);
        srnf_surface_change_degree(degree, second, l.degree, l.ends + l.count);
        status = add_match(&l, false, false, 1.0, match, &error);
        status = status ? status : overlook_slight(&l, share, match);
    }
    close_run(&l);
    return status < 0 ? compute_fail(result, status, &error, "comparing poses") : 0;
}

int compute_likeness(struct jobs_run *run, const struct compute_likeness_inputs *inputs,
                     struct compute_likeness *likeness, struct jobs_result *result)
{
    struct srnf_error error = {0};
    size_t n = inputs->group->n;
    int status;

    *likeness = (struct compute_likeness){.n = n};
    status = srnf_twins_find(n, inputs->pairs, inputs->subjects, inputs->classes, &likeness->twins);
    likeness->medoid = srnf_medoid(n, inputs->pairs, NULL, 0, NULL);
    if (status == 0 && n >= LIKENESS_MEMBERS_MIN && likeness->medoid < n) {
        likeness->distances = srnf_alloc(n, sizeof *likeness->distances);
        status = likeness->distances ? srnf_members_judge(n, inputs->pairs, likeness->distances)
                                     : SRNF_ENOMEM;
        status = status ? status : match_all(run, inputs, likeness, &error);
    } else if (status == 0 && !inputs->rotates && likeness->medoid < n) {
        status = match_all(run, inputs, likeness, &error);
    }
    if (status) {
        compute_likeness_clear(likeness);
        return compute_fail(result, status, &error, "comparing the members with each other");
    }
    return 0;
}
