/*
 * processes.c - the table of the processes that can be executed.
 *
 * A row is all that the service knows of a process: the routes, the job engine's table and the
 * self-description are made from it.
 */
#include <string.h>

#include "api/process.h"
#include "api/process_seconds.h"

const struct api_process api_processes[] = {
    {"encode", "Encode a mesh",
     "From a triangle mesh of genus zero to a surface: harmonic coefficients over the sphere, "
     "centred "
     "and scaled, with the distance between the two.",
     encode_inputs_schema, encode_outputs_schema, encode_canonicalise, encode_run, encode_seconds},
    {"invert", "Invert a square-root normal field",
     "From an SRNF to the surface that has it, with the energy that is left, what proves the "
     "surface "
     "right and how far off it can be.",
     invert_inputs_schema, invert_outputs_schema, invert_canonicalise, invert_run, invert_seconds},
    {"geodesic", "Geodesic between two surfaces",
     "The path between two surfaces, the second registered to the first unless that is not wanted: "
     "each point of the straight line between their SRNFs, inverted.",
     geodesic_inputs_schema, geodesic_outputs_schema, geodesic_canonicalise, geodesic_run,
     geodesic_seconds},
    {"register", "Register a surface to another",
     "The rotation and the warp of the sphere that lay one surface on another, "
     "elastically, by their SRNFs; the surface so laid, and how far it then is.",
     register_inputs_schema, register_outputs_schema, register_canonicalise, register_run,
     register_seconds},
    {"distances", "Distances between surfaces",
     "The symmetric matrix of distances between the surfaces of a list or a cohort, "
     "registered pair by pair or as they are parameterised.",
     distances_inputs_schema, distances_outputs_schema, distances_canonicalise, distances_run,
     distances_seconds},
    {"mean", "Mean of a group",
     "The Karcher mean: all surfaces registered to the mean SRNF, averaged, and so on "
     "until it rests; then inverted once.",
     mean_inputs_schema, mean_outputs_schema, mean_canonicalise, mean_run, mean_seconds},
    {"pca", "Principal components of a group",
     "The mean and the principal components of the registered SRNFs about it, as a model "
     "that is kept.",
     pca_inputs_schema, pca_outputs_schema, pca_canonicalise, pca_run, mean_seconds},
    {"modes", "Modes of variation",
     "The surfaces along one principal component of a model, with how far each point is "
     "from being a surface at all.",
     modes_inputs_schema, modes_outputs_schema, modes_canonicalise, modes_run, modes_seconds},
    {"sample", "Samples of a model",
     "Random surfaces from the normal distribution of a model, the same ones from the "
     "same seed.",
     sample_inputs_schema, sample_outputs_schema, sample_canonicalise, sample_run, sample_seconds},
    {"project", "Project a surface into a model",
     "The scores of a surface in a model that is not fitted again, and what its "
     "components cannot represent.",
     project_inputs_schema, project_outputs_schema, project_canonicalise, project_run,
     project_seconds},
    {"evaluate-model", "Quality of a model",
     "Compactness, generalisation and specificity of a model or of the model that a group makes, "
     "as curves over the number of components with standard errors.",
     evaluate_inputs_schema, evaluate_outputs_schema, evaluate_canonicalise, evaluate_run,
     evaluate_seconds},
    {"compare-groups", "Comparison of two groups",
     "A permutation test of the difference between the means of two groups, and a map of where "
     "they differ, corrected for multiple comparisons, with covariates regressed out.",
     compare_inputs_schema, compare_outputs_schema, compare_canonicalise, compare_run,
     compare_seconds},
    {"shoot", "Shoot from a surface",
     "The surfaces along the geodesic from a surface with a velocity: toward another surface, or "
     "given by numbers.",
     shoot_inputs_schema, shoot_outputs_schema, shoot_canonicalise, shoot_run, shoot_seconds},
    {"transport", "Parallel transport of a vector",
     "A vector at one surface carried to another, and the surface that it leads to from there.",
     transport_inputs_schema, transport_outputs_schema, transport_canonicalise, transport_run,
     transport_seconds},
    {"transfer", "Transfer of a deformation",
     "A surface deformed as another one was, its size included.", transfer_inputs_schema,
     transfer_outputs_schema, transfer_canonicalise, transfer_run, transfer_seconds},
    {"classify", "Classification of a labelled cohort",
     "Each member classified by those of other subjects, by one method or several; how often "
     "that is right, and how often by chance.",
     classify_inputs_schema, classify_outputs_schema, classify_canonicalise, classify_run,
     classify_seconds},
    {NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL},
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
