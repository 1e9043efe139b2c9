/*
 * seconds.c - the expected time of each process: so many encodings, registrations and
 * inversions of what its inputs name (compute/seconds.h).
 *
 * Where inputs leave open how long a job takes, such as a tolerance, the guess is a long one, so
 * that the express worker is not held up.
 */
#include "toolkit/seconds.h"

#include <math.h>
#include <string.h>

#include "compute/seconds.h"
#include "toolkit/process.h"

#define PULLBACK 50.0 /* a path or a mean in the pulled-back metric, in inversions for each step */
#define LONG 60.0     /* what the inputs leave open */
#define MEAN 2.0      /* all iterations of a mean, in registrations of each member */
#define SHOOT_STEP 0.05 /* a surface on the way to those shot, in inversions */
#define SHOOT_WAY_MAX 64.0

/* ---- Parts ----------------------------------------------------------------------------------- */

static double number(const json_t *inputs, const char *name)
{
    return json_number_value(json_object_get(inputs, name));
}

static double degree_of(const struct api_work *work, const json_t *inputs)
{
    double asked = number(inputs, "lmax");

    return asked > 0.0 ? asked : (double)work->degree;
}

/* Of the meshes that are given where surfaces are wanted. */
static double first(const struct api_work *work)
{
    return seconds_of_encodings((double)work->degree, (double)work->meshes, (double)work->faces);
}

double seconds_of_group(const struct api_work *work, bool registered)
{
    return first(work) + (registered
                              ? seconds_of_encodings((double)work->degree, (double)work->bridges,
                                                     (double)work->bridged_faces)
                              : 0.0);
}

static double of_members(const struct api_work *work)
{
    return (double)(work->surfaces + work->meshes);
}

/* A path from a surface to another in `steps` inversions; before it, as many registrations, both
   ways unless the inputs say otherwise. */
static double path(const struct api_work *work, const json_t *inputs, double registrations,
                   double steps)
{
    bool symmetric = !json_is_false(json_object_get(inputs, "symmetric"));
    double degree = degree_of(work, inputs);
    double each = seconds_of_inversion(degree) *
                  (inputs_chose(inputs, "method", "pullback") ? PULLBACK : 0.2);

    return first(work) + steps * each +
           (json_is_true(json_object_get(inputs, "register"))
                ? registrations * seconds_of_pair(degree, symmetric)
                : 0.0);
}

/* ---- Processes ------------------------------------------------------------------------------- */

double encode_seconds(const struct api_work *work, const json_t *inputs)
{
    bool one = json_is_null(json_object_get(inputs, "cohort")); /* its sphere is none more */

    return seconds_of_encodings(number(inputs, "lmax"), one ? 1.0 : (double)work->meshes,
                                (double)work->faces);
}

double invert_seconds(const struct api_work *work, const json_t *inputs)
{
    (void)work;
    (void)inputs;
    return LONG;
}

double geodesic_seconds(const struct api_work *work, const json_t *inputs)
{
    return path(work, inputs, 1.0, number(inputs, "steps"));
}

double register_seconds(const struct api_work *work, const json_t *inputs)
{
    bool symmetric = json_is_true(json_object_get(inputs, "symmetric"));

    return first(work) + seconds_of_pair((double)work->degree, symmetric) *
                             (json_is_true(json_object_get(inputs, "exact")) ? 4.0 : 1.0);
}

double distances_seconds(const struct api_work *work, const json_t *inputs)
{
    double n = of_members(work), pairs = 0.5 * n * (n - 1.0), degree = degree_of(work, inputs);
    bool registered = json_is_true(json_object_get(inputs, "register"));

    return seconds_of_group(work, registered) +
           pairs * (registered ? seconds_of_pair(degree, true) : 1e-6 * degree * degree);
}

/* As if bounds spared no pair: how many they do only the search tells. */
double neighbours_seconds(const struct api_work *work, const json_t *inputs)
{
    double n = of_members(work), pairs = 0.5 * n * (n - 1.0);

    return seconds_of_group(work, true) + pairs * seconds_of_pair(degree_of(work, inputs), true);
}

