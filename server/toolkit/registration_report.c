/*
 * registration_report.c - figures and warnings of a registration.
 *
 * A distance is measured with the exact SRNF of the warped surface. The registered surface is a
 * series of the degree of the pair, which cuts off what the warp adds: where that is as large as
 * the distance, the surface, and a path to it, say little. The bounds of the warnings were set on
 * ten pairs of real surfaces at degrees 8, 15 and 31 (tests/bench/bench_pairs.c prints them).
 */
#include "toolkit/registration_report.h"

#include "toolkit/process.h"
#include "api/warnings.h"

static const char both_ways[] =
    "Both ways were searched and the better one kept: the distance is the same from either side.";
static const char one_way[] =
    "One way was searched, the moving surface onto the template. From the other side the distance "
    "may differ, as may that of distances and geodesic, which search both ways (symmetric true).";

static const char by_meshes[] =
    "The surfaces came by different routes from meshes that are known. The maps of the meshes lead "
    "from one route to the other; searched, for two meshes, was between their encodings by area.";

/* null where rotations were not searched. */
static json_t *ambiguity(const struct srnf_registration *r)
{
    bool other = r->rotations_searched && r->ambiguity_objective > 0.0;

    return json_pack("{s:o, s:o, s:o}", "objective",
                     other ? json_finite(r->ambiguity_objective) : json_null(), "angle",
                     other ? json_finite(r->ambiguity_angle) : json_null(), "rotationalCurvature",
                     r->rotations_searched ? json_finite(r->rotational_curvature) : json_null());
}

json_t *registration_figures(const struct srnf_registration *r,
                             const struct srnf_register_options *options)
{
    json_t *object = json_object();
    const struct {
        const char *name;
        json_t *value;
    } figures[] = {
        {"distance", json_finite(r->distance)},
        {"distanceBefore", json_finite(r->distance_before)},
        {"objective", json_finite(r->objective)},
        {"minJacobian", json_finite(r->min_jacobian)},
        {"maxJacobian", json_finite(r->max_jacobian)},
        {"truncationError", json_finite(r->truncation_error)},
        {"ambiguity", ambiguity(r)},
        {"inverseConsistency",
         options->symmetric ? json_finite(r->inverse_consistency) : json_null()},
        {"iterations", json_integer((json_int_t)r->iterations)},
        {"converged", json_boolean(r->converged)},
        {"stopped", json_string(srnf_register_stop_name(r->stopped))},
        {"symmetric", json_boolean(options->symmetric)},
        {"note", json_string(options->symmetric ? both_ways : one_way)},
    };

    for (size_t i = 0; i < sizeof figures / sizeof figures[0]; i++) {
        (void)json_object_set_new(object, figures[i].name, figures[i].value);
    }
    return object;
}

void registration_bridged(json_t *document, json_t *figures, bool bridged)
{
    (void)json_object_set_new(document, "bridged", json_boolean(bridged));
    if (bridged) {
        (void)json_object_set_new(figures, "note", json_string(by_meshes));
    }
}

/* Whether the registration that a document tells of was asked for both ways, by an input. */
static bool asked_both_ways(const json_t *document)
{
    const json_t *told = json_object_get(document, "registration");
    const json_t *options = json_object_get(told, "options");

    return json_is_true(json_object_get(options ? options : told, "symmetric"));
}

static void warn_truncated(json_t *warnings, const struct srnf_registration *r, const char *what,
                           bool one_way_helps)
{
    if (!(r->truncation_error > REGISTRATION_TRUNCATED_LEAST) ||
        !(r->truncation_distance > REGISTRATION_TRUNCATED_RATIO * r->distance)) {
        return;
    }
    warning_add(warnings, "registration-truncated",
                json_pack("{s:f, s:f, s:f}", "truncationError", r->truncation_error,
                          "truncationDistance", r->truncation_distance, "distance", r->distance),
                "Registering %s: the registered surface is cut to its degree, which moves its SRNF "
                "by %.3g, against a distance of %.3g. The distance was measured before the cut; "
                "the surface, and paths to it, are off by that much. Encode with a higher lmax%s.",
                what, r->truncation_distance, r->distance,
                one_way_helps ? "; one way (symmetric false) less is cut off" : "");
}

static void warn_distorted(json_t *warnings, const struct srnf_registration *r, const char *what)
{
    if (r->min_jacobian >= 1.0 / REGISTRATION_DISTORTED_FACTOR &&
        r->max_jacobian <= REGISTRATION_DISTORTED_FACTOR) {
        return;
    }
    warning_add(warnings, "registration-distorted",
                json_pack("{s:o, s:o}", "minJacobian", json_finite(r->min_jacobian), "maxJacobian",
                          json_finite(r->max_jacobian)),
                "Registering %s: the warp scales areas by factors from %.3g to %.3g: parts of one "
                "surface vanish into points of the other, which makes the distance too small. Use "
                "the default penalty or a larger one.",
                what, r->min_jacobian, r->max_jacobian);
}

static void warn_ambiguous(json_t *warnings, const struct srnf_registration *r, const char *what)
{
    bool basin =
        r->ambiguity_objective > 0.0 && r->ambiguity_objective <= REGISTRATION_AMBIGUOUS_FACTOR;
    bool flat = r->rotational_curvature < REGISTRATION_AMBIGUOUS_CURVATURE;

    if (!r->rotations_searched || (!basin && !flat)) {
        return;
    }
    warning_add(warnings, "registration-ambiguous", ambiguity(r),
                "Registering %s: %s. The distance stands; pose and correspondence are one choice "
                "among several. Where the surfaces share a pose, commonPose settles it, unless "
                "their maps to the sphere are turned against each other, as of symmetric shapes: "
                "then take rotation false of register, which turns the sphere alone.",
                what,
                basin ? "another way of laying the surfaces on each other is within 5 % as good"
                      : "the surfaces can be turned against each other at almost no cost");
}

void registration_warn(json_t *document, const struct srnf_registration *r, const char *what)
{
    json_t *warnings = json_array();

    if (r->coefficients) {
        warn_truncated(warnings, r, what, asked_both_ways(document));
        warn_distorted(warnings, r, what);
        warn_ambiguous(warnings, r, what);
        if (!r->converged) {
            warning_add(
                warnings, "registration-not-converged",
                json_pack("{s:I, s:f}", "iterations", (json_int_t)r->iterations, "distance",
                          r->distance),
                "Registering %s: the steps ran out while the objective still fell. A longer "
                "search would find a smaller distance.",
                what);
        }
    }
    warnings_put(document, warnings);
}
