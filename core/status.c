/*
 * status.c - the sentences behind enum srnf_status and the filling of struct srnf_error.
 */
#include "internal.h"

#include <stdarg.h>
#include <stdio.h>

static const struct {
    int status;
    const char *text;
} sentences[] = {
    {SRNF_OK, "success"},
    {SRNF_ENOMEM, "not enough memory"},
    {SRNF_EINVAL, "an argument is outside its range"},
    {SRNF_ELIMIT, "the input exceeds a limit"},
    {SRNF_ECANCELED, "canceled"},
    {SRNF_EFORMAT, "the bytes are in no known mesh format"},
    {SRNF_EPARSE, "the bytes break the rules of their format"},
    {SRNF_ENOT_CLOSED, "the mesh has a boundary"},
    {SRNF_ENOT_MANIFOLD, "the mesh is not a manifold"},
    {SRNF_ENOT_ORIENTED, "the faces are not consistently oriented"},
    {SRNF_ECOMPONENTS, "the mesh has more than one component"},
    {SRNF_EGENUS, "the mesh is not of genus zero"},
    {SRNF_EDEGENERATE, "the mesh is degenerate"},
    {SRNF_ENOT_STAR, "the surface is not star-shaped"},
    {SRNF_ENUMERIC, "a numerical step broke down"},
    {SRNF_EUNMATCHED, "the landmarks were not met by any warp that keeps orientation"},
    {SRNF_EIO, "scratch could not be written or read"},
    {SRNF_WNOT_CONVERGED, "stopped before the tolerance was reached"},
};

const char *srnf_strerror(int status)
{
    for (size_t i = 0; i < sizeof sentences / sizeof sentences[0]; i++) {
        if (sentences[i].status == status) {
            return sentences[i].text;
        }
    }
    return "unknown status";
}

int srnf_fail(struct srnf_error *error, int status, int64_t element, const char *format, ...)
{
    if (error) {
        va_list arguments;

        error->status = status;
        error->element = element;
        va_start(arguments, format);
        (void)vsnprintf(error->message, sizeof error->message, format, arguments);
        va_end(arguments);
    }
    return status;
}
