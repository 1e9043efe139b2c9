/*
 * registration_report.h - what the results tell of a registration: its figures, in the same words
 * in every process that registers a pair, and the warnings that they give rise to.
 */
#ifndef SRNFD_TOOLKIT_REGISTRATION_REPORT_H
#define SRNFD_TOOLKIT_REGISTRATION_REPORT_H

#include "toolkit/table.h"

/* Output: what registration_bridged sets. */
#define BRIDGED_OUTPUT                                                                           \
    {                                                                                            \
        "bridged", OUTPUT_BOOLEAN,                                                               \
            "Whether the surfaces came by different routes from meshes that are known and were " \
            "registered through the encodings of those by area."                                 \
    }
/* What registration_figures gives, after "As" or "Each as", in the text of an output. */
#define REGISTRATION_FIGURES_TEXT                                                                \
    " register tells of it: distance, distanceBefore, objective, minJacobian, maxJacobian, "     \
    "truncationError, ambiguity, inverseConsistency, iterations, converged, stopped, symmetric " \
    "(true), note, and its options; null where nothing was registered."

/* The registered surface is off its SRNF by more than this part of the distance, and by more than
   this part of the norm: the bounds of the warning registration-truncated. */
#define REGISTRATION_TRUNCATED_RATIO 0.5
#define REGISTRATION_TRUNCATED_LEAST 0.02
/* Areas stretched or shrunk by this factor: registration-distorted. */
#define REGISTRATION_DISTORTED_FACTOR 10.0
/* Another basin within this factor of the objective, or a curvature over rotations below this:
   registration-ambiguous. */
#define REGISTRATION_AMBIGUOUS_FACTOR 1.05
#define REGISTRATION_AMBIGUOUS_CURVATURE 0.02

/* distance, distanceBefore, objective, minJacobian, maxJacobian, truncationError, ambiguity,
   inverseConsistency, iterations, converged, stopped, symmetric, note. options: as it was run. */
json_t *registration_figures(const struct srnf_registration *registration,
                             const struct srnf_register_options *options);
/* Puts bridged into a document; where it is true, the note of the figures (which may be the same
   document, or null) says that meshes led from one route to the other, and what was searched. */
void registration_bridged(json_t *document, json_t *figures, bool bridged);
/*
 * Appends to the member "warnings" of a document what there is to say against a registration.
 *   what  [in] which one it was, for the sentence: "to onto from"
 */
void registration_warn(json_t *document, const struct srnf_registration *registration,
                       const char *what);

#endif
