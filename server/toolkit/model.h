/*
 * model.h - what processes on a model share.
 */
#ifndef SRNFD_TOOLKIT_MODEL_H
#define SRNFD_TOOLKIT_MODEL_H

#include "toolkit/process.h"
#include "compute/model.h"

#define MODEL_NAME_MAX 64 /* bytes of a surface's name */

/* The kinds of models of principal components, of one structure or of several. */
#define MODEL_OF_ANY_PARTS "components or parts"
/* The input that names the model, in a process's table: its member of the typed inputs. */
#define MODEL_INPUT(typed)                                                 \
    {                                                                      \
        "model", INPUT_MODEL, offsetof(struct typed, model), "The model.", \
            .required = true, .model_kind = MODEL_OF_ANY_PARTS             \
    }
/* The surfaces of a result, as struct model_shapes has them. */
#define MODEL_SURFACES                                                                            \
    {"surfaces", OUTPUT_OBJECTS,                                                                  \
     "Records; the deformation from the mean rides along in their meshes. Of a model of several " \
     "structures all of the first part, then all of the second, and so on."},                     \
    {                                                                                             \
        "parts", "\"type\":[\"array\",\"null\"],\"items\":{" OUTPUT_STRING "}",                   \
            "The part that each surface is; null of a model of one structure."                    \
    }

/* compute_model_load, with what the model's record tells of its parts. */
int model_load(struct jobs_run *run, const char *id, struct compute_model *model,
               struct jobs_result *result);

/* The degree at which meshes beside the model are encoded, as its members were: that of the model,
   or, where there are meshes among them, 0: the default one, and cut. made: model_made_from */
size_t model_mesh_degree(const struct store_model *model, const json_t *made);

/* The components of the model that the canonical inputs name; 0 where it is gone. */
long model_components(struct process_inputs *inputs);

/* Surfaces at points of a model, of each part. */
struct model_shapes {
    json_t *surfaces; /* records, part after part */
    json_t *parts;    /* their names, or null */
    json_t *energies; /* relativeEnergy of each */
};
/*
 * Inverts n points and stores the surfaces.
 *   scores, before  [in]  as for compute_reconstruct
 *   names           [in]  [n]; that of the part comes behind
 *   shapes          [out] cleared by model_shapes_clear in any case
 * False with the problem set.
 */
bool model_shapes_make(struct jobs_run *run, const char *process, const struct compute_model *model,
                       size_t n, const double *scores, const size_t *before,
                       const char (*names)[MODEL_NAME_MAX], struct model_shapes *shapes,
                       struct jobs_result *result);
void model_shapes_clear(struct model_shapes *shapes);

#endif
