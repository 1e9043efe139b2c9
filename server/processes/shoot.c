/*
 * shoot.c - the process shoot: the surfaces along the geodesic from a surface with a velocity.
 *
 * The surface that a velocity is toward is registered to the surface shot from, unless register is
 * false; at t = 1 the path is at it, as it is registered. Its scale goes geometrically: that of the
 * surface at 0, that of the other at 1, positive at any time. A velocity given by numbers leaves
 * the scale as it is.
 */
#include <math.h>
#include <stdio.h>

#include "toolkit/seconds.h"
#include "toolkit/velocity.h"

struct shoot {
    char surface[STORE_ID_MAX];
    struct velocity velocity;
    struct input_numbers times;
    bool registered, common_pose;
    int method;
};

static const struct input_numbers standard = {5, {0.0, 0.25, 0.5, 0.75, 1.0}};

static const struct process_input inputs[] = {
    {"surface", INPUT_SURFACE, offsetof(struct shoot, surface),
     "Surface at t = 0; a mesh is encoded with the default options.", .required = true},
    {"velocity", INPUT_OWN, offsetof(struct shoot, velocity),
     "What it moves by in one unit of time." VELOCITY_TEXT, .required = true, .own = &velocity_own},
    {"times", INPUT_NUMBERS, offsetof(struct shoot, times),
     "Times of the surfaces, in any order, negative ones too.", .highest = PROCESS_TIME_MAX,
     .most = PROCESS_TIMES_MAX, .numbers = &standard},
    DEFORMATION_INPUTS(shoot, "Register the surface that the velocity is toward", "it is"),
    {.name = NULL},
};

static const struct process_output outputs[] = {
    {"surfaces", OUTPUT_OBJECTS, "Records of the surfaces at the times."},
    {"times", OUTPUT_NUMBERS, "Those of the surfaces."},
    {"energies", OUTPUT_NUMBERS_OR_NULLS, "Squared distance of each surface's SRNF from the line."},
    {"relativeEnergies", OUTPUT_NUMBERS_OR_NULLS,
     "The same divided by the squared norm of the point on the line."},
    {"transforms", OUTPUT_NUMBER, "Cost in gradient transforms."},
    {"registration", OUTPUT_OBJECT_OR_NULL, "As" REGISTRATION_FIGURES_TEXT},
    {"pullback", OUTPUT_OBJECT_OR_NULL,
     "Of method pullback, null otherwise: toward, the geodesic that the velocity was taken from, "
     "or null; shots, the path to each surface, null at time 0. Each " PATH_TEXT
     ". converged: all of them."},
    {NULL, NULL, NULL},
};

static json_t *keep_surfaces(struct jobs_run *run, const struct shoot *shoot,
                             const struct compute_group *group,
                             const struct srnf_deform_shoot *shot, struct jobs_result *result)
{
    size_t count = 3 * srnf_coefficient_count(group->degree);
    const double *times = shoot->times.values;
    double start = process_scale(run, shoot->surface, group->scales[0]), growth = 1.0;
    json_t *records = json_array(), *record;
    char name[64];

    if (shoot->velocity.toward[0]) {
        growth = process_scale(run, shoot->velocity.toward, group->scales[1]) / start;
    }
    for (size_t i = 0; i < shot->shot.n; i++) {
        (void)snprintf(name, sizeof name, "shot, t = %.4g", times[i]);
        record =
            keep_reached(run, "shoot", name, group->degree, shot->shot.coefficients + i * count,
                         start * pow(growth, times[i]), &shot->measures[i], shoot->surface, result);
        if (!record) {
            json_decref(records);
            return NULL;
        }
        (void)json_array_append_new(records, record);
    }
    return records;
}

static json_t *document_of(const struct shoot *shoot, const struct deformation *deformation,
                           const struct srnf_deform_shoot *result, json_t *surfaces)
{
    const struct srnf_shot *shot = &result->shot;
    const struct srnf_deform_paths *paths = &result->paths;
    json_t *document = json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "surfaces", surfaces, "times",
                                 json_vector(shoot->times.values, shot->n), "energies",
                                 json_vector(shot->energy, shot->n), "relativeEnergies",
                                 json_vector(shot->relative_energy, shot->n), "transforms",
                                 json_finite(shot->transforms), "registration",
                                 alignment_json(&result->toward, &deformation->registration));

    (void)json_object_set_new(document, "pullback",
                              deformation->options.pullback
                                  ? json_pack("{s:o, s:o, s:b}", "toward",
                                              path_json(&paths->toward), "shots",
                                              path_shots_json(paths), "converged", paths->converged)
                                  : json_null());
    registration_warn(document, &result->toward, "the surface toward onto surface");
    return document;
}

static json_t *run_shoot(struct jobs_run *run, const void *typed, struct jobs_result *result)
{
    const struct shoot *shoot = typed;
    const char *ids[2] = {shoot->surface, shoot->velocity.toward};
    struct deformation deformation;
    struct srnf_deform_shoot shot = {.step = NULL};
    struct srnf_error error = {0};
    json_t *document = NULL, *surfaces;
    int status;

    if (deformation_open(run, ids[1][0] ? 2 : 1, ids, &shoot->velocity, shoot->registered,
                         shoot->common_pose, (enum deformation_method)shoot->method, &deformation,
                         result)) {
        goto out;
    }
    status = srnf_deform_shoot(deformation.sht, deformation.surfaces[0], &deformation.velocity,
                               shoot->times.n, shoot->times.values, &deformation.options,
                               jobs_run_context(run), &shot, &error);
    if (status) {
        (void)compute_fail(result, status, &error, shot.step);
        goto out;
    }
    surfaces = keep_surfaces(run, shoot, &deformation.group, &shot, result);
    document = surfaces ? document_of(shoot, &deformation, &shot, surfaces) : NULL;
    if (ids[1][0]) {
        document = deformation_warn_pose(run, &deformation, 0, 1,
                                         "surface and what velocity is toward", document, result);
    }
out:
    srnf_deform_shoot_clear(&shot);
    deformation_close(&deformation);
    return document;
}

static const struct process_table table = {
    .inputs = inputs,
    .outputs = outputs,
    .size = sizeof(struct shoot),
    .check = registration_one_spelling,
    .run = run_shoot,
};

const struct api_process shoot_process = {
    .id = "shoot",
    .title = "Shoot from a surface",
    .description = "The surfaces along the geodesic from a surface with a velocity: toward another "
                   "surface, or given by numbers.",
    .table = &table,
    .seconds = shoot_seconds,
};
