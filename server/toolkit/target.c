/*
 * target.c - an SRNF as an input (values on a grid are read by field.c), and on its grid.
 */
#include "toolkit/target.h"

#include <stdio.h>
#include <string.h>

/* ---- The input ------------------------------------------------------------------------------- */

/* A q on a grid must resolve the degree asked for. */
static void check_grid(struct process_inputs *inputs)
{
    const json_t *srnf = json_object_get(inputs->canonical, "srnf");
    long lmax = (long)json_integer_value(json_object_get(inputs->canonical, "lmax"));
    json_int_t rows = json_integer_value(json_object_get(srnf, "nTheta"));
    json_int_t columns = json_integer_value(json_object_get(srnf, "nPhi"));

    if (rows && columns && (rows < lmax + 1 || columns < 2 * lmax + 1)) {
        problem_add(inputs->list, "/inputs/lmax",
                    "is %ld, but a grid of %lld x %lld resolves degree %lld at most", lmax,
                    (long long)rows, (long long)columns,
                    (long long)(rows - 1 < (columns - 1) / 2 ? rows - 1 : (columns - 1) / 2));
    }
}

/* Whether an object has any of the members that a field has. */
static bool is_field(const json_t *object)
{
    return json_object_get(object, "lmax") || json_object_get(object, "nTheta") ||
           json_object_get(object, "nPhi") || json_object_get(object, "q");
}

/* In either form. The degree of what it is of is the default of lmax. */
static void read_target(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *srnf = json_object_get(inputs->given, input->name);
    const json_t *surface = json_object_get(srnf, "surface");
    long degree = PROCESS_DEGREE_DEFAULT;
    const char *id;

    if (!surface && !is_field(srnf)) {
        problem_add(inputs->list, "/inputs/srnf",
                    "%s {\"surface\": id} or {\"lmax\", \"nTheta\", \"nPhi\", \"q\"}",
                    srnf ? "must be" : "is required:");
    } else if (!surface) {
        (void)json_object_set_new(inputs->canonical, input->name,
                                  inputs_field(inputs, srnf, "/inputs/srnf", &degree));
    } else if (json_object_size(srnf) != 1) {
        problem_add(inputs->list, "/inputs/srnf",
                    "has either surface, or lmax, nTheta, nPhi and q, and nothing else");
    } else {
        id = inputs_surface_at(inputs, surface, "/inputs/srnf/surface", &degree);
        if (id) {
            (void)json_object_set_new(inputs->canonical, input->name,
                                      json_pack("{s:s}", "surface", id));
        }
    }
    if (!json_object_get(inputs->given, "lmax")) {
        (void)json_object_set_new(inputs->canonical, "lmax", json_integer(degree));
    }
    check_grid(inputs);
}

static bool type_target(const json_t *value, void *member)
{
    const char *surface = json_string_value(json_object_get(value, "surface"));
    const json_t *q = json_object_get(value, "q");
    struct target *target = member;
    size_t nodes;

    if (surface) {
        (void)snprintf(target->surface, sizeof target->surface, "%s", surface);
        return true;
    }
    target->n_theta = (size_t)json_integer_value(json_object_get(value, "nTheta"));
    target->n_phi = (size_t)json_integer_value(json_object_get(value, "nPhi"));
    nodes = target->n_theta * target->n_phi;
    target->q = srnf_alloc(nodes, 3 * sizeof(double));
    for (size_t i = 0; target->q && i < 3 * nodes; i++) {
        target->q[i % 3 * nodes + i / 3] = json_number_value(json_array_get(q, i));
    }
    return target->q != NULL;
}

static void clear_target(void *member)
{
    srnf_free(((struct target *)member)->q);
}

#define RANGE(lowest, highest) \
    "{\"type\":\"integer\",\"minimum\":" lowest ",\"maximum\":" PROCESS_TEXT(highest) "}"
