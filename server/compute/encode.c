/*
 * encode.c - encodes a stored mesh, or finds that it was done before.
 *
 * An encoding is kept for the jobs that need it later (store/encoding.h), whatever process they are
 * of, as long as owner, build and all options are the same: its name covers them, so that nobody
 * learns from a fast answer what others have. Otherwise it is made from the mesh as that was
 * prepared at its upload (compute/prepared.c). What is repaired in a mesh is repaired
 * in its sphere too, so that the two still correspond. Every encoding is judged, whoever
 * wants it (core/surface/judge.c): one that has become another shape fails the job, a poor one
 * becomes a doubt of the run, which its results tell (process_finish), or of the caller.
 */
#include "compute/encode.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "compute/compute.h"
#include "compute/prepared.h"
#include "store/digest.h"
#include "store/encoding.h"
#include "tasks/tasks.h"

/* Is the surface still the mesh? If not the job fails; if just about, there is a doubt. */
static int judge(const struct compute_encode_inputs *inputs,
                 const struct compute_prepared *prepared, const struct srnf_encoded *encoded,
                 struct compute_doubt *doubt, struct jobs_result *result)
{
    const struct srnf_mesh_report *report = &prepared->report;
    const struct srnf_judgement *j = &doubt->doubt.judgement;

    *doubt = (struct compute_doubt){.doubt = {.degree = encoded->degree,
                                              .coarseness = report->coarseness,
                                              .untransformed = prepared->untransformed}};
    (void)snprintf(doubt->doubt.mesh, sizeof doubt->doubt.mesh, "%s", inputs->mesh);
    switch (srnf_encode_judge(encoded, report, inputs->options.smoothing > 0.0,
                              &doubt->doubt.judgement)) {
    case SRNF_FAITHFUL:
        doubt->any = report->coarseness >= JOBS_COARSE || prepared->untransformed;
        return 0;
    case SRNF_POOR:
        doubt->any = true;
        return 0;
    case SRNF_UNFAITHFUL:
        break;
    }
    result->problem_code = "encoding-unfaithful";
    (void)snprintf(result->problem_detail, sizeof result->problem_detail,
                   "%s: the surface of degree %zu by the route %s is another shape than the mesh: "
                   "%.3g %% of the diagonal apart (root mean square), %.3g times its volume, %.3g "
                   "times its area, map energy %.3g (4 is least). Try a higher degree, another "
                   "parameterization, or the mesh remeshed.",
                   inputs->mesh, encoded->degree, srnf_parameterization_name(encoded->route),
                   100.0 * j->fit, j->volume, j->area, j->energy);
    return SRNF_ENUMERIC;
}

struct srnf_encode_options compute_encode_options(const struct compute_encode_inputs *inputs)
{
    struct srnf_encode_options options = inputs->options;

    options.sphere = NULL;
    options.kernel = NULL;
    if (inputs->mirror) {
        options.center[0] = 0.0 - options.center[0];
    }
    return options;
}

/* Encodes the mesh, or takes what a worker has made of it. */
static int encode_prepared(const struct compute_encode_inputs *inputs,
                           const struct compute_prepared *prepared,
                           const struct srnf_context *context, struct srnf_encoded *encoded,
                           struct srnf_error *error)
{
    struct srnf_encode_options options = compute_encode_options(inputs);
    struct tasks_encoded *ahead = inputs->ahead;

    if (ahead && (ahead->status || ahead->encoded.coefficients)) {
        *error = ahead->error;
        if (ahead->status == 0) {
            *encoded = ahead->encoded;
            ahead->encoded.coefficients = NULL;
        }
        return ahead->status;
    }
    options.sphere = inputs->sphere[0] ? &prepared->sphere : NULL;
    options.kernel = prepared->kernel_known ? &prepared->kernel : NULL;
    return srnf_encode(&prepared->mesh, &prepared->report, &options, context, encoded, error);
}

/* Reads and encodes the mesh. */
static int make(struct jobs_run *run, const struct srnf_context *context,
                const struct compute_encode_inputs *inputs, struct srnf_encoded *encoded,
                struct compute_doubt *doubt, struct jobs_result *result)
{
    struct compute_prepared prepared;
    struct srnf_error error = {0};
    int status =
        compute_prepared_load(run, inputs->mesh, inputs->sphere, inputs->mirror, &prepared, result);

    if (status == 0) {
        status = encode_prepared(inputs, &prepared, context, encoded, &error);
        status = status < 0 ? compute_fail(result, status, &error, inputs->mesh) : 0;
        if (status == 0) {
            status = judge(inputs, &prepared, encoded, doubt, result);
            if (status) {
                srnf_free(encoded->coefficients);
                *encoded = (struct srnf_encoded){0};
            }
        }
    }
    if (status == 0 && inputs->mirror) {
        encoded->origin[0] = 0.0 - encoded->origin[0];
        encoded->star.center[0] = 0.0 - encoded->star.center[0];
    }
    compute_prepared_clear(&prepared);
    return status;
}

