/*
 * pair.c - two surfaces, brought to one degree and registered.
 */
#include "toolkit/pair.h"

#include "toolkit/routes.h"
#include "api/warnings.h"
#include "compute/likeness.h"

#define DEGREES (180.0 / 3.14159265358979323846)
#define TURNED_BACK 0.5 /* of the distance: what a turn leaves of it where it is told of */

/* Fills both up to the larger degree. */
static int bring_to_one_degree(struct jobs_run *run, struct pair *pair, struct jobs_result *result)
{
    const struct compute_surface *ends = pair->ends;
    int status;

    pair->degree = ends[0].degree > ends[1].degree ? ends[0].degree : ends[1].degree;
    pair->count = 3 * srnf_coefficient_count(pair->degree);
    pair->coefficients = srnf_alloc(pair->count, 2 * sizeof(double));
    if (!pair->coefficients) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "preparing the surfaces");
    }
    for (size_t i = 0; i < 2; i++) {
        srnf_surface_change_degree(ends[i].degree, ends[i].coefficients, pair->degree,
                                   pair->coefficients + i * pair->count);
    }
    status = jobs_transform_acquire(jobs_run_jobs(run), pair->degree, SRNF_GRID_GAUSS_LEGENDRE, 0,
                                    0, &pair->sht);
    return status ? compute_fail(result, status, NULL, "preparing the harmonic transform") : 0;
}

int pair_load(struct jobs_run *run, const char *first, const char *second,
              enum srnf_parameterization route, double share, struct pair *pair,
              struct jobs_result *result)
{
    int status;

    *pair = (struct pair){.by_route = route != SRNF_PARAMETERIZATION_AUTO};
    status = compute_surface_load_by(run, first, route, share, &pair->ends[0], result);
    if (status == 0) {
        status = compute_surface_load_by(run, second, route, share, &pair->ends[1], result);
    }
    return status ? status : bring_to_one_degree(run, pair, result);
}

/* Landmarks say what corresponds: no mesh and no mirror image is asked. What they cost is told by a
   registration without them. */
static int register_guided(struct jobs_run *run, struct pair *pair,
                           const struct srnf_register_options *options, struct jobs_result *result)
{
    const double *fixed = pair->coefficients, *moving = pair->coefficients + pair->count;
    struct srnf_context quiet = *jobs_run_context(run);
    struct srnf_registration unguided = {0};
    struct srnf_error error = {0};
    int status = srnf_register_landmarks(pair->sht, fixed, NULL, moving, options, pair->landmarks,
                                         NULL, jobs_run_context(run), &pair->registration, &error);

    quiet.progress = NULL;
    if (status >= 0) {
        status =
            srnf_register(pair->sht, fixed, NULL, moving, options, NULL, &quiet, &unguided, &error);
    }
    if (status < 0) {
        return compute_fail(result, status, &error, "registering");
    }
    pair->free_distance = unguided.distance;
    srnf_registration_clear(&unguided);
    return 0;
}

int pair_register(struct jobs_run *run, struct pair *pair,
                  const struct srnf_register_options *options, enum handedness handedness,
                  struct jobs_result *result)
{
    const double *fixed = pair->coefficients, *moving = pair->coefficients + pair->count;
    const char *first = pair->ends[0].id, *second = pair->ends[1].id;
    struct compute_origin origins[2] = {0};
    struct srnf_error error = {0};
    int status;

    if (pair->landmarks) {
        return register_guided(run, pair, options, result);
    }
    if (!pair->by_route) {
        routes_origin(run, first, &origins[0]);
        routes_origin(run, second, &origins[1]);
    }
    status = compute_register_pair(run, pair->sht, fixed, moving, pair->by_route ? NULL : origins,
                                   options, &pair->registration, &pair->bridged, result);
    if (status == 0 && handedness == HANDEDNESS_CHECK) {
        pair->opposite = handedness_opposite(run, first, second);
        status = compute_mirror_pair(run, pair->sht, fixed, moving, options, pair->opposite,
                                     pair->registration.distance, &pair->mirror, &error);
        status =
            status < 0 ? compute_fail(result, status, &error, "registering the mirror image") : 0;
    }
    return status;
}

