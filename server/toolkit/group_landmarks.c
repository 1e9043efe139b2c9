/*
 * group_landmarks.c - where the landmarks of a group lie, and what its mean leaves between them.
 *
 * As of a pair (landmarks.c), the nearest point of a surface stands for a vertex or a position.
 */
#include "toolkit/group_landmarks.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "api/surfaces.h"

/* ---- Placing --------------------------------------------------------------------------------- */

static struct surface_place place_of(struct jobs_run *run, const struct group_input *members,
                                     const struct compute_group *group, size_t i)
{
    struct compute_surface surface = {.scale = group->scales[i]};

    (void)snprintf(surface.id, sizeof surface.id, "%s", members->ids[i]);
    memcpy(surface.origin, group->origins[i], sizeof surface.origin);
    return process_place(run, &surface);
}

static int place_member(struct jobs_run *run, struct group_landmarks *l,
                        const struct group_input *members, const struct compute_group *group,
                        size_t i, struct jobs_result *result)
{
    const json_t *lists = l->input->points;
    const struct surface_place place = place_of(run, members, group, i);
    double points[3 * LANDMARKS_GIVEN_MAX];
    int status = landmarks_place_points(
        run, json_array_get(lists, json_array_size(lists) == 1 ? 0 : i), &place, group->degree,
        group->surfaces[i], points, l->off + i * l->n, result);

    l->scales[i] = place.scale;
    for (size_t k = 0; k < l->n && status == 0; k++) {
        memcpy(l->points + 3 * (i * l->n + k), points + 3 * l->order[k], 3 * sizeof(double));
    }
    return status;
}

int group_landmarks_place(struct jobs_run *run, const struct group_landmarks_input *input,
                          const struct group_input *members, const struct compute_group *group,
                          struct group_landmarks *l, struct jobs_result *result)
{
    const struct srnf_context *context = jobs_run_context(run);
    size_t guiding = 0, n = 0;
    int status = 0;

    *l = (struct group_landmarks){
        .input = input, .n = input->n, .members = group->n, .ids = members->ids};
    for (int kind = 0; kind < 2; kind++) {
        for (size_t j = 0; j < l->n; j++) {
            if (input->held_out[j] == (kind == 1)) {
                l->order[n++] = j;
            }
        }
        guiding = kind == 0 ? n : guiding;
    }
    l->points = srnf_alloc(group->n, (4 * l->n + 1) * sizeof(double));
    if (!l->points) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "placing the landmarks");
    }
    l->off = l->points + 3 * l->n * group->n;
    l->scales = l->off + l->n * group->n;
    for (size_t i = 0; i < group->n && status == 0; i++) {
        status = context->canceled(context->user)
                     ? compute_fail(result, SRNF_ECANCELED, NULL, "placing the landmarks")
                     : place_member(run, l, members, group, i, result);
    }
    l->group = (struct srnf_group_landmarks){l->n, guiding, l->points, input->weight};
    return status;
}

void group_landmarks_clear(struct group_landmarks *l)
{
    srnf_free(l->points);
    *l = (struct group_landmarks){.n = 0};
}

/* ---- Report ---------------------------------------------------------------------------------- */

/* Angles and distances of all, [members][n], in the order of the input. */
static int measure(const struct group_landmarks *l, const struct compute_mean_outputs *outputs,
                   double *angles, double *distances)
{
    const struct compute_group *group = &outputs->group;
    int status = SRNF_OK;

    for (size_t i = 0; i < l->members && status == SRNF_OK; i++) {
        const double *reached = outputs->mean.landmark_points + 3 * i * l->n;
        const double *wanted = l->points + 3 * i * l->n;
        const struct srnf_landmarks pairs = {l->n, reached, wanted, INFINITY};
        const struct srnf_warp none = {.n_links = 0}; /* they are where the warps took them */
        double apart[LANDMARKS_GIVEN_MAX], off[LANDMARKS_GIVEN_MAX];

        status = srnf_landmarks_measure(&none, &pairs, apart);
        status = status ? status
                        : landmarks_distances(group->degree, group->surfaces[i], l->n, reached,
                                              wanted, off);
        for (size_t k = 0; k < l->n && status == SRNF_OK; k++) {
            angles[i * l->n + l->order[k]] = apart[k];
            distances[i * l->n + l->order[k]] = l->scales[i] * off[k];
        }
    }
    return status;
}

