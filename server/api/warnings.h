/*
 * warnings.h - reasons to doubt a number of a result: entries of the member "warnings" of result
 * documents and surface records.
 *
 * A warning is for what is an answer all the same; what is none is a failed job. Clients decide by
 * code, people read the detail, and the figures are those that the sentence quotes.
 */
#ifndef SRNFD_API_WARNINGS_H
#define SRNFD_API_WARNINGS_H

#include <jansson.h>
#include <stdbool.h>

/*
 * Appends {"code", "detail", "figures"}.
 *   warnings  [in/out] an array; NULL, as after a lack of memory, is left alone
 *   code      [in] one of the table in warnings.c
 *   figures   [in] an object, taken over, or NULL: the entry then has no such member
 *   format    [in] a sentence, and what to do about it
 */
void warning_add(json_t *warnings, const char *code, json_t *figures, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* Appends those of `from` (borrowed, may be NULL) whose like is not there yet. */
void warnings_merge(json_t *warnings, const json_t *from);
/* The same into the member "warnings" of a document, which is made where it is missing; `from` is
   taken over. */
void warnings_put(json_t *document, json_t *from);
/* coordinates-coarse, of a mesh by its id, or of the mesh that is spoken of where that is NULL. */
void warning_coarse(json_t *warnings, const char *mesh, double coarseness);
/* transform-not-applied, of `count` meshes of which this is the first, or of the mesh that is
   spoken of where that is NULL. */
void warning_untransformed(json_t *warnings, const char *mesh, size_t count);

/*
 * What a surface encloses, by its isoperimetric quotient 36 pi V^2 / A^3: 1 for the sphere, below 1
 * for all others, however often they wind around. Below SHAPE_FLAT the volume is nothing: a disc
 * would have 1/200 of its radius as thickness, or a needle 20,000 times its own as length; cortices
 * have about 5e-3. Otherwise the sign of the volume says where the normals point.
 */
#define SHAPE_FLAT 1e-4
enum warning_shape { SHAPE_SOUND, SHAPE_FLAT_SURFACE, SHAPE_INSIDE_OUT, SHAPES };
enum warning_shape warning_shape_of(double area, double volume);
/* surface-flat or surface-inside-out, or nothing.
     surface  [in] id, or NULL for the surface that is spoken of
     count    [in] so many of those that are compared, this one the first */
void warning_shape(json_t *warnings, const char *surface, size_t count, double area, double volume);
/* The array "warnings" of a result document, borrowed; made where there is none. */
json_t *warnings_of(json_t *document);

#endif
