/*
 * answers.c - doubts from the figures of results.
 *
 * A surface that a process makes has the SRNF nearest to a field that is asked for: a point of a
 * line, a mean, a sample. relativeEnergy is the squared distance of the two over the squared norm
 * of the field; 0 where the field is that of a surface.
 */
#include "toolkit/answers.h"

#include <math.h>
#include <string.h>

#include "api/warnings.h"
#include "toolkit/process.h"

/* Paths and shots (t from -1 to 2) between eight nuclei of tests/data, by area at degree 8, as they
   are and registered: relative energies of 1e-4 to 0.07 and lengths of 1.00 to 1.07 lines, and 0.14
   and 1.19 for two whose parameters have nothing to do with each other (a line of 1.8). Surfaces of
   noise: 0.15 to 0.5, and lengths that grow with the steps. To measure again: geodesic and shoot
   for pairs of them. ANSWERS_REACHED, and: */
#define JUMPS 1.5

/* ---- Surfaces -------------------------------------------------------------------------------- */

/* The relative energies of the surfaces of a result: a number, an array, or of a geodesic the array
   of its method. */
static const json_t *energies_of(const json_t *inputs, const json_t *document)
{
    const json_t *one = json_object_get(document, "relativeEnergy");
    const json_t *all = json_object_get(document, "relativeEnergies");

    if (!json_is_object(all)) {
        return one ? one : all;
    }
    return json_object_get(all, inputs_chose(inputs, "method", "closed-form") ? "closedForm"
                                : inputs_chose(inputs, "method", "linear")    ? "linear"
                                                                              : "geodesic");
}

void answers_warn_energies(const json_t *energies, json_t *document)
{
    size_t n = json_is_array(energies) ? json_array_size(energies) : 1, beyond = 0, worst = 0;
    double most = 0.0;

    for (size_t i = 0; i < n; i++) {
        const json_t *value = json_is_array(energies) ? json_array_get(energies, i) : energies;
        double energy = json_number_value(value);

        beyond += energy > ANSWERS_REACHED;
        worst = energy > most ? i : worst;
        most = fmax(most, energy);
    }
    if (beyond == 0) {
        return;
    }
    warning_add(warnings_of(document), "not-reached",
                json_pack("{s:f, s:f, s:I, s:I, s:I}", "relativeEnergy", most, "limit",
                          ANSWERS_REACHED, "index", (json_int_t)worst, "beyond", (json_int_t)beyond,
                          "of", (json_int_t)n),
                "No surface was found that has the field asked for: of %zu of %zu the SRNF is "
                "further from it than %.0f %% of its norm, of one by %.0f %% (relativeEnergy "
                "%.3g). The field is beyond what surfaces have, or another surface would be "
                "nearer; what is seen is not what was asked for. Go less far, or compare surfaces "
                "that are more alike or smoother.",
                beyond, n, 100.0 * sqrt(ANSWERS_REACHED), 100.0 * sqrt(most), most);
}

/* ---- Paths ----------------------------------------------------------------------------------- */

/* Along the surfaces of a path the length is the more the finer it is looked at, and little more
   than that of the line where each surface follows from the one before. */
static void warn_jumps(json_t *document)
{
    double length = json_number_value(json_object_get(document, "length"));
    double line = json_number_value(json_object_get(document, "lineLength"));

    if (!(length > JUMPS * line) || !(line > 0.0)) {
        return;
    }
    warning_add(warnings_of(document), "path-jumps",
                json_pack("{s:f, s:f, s:f}", "length", length, "lineLength", line, "limit", JUMPS),
                "The path is %.3g times as long as the line between the fields of its ends (%.4g "
                "and %.4g): its surfaces jump between solutions, and the length depends on the "
                "number of steps. The distance is that of the ends and stands; the surfaces "
                "between do not show a geodesic.",
                length / line, length, line);
}

/* ---- Metrics --------------------------------------------------------------------------------- */

static void warn_parameters(const json_t *inputs, json_t *document)
{
    if (!inputs_chose(inputs, "metric", "harmonic") ||
        !json_is_true(json_object_get(inputs, "register"))) {
        return;
    }
    warning_add(warnings_of(document), "parameters-not-registered", NULL,
                "The metric harmonic turns surfaces in space and leaves their parameters as they "
                "are: a surface and itself with the sphere turned under it are apart. Where "
                "parameters do not correspond by the way they were made, take metric srnf.");
}

void answers_warn(const json_t *inputs, json_t *document)
{
    if (!inputs_chose(inputs, "method", "pullback")) {
        answers_warn_energies(energies_of(inputs, document), document);
        if (!inputs_chose(inputs, "method", "linear")) {
            warn_jumps(document);
        }
    }
    warn_parameters(inputs, document);
}