#define DEGREES RANGE(PROCESS_TEXT(SRNF_DEGREE_MIN), SRNF_DEGREE_MAX)
#define ROWS RANGE("5", PROCESS_ROWS_MAX)
#define COLUMNS RANGE("9", PROCESS_COLUMNS_MAX)
const struct input_own target_input = {
    .schema = "\"oneOf\":[{\"type\":\"object\",\"required\":[\"surface\"],"
              "\"additionalProperties\":false,\"properties\":{\"surface\":{\"type\":\"string\","
              "\"pattern\":\"" PROCESS_SURFACE_PATTERN "\"}}},{\"type\":\"object\","
              "\"required\":[\"lmax\",\"nTheta\",\"nPhi\",\"q\"],\"additionalProperties\":false,"
              "\"properties\":{\"lmax\":" DEGREES ",\"nTheta\":" ROWS ",\"nPhi\":" COLUMNS
              ",\"q\":{\"type\":\"array\",\"description\":\"[nTheta][nPhi][3], nested or flat.\","
              "\"items\":{\"oneOf\":[{\"type\":\"number\"},{\"type\":\"array\",\"items\":"
              "{\"type\":\"array\",\"items\":{\"type\":\"number\"}}}]}}}}]",
    .read = read_target,
    .type = type_target,
    .clear = clear_target,
    .echo = field_by_digest,
    .refers = true,
};

/* ---- On its grid ----------------------------------------------------------------------------- */

static int sample(struct jobs_run *run, size_t degree, struct sampled *sampled,
                  struct jobs_result *result)
{
    const struct compute_surface *truth = &sampled->truth;
    struct jobs *jobs = jobs_run_jobs(run);
    size_t rows = srnf_working_rows(truth->degree > degree ? truth->degree : degree);
    int status = jobs_transform_acquire(jobs, truth->degree, SRNF_GRID_GAUSS_LEGENDRE, rows,
                                        2 * rows, &sampled->forward);

    if (status == 0) {
        status = jobs_transform_acquire(jobs, degree, SRNF_GRID_GAUSS_LEGENDRE, rows, 2 * rows,
                                        &sampled->sht);
    }
    if (status) {
        return compute_fail(result, status, NULL, "preparing the harmonic transform");
    }
    sampled->own = srnf_alloc(3 * rows * 2 * rows, sizeof(double));
    sampled->workspace = srnf_alloc(srnf_surface_workspace_size(sampled->forward), 1);
    if (!sampled->own || !sampled->workspace) {
        return compute_fail(result, SRNF_ENOMEM, NULL, "sampling the SRNF");
    }
    srnf_field(sampled->forward, truth->coefficients, sampled->own, sampled->workspace);
    sampled->q = sampled->own;
    return 0;
}

int target_open(struct jobs_run *run, const struct target *target, size_t degree,
                enum srnf_parameterization route, double share, struct sampled *sampled,
                struct jobs_result *result)
{
    int status;

    *sampled = (struct sampled){.q = target->q};
    if (target->surface[0]) {
        status =
            compute_surface_load_by(run, target->surface, route, share, &sampled->truth, result);
        return status ? status : sample(run, degree, sampled, result);
    }
    status = jobs_transform_acquire(jobs_run_jobs(run), degree, SRNF_GRID_GAUSS_LEGENDRE,
                                    target->n_theta, target->n_phi, &sampled->sht);
    return status ? compute_fail(result, status, NULL, "preparing the harmonic transform") : 0;
}

void target_close(struct jobs_run *run, struct sampled *sampled)
{
    compute_surface_clear(&sampled->truth);
    srnf_free(sampled->workspace);
    srnf_free(sampled->own);
    if (sampled->forward) {
        jobs_transform_release(jobs_run_jobs(run), sampled->forward);
    }
    if (sampled->sht) {
        jobs_transform_release(jobs_run_jobs(run), sampled->sht);
    }
}