/* ---- Kept encodings: this struct, of the same build, and the coefficients after it ----------- */

struct kept {
    struct srnf_encoded encoded; /* without its coefficients */
    struct compute_doubt doubt;
};

/* All that decides the encoding, as 64 hex digits; "" where none is kept, or without memory. */
static void name_kept(const struct jobs_run *run, const struct compute_encode_inputs *inputs,
                      char name[65])
{
    const struct srnf_encode_options *o = &inputs->options;
    char *text = NULL;
    int length = -1;

    name[0] = '\0';
    if (jobs_run_encodings_limit(run) > 0) {
        length = asprintf(&text, "%s\n%s\n%s\n%s %d %zu %d %d %a %a %a %d %a", jobs_run_owner(run),
                          jobs_run_numeric_build(run), inputs->mesh, inputs->sphere, inputs->mirror,
                          o->degree, (int)o->parameterization, o->center_given, o->center[0],
                          o->center[1], o->center[2], o->unit_area, o->smoothing);
    }
    if (length >= 0) {
        store_sha256_hex(name, text, (size_t)length);
        free(text);
    }
}

static size_t coefficient_bytes(size_t degree)
{
    return 3 * srnf_coefficient_count(degree) * sizeof(double);
}

static bool recall(struct jobs_run *run, const struct compute_encode_inputs *inputs,
                   const char *name, struct srnf_encoded *encoded, struct compute_doubt *doubt)
{
    size_t bytes = coefficient_bytes(inputs->options.degree), size = 0;
    unsigned char *value = NULL;
    struct kept kept;
    bool found = name[0] &&
                 store_encoding_get(jobs_run_store(run), name, &value, &size) == STORE_OK &&
                 size == sizeof kept + bytes;

    if (found) {
        memcpy(&kept, value, sizeof kept);
        kept.encoded.coefficients = NULL;
        if (kept.encoded.degree == inputs->options.degree) {
            kept.encoded.coefficients = srnf_alloc(bytes, 1);
        }
        found = kept.encoded.coefficients != NULL;
    }
    if (found) {
        memcpy(kept.encoded.coefficients, value + sizeof kept, bytes);
        *encoded = kept.encoded;
        *doubt = kept.doubt;
    }
    free(value);
    jobs_run_count_encoding(run, found);
    return found;
}

static void keep(struct jobs_run *run, const struct compute_encode_inputs *inputs, const char *name,
                 const struct srnf_encoded *encoded, const struct compute_doubt *doubt)
{
    size_t bytes = coefficient_bytes(encoded->degree);
    unsigned char *value = name[0] ? calloc(1, sizeof(struct kept) + bytes) : NULL;
    struct kept kept = {.encoded = *encoded, .doubt = *doubt};

    if (value) {
        kept.encoded.coefficients = NULL;
        memcpy(value, &kept, sizeof kept);
        memcpy(value + sizeof kept, encoded->coefficients, bytes);
        (void)store_encoding_put(jobs_run_store(run), name, inputs->mesh, inputs->sphere, value,
                                 sizeof kept + bytes, jobs_run_encodings_limit(run));
        free(value);
    }
}

bool compute_encode_is_kept(struct jobs_run *run, const struct compute_encode_inputs *inputs)
{
    unsigned char *value = NULL;
    size_t size = 0;
    char name[65];
    bool found;

    name_kept(run, inputs, name);
    found = name[0] && store_encoding_get(jobs_run_store(run), name, &value, &size) == STORE_OK;
    free(value);
    return found;
}

int compute_encode(struct jobs_run *run, const struct srnf_context *context,
                   const struct compute_encode_inputs *inputs, struct srnf_encoded *encoded,
                   struct jobs_result *result)
{
    struct compute_doubt doubt = {.any = false};
    char name[65];
    int status = 0;

    name_kept(run, inputs, name);
    if (!recall(run, inputs, name, encoded, &doubt)) {
        status = make(run, context, inputs, encoded, &doubt, result);
        if (status == 0) {
            keep(run, inputs, name, encoded, &doubt);
        }
    }
    if (status || !doubt.any) {
        return status;
    }
    if (inputs->aside) {
        *inputs->aside = doubt;
    } else if (!jobs_run_doubt(run, &doubt.doubt)) {
        srnf_free(encoded->coefficients);
        *encoded = (struct srnf_encoded){0};
        return compute_fail(result, SRNF_ENOMEM, NULL, "noting a doubt");
    }
    return 0;
}