/* position: x, y, z of all landmarks in turn, in the order of the core. */
static json_t *points_json(const struct group_landmarks *l, const double *angles,
                           const double *distances, const double *positions, double scale)
{
    json_t *points = json_array();
    size_t place[LANDMARKS_GIVEN_MAX];

    for (size_t k = 0; k < l->n; k++) {
        place[l->order[k]] = k;
    }
    for (size_t j = 0; j < l->n; j++) {
        double most[2] = {0.0, 0.0}, squares[2] = {0.0, 0.0}, x[3];
        double count = (double)l->members;

        for (size_t i = 0; i < l->members; i++) {
            double angle = angles[i * l->n + j], distance = distances[i * l->n + j];

            most[0] = fmax(most[0], angle);
            most[1] = fmax(most[1], distance);
            squares[0] += angle * angle / count;
            squares[1] += distance * distance / count;
        }
        for (size_t c = 0; c < 3; c++) {
            x[c] = scale * positions[c * l->n + place[j]];
        }
        (void)json_array_append_new(
            points,
            json_pack("{s:o, s:b, s:o, s:o, s:o, s:o}", "position", json_vector(x, 3), "heldOut",
                      (int)l->input->held_out[j], "maxAngle", json_finite(most[0]), "rmsAngle",
                      json_finite(sqrt(squares[0])), "maxDistance", json_finite(most[1]),
                      "rmsDistance", json_finite(sqrt(squares[1]))));
    }
    return points;
}

static json_t *members_json(const struct group_landmarks *l, const double *angles,
                            const double *distances)
{
    json_t *members = json_array();

    for (size_t i = 0; i < l->members; i++) {
        (void)json_array_append_new(
            members, json_pack("{s:o, s:o, s:o}", "angles", json_vector(angles + i * l->n, l->n),
                               "distances", json_vector(distances + i * l->n, l->n), "off",
                               json_vector(l->off + i * l->n, l->n)));
    }
    return members;
}

/* Points that are none of their surface. */
static void warn_off(struct jobs_run *run, const struct group_landmarks *l,
                     const struct compute_group *group, json_t *document)
{
    struct jobs *jobs = jobs_run_jobs(run);
    const struct srnf_sht *sht = NULL;

    if (jobs_transform_acquire(jobs, group->degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0, &sht)) {
        return;
    }
    for (size_t i = 0; i < l->members; i++) {
        struct srnf_surface_measures measures;

        if (srnf_surfaces_measure(sht, 1, group->surfaces[i], NULL, &measures) == SRNF_OK) {
            char member[32];

            (void)snprintf(member, sizeof member, "member %zu", i);
            landmarks_warn_off(document, member, l->ids[i], l->scales[i], measures.area, l->n,
                               l->off + i * l->n);
        }
    }
    jobs_transform_release(jobs, sht);
}

int group_landmarks_report(struct jobs_run *run, const struct group_landmarks *l,
                           const struct compute_mean_outputs *outputs, double scale,
                           json_t *document, struct jobs_result *result)
{
    size_t all = l->members * l->n;
    double *angles = srnf_alloc(2 * all + 3 * l->n, sizeof(double));
    double *distances = angles ? angles + all : NULL;
    double *positions = angles ? angles + 2 * all : NULL;
    int status = angles ? SRNF_OK : SRNF_ENOMEM;

    if (l->n == 0) {
        srnf_free(angles);
        (void)json_object_set_new(document, "landmarks", json_null());
        return 0;
    }
    status = status ? status : measure(l, outputs, angles, distances);
    status = status ? status
                    : srnf_harmonics_at_points(outputs->group.degree, 3, outputs->mean.coefficients,
                                               l->n, outputs->mean.landmarks, positions, NULL);
    if (status) {
        srnf_free(angles);
        return compute_fail(result, status, NULL, "measuring the landmarks");
    }
    (void)json_object_set_new(
        document, "landmarks",
        json_pack("{s:o, s:o, s:o, s:o, s:o}", "points",
                  points_json(l, angles, distances, positions, scale), "members",
                  members_json(l, angles, distances), "guiding",
                  landmarks_summary(l->members, l->n, l->input->held_out, false, angles, distances),
                  "heldOut",
                  landmarks_summary(l->members, l->n, l->input->held_out, true, angles, distances),
                  "weight",
                  isinf(l->input->weight) ? json_string("exact") : json_real(l->input->weight)));
    warn_off(run, l, &outputs->group, document);
    srnf_free(angles);
    return 0;
}