double mean_seconds(const struct api_work *work, const json_t *inputs)
{
    double n = of_members(work), degree = degree_of(work, inputs);
    bool registered = json_is_true(json_object_get(inputs, "register"));
    bool pullback = inputs_chose(inputs, "method", "pullback");

    return seconds_of_group(work, registered) +
           seconds_of_inversion(degree) * (1.0 + (pullback ? PULLBACK * n : 0.0)) +
           n * (registered ? seconds_of_registration(degree) * (pullback ? 4.0 : MEAN)
                           : 1e-4 * degree * degree);
}

double modes_seconds(const struct api_work *work, const json_t *inputs)
{
    double points = (double)json_array_size(json_object_get(inputs, "coefficients"));

    return points * seconds_of_inversion((double)work->degree);
}

double sample_seconds(const struct api_work *work, const json_t *inputs)
{
    return number(inputs, "count") * 2.0 * seconds_of_inversion((double)work->degree);
}

/* Models of surfaces as they are parameterized take less; the inputs do not say. */
double project_seconds(const struct api_work *work, const json_t *inputs)
{
    const char *handedness = json_string_value(json_object_get(inputs, "handedness"));
    double images = handedness && strcmp(handedness, "check") == 0 ? 1.0 : 0.0;

    return first(work) + (1.0 + images) * seconds_of_registration((double)work->degree);
}

double evaluate_seconds(const struct api_work *work, const json_t *inputs)
{
    double n = of_members(work), degree = degree_of(work, inputs);

    return (n > 0.0 ? mean_seconds(work, inputs) : 0.0) +
           3.0 * number(inputs, "samples") * seconds_of_inversion(degree);
}

double compare_seconds(const struct api_work *work, const json_t *inputs)
{
    double n = of_members(work), degree = degree_of(work, inputs);

    return mean_seconds(work, inputs) +
           4e-9 * number(inputs, "permutations") * n * 2.0 * degree * degree * 3.0;
}

double regress_seconds(const struct api_work *work, const json_t *inputs)
{
    const json_t *design = json_object_get(json_object_get(inputs, "cohort"), "design");
    double n = of_members(work), degree = degree_of(work, inputs);
    double tests = (double)json_array_size(json_object_get(design, "tests"));
    double columns = (double)json_array_size(json_object_get(design, "columns"));
    double points = (double)json_array_size(json_object_get(inputs, "at"));

    return mean_seconds(work, inputs) + (n + points) * seconds_of_inversion(degree) +
           4e-9 * number(inputs, "permutations") * tests * columns * n * 2.0 * degree * degree *
               3.0;
}

/* Surfaces on the way to the times (core/geodesic/shoot.c): one for each tenth of the norm of the
   field at 0, SHOOT_WAY_MAX at most between two times. A surface toward is taken to be as far as
   that norm; a velocity in numbers may be any. */
static double shoot_way(const json_t *inputs)
{
    const json_t *times = json_object_get(inputs, "times"), *time;
    double n = (double)json_array_size(times), forth = 0.0, back = 0.0;
    size_t i;

    json_array_foreach(times, i, time)
    {
        forth = fmax(forth, json_number_value(time));
        back = fmax(back, -json_number_value(time));
    }
    return json_object_get(json_object_get(inputs, "velocity"), "toward")
               ? fmin(SHOOT_WAY_MAX * n, n + (forth + back) / 0.1)
               : SHOOT_WAY_MAX * n;
}

double shoot_seconds(const struct api_work *work, const json_t *inputs)
{
    double n = (double)json_array_size(json_object_get(inputs, "times"));

    return inputs_chose(inputs, "method", "pullback")
               ? path(work, inputs, 1.0, n + 4.0)
               : path(work, inputs, 1.0, n) +
                     SHOOT_STEP * shoot_way(inputs) * seconds_of_inversion(degree_of(work, inputs));
}

double transport_seconds(const struct api_work *work, const json_t *inputs)
{
    return path(work, inputs, 2.0, 4.0);
}

double transfer_seconds(const struct api_work *work, const json_t *inputs)
{
    return path(work, inputs, 2.0, 4.0);
}
