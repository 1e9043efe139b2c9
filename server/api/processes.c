/*
 * processes.c - the table of the processes that can be executed.
 *
 * A row is all that the service knows of a process: the routes, the job engine's table and the
 * self-description are made from it.
 */
#include <string.h>

#include "api/process.h"

const struct api_process api_processes[] = {
    {"encode", "Encode a mesh",
     "From a triangle mesh of genus zero to a surface: harmonic coefficients over the sphere, "
     "centred "
     "and scaled, with the distance between the two.",
     encode_inputs_schema, encode_outputs_schema, encode_canonicalise, encode_run},
    {"invert", "Invert a square-root normal field",
     "From an SRNF to the surface that has it, with the energy that is left, what proves the "
     "surface "
     "right and how far off it can be.",
     invert_inputs_schema, invert_outputs_schema, invert_canonicalise, invert_run},
    {"geodesic", "Geodesic between two surfaces",
     "The path between two surfaces as they are parameterised: each point of the straight line "
     "between "
     "their SRNFs, inverted.",
     geodesic_inputs_schema, geodesic_outputs_schema, geodesic_canonicalise, geodesic_run},
    {NULL, NULL, NULL, NULL, NULL, NULL, NULL},
};

const struct api_process *api_process_find(const char *id)
{
    for (const struct api_process *process = api_processes; process->id; process++) {
        if (strcmp(process->id, id) == 0) {
            return process;
        }
    }
    return NULL;
}