json_t *pair_warnings(struct jobs_run *run, const struct pair *pair)
{
    return handedness_of_pair(run, pair->ends[0].id, pair->ends[1].id, pair->opposite,
                              &pair->mirror);
}

/* What a turn of one of two surfaces, or of its sphere alone, makes of their distance. */
struct turn {
    bool told; /* it is worth a warning */
    bool sphere;
    double angle, turned; /* degrees; the distance that is left */
};

/* share: of the distance, what a turn leaves of it at most where it is told of.
   distance: that of the process; 0: as the surfaces lie, which it then is. */
static int find_turn(struct jobs_run *run, size_t degree, const double *first, const double *second,
                     double share, double *distance, struct turn *turn, struct jobs_result *result)
{
    struct compute_match match;
    int status = compute_match_pair(run, degree, first, second, share, &match, result);

    *turn = (struct turn){.told = false};
    if (status) {
        return status;
    }
    *distance = *distance > 0.0 ? *distance : match.match.unturned;
    turn->sphere = compute_match_on_sphere(&match);
    turn->turned = turn->sphere ? match.on_sphere : match.match.plain;
    turn->angle = DEGREES * (turn->sphere ? match.sphere_angle : match.match.angle);
    turn->told =
        turn->turned < share * *distance && (turn->sphere || srnf_match_is_turned(&match.match));
    return 0;
}

static json_t *turn_json(const struct turn *turn, double distance)
{
    return json_pack("{s:f, s:f, s:f, s:b}", "angle", turn->angle, "distance", distance, "turned",
                     turn->turned, "sphereAlone", (int)turn->sphere);
}

int pair_warn_pose(struct jobs_run *run, const struct pair *pair, json_t *document,
                   struct jobs_result *result)
{
    double distance = pair->registration.distance;
    struct turn turn;
    int status = find_turn(run, pair->degree, pair->coefficients, pair->coefficients + pair->count,
                           TURNED_BACK, &distance, &turn, result);

    if (status || !turn.told) {
        return status;
    }
    warning_add(
        warnings_of(document), "pose-differs", turn_json(&turn, distance),
        turn.sphere
            ? "In their common pose the surfaces are %.3g apart, and %.3g with the sphere under "
              "one turned by %.0f degrees and no warp: they lie alike, but their maps to the "
              "sphere are turned, as of symmetric shapes. commonPose cannot undo that: take "
              "rotation false, which turns the sphere alone, or the default registration."
            : "As they lie the surfaces are %.3g apart, and %.3g with one turned by %.0f "
              "degrees and no warp: they do not share a pose. Bring them into one, or let "
              "rotations be sought (commonPose false).",
        distance, turn.turned, turn.angle);
    return 0;
}

int pair_warn_unregistered(struct jobs_run *run, size_t degree, const double *first,
                           const double *second, const char *what, json_t *document,
                           struct jobs_result *result)
{
    double distance = 0.0;
    struct turn turn;
    int status = find_turn(run, degree, first, second, LIKENESS_FEW_LEFT, &distance, &turn, result);

    if (status || !turn.told) {
        return status;
    }
    warning_add(
        warnings_of(document), "pose-differs", turn_json(&turn, distance),
        turn.sphere
            ? "Nothing is registered here, and %s are %.3g apart, and %.3g with the sphere under "
              "one turned by %.0f degrees: their maps to the sphere are turned. commonPose "
              "cannot undo that: let rotations be sought (register true, without commonPose)."
            : "Nothing is registered here, and %s are %.3g apart as they lie, and %.3g with one "
              "turned by %.0f degrees: they do not share a pose. Bring them into one, or let "
              "rotations be sought (register true, without commonPose).",
        what, distance, turn.turned, turn.angle);
    return 0;
}

void pair_clear(struct jobs_run *run, struct pair *pair)
{
    compute_surface_clear(&pair->ends[0]);
    compute_surface_clear(&pair->ends[1]);
    srnf_registration_clear(&pair->registration);
    if (pair->sht) {
        jobs_transform_release(jobs_run_jobs(run), pair->sht);
    }
    srnf_free(pair->coefficients);
    *pair = (struct pair){.degree = 0};
}
