/*
 * search_create.c - what a search in one direction is prepared with: the grid of the full problem,
 * the template's field on it and by its harmonics, the moving surface and its tables.
 */
#include "tournament.h"

#include "harmonics/harmonics.h"

#include <string.h>

/* Target from a field [3][n] of a grid; memory: 7 n doubles. */
static void place(struct target *target, const struct srnf_grid *grid, const double *field,
                  double *memory)
{
    size_t n = grid->n_theta * grid->n_phi;
    double *q = memory + 4 * n;
    double norm2 = 0.0;

    registration_nodes(grid, memory, memory + 3 * n);
    for (size_t i = 0; i < n; i++) {
        for (size_t c = 0; c < 3; c++) {
            q[3 * i + c] = field[c * n + i];
            norm2 += memory[3 * n + i] * q[3 * i + c] * q[3 * i + c];
        }
    }
    *target =
        (struct target){.n = n, .points = memory, .weight = memory + 3 * n, .q = q, .norm2 = norm2};
}

/* The harmonics of q1 that its degree has. */
static int template_series(struct search *s, const double *q1)
{
    size_t count = srnf_coefficient_count(srnf_sht_degree(s->sht));
    void *workspace = srnf_alloc(1, srnf_sht_workspace_size(s->sht, 3));

    s->template_series = srnf_alloc(3 * count, sizeof(double));
    if (workspace && s->template_series) {
        srnf_sht_analysis(s->sht, 3, q1, s->template_series, workspace);
    }
    srnf_free(workspace);
    return workspace && s->template_series ? SRNF_OK : SRNF_ENOMEM;
}

/* q1 on a finer grid of the same kind: from the surface itself, or by the harmonics of q1 that its
   grid resolves. */
static int fine_field(const struct search *s, const struct srnf_sht *sht, const double *q1,
                      const double *template_surface, const struct nodes_of *nodes,
                      struct srnf_sht **fine, double *out)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t degree = template_surface ? srnf_sht_degree(sht) : grid->n_theta - 1;
    struct srnf_sht *own = NULL;
    double *c = srnf_alloc(3 * srnf_coefficient_count(degree), sizeof(double));
    void *workspace = NULL;
    int status = tools_transform(s->tools, degree, nodes, fine);

    if (status == SRNF_OK && !template_surface) {
        const struct nodes_of given = {grid->kind, grid->n_theta, grid->n_phi};

        status = tools_transform(s->tools, degree, &given, &own);
    }
    if (status == SRNF_OK) {
        workspace =
            srnf_alloc(1, srnf_surface_workspace_size(*fine) + srnf_sht_workspace_size(*fine, 3) +
                              (own ? srnf_sht_workspace_size(own, 3) : 0));
    }
    if (!c || !workspace) {
        status = status ? status : SRNF_ENOMEM;
    } else if (template_surface) {
        field_represent(*fine, s->options->representation, template_surface, out, workspace);
    } else {
        srnf_sht_analysis(own, 3, q1, c, workspace);
        srnf_sht_synthesis(*fine, 3, c, out, workspace);
    }
    srnf_free(workspace);
    srnf_free(c);
    tools_return_transform(s->tools, own);
    return status;
}

/* The grid of the full problem. On too coarse a one fields of the given degree fit the nodes and
   fold between them; in exact mode the template's own grid is the one on which q1 is exact. */
static int full_target(struct search *s, const struct srnf_sht *sht, const double *q1,
                       const double *template_surface)
{
    const struct srnf_grid *grid = srnf_sht_grid(sht);
    size_t rows = registration_rows(s->options->degree);
    struct srnf_sht *fine = NULL;
    double *field = NULL;
    int status = SRNF_OK;

    if (s->options->exact || grid->n_theta >= rows) {
        s->full_memory = srnf_alloc(7 * grid->n_theta * grid->n_phi, sizeof(double));
        if (!s->full_memory) {
            return SRNF_ENOMEM;
        }
        place(&s->full.target, grid, q1, s->full_memory);
        s->nodes = (struct nodes_of){grid->kind, grid->n_theta, grid->n_phi};
        return SRNF_OK;
    }
    field = srnf_alloc(6 * rows * rows, sizeof(double));
    s->full_memory = srnf_alloc(14 * rows * rows, sizeof(double));
    s->nodes = (struct nodes_of){SRNF_GRID_GAUSS_LEGENDRE, rows, 2 * rows};
    status = field && s->full_memory
                 ? fine_field(s, sht, q1, template_surface, &s->nodes, &fine, field)
                 : SRNF_ENOMEM;
    if (status == SRNF_OK) {
        place(&s->full.target, srnf_sht_grid(fine), field, s->full_memory);
    }
    srnf_free(field);
    tools_return_transform(s->tools, fine);
    return status;
}

/* Tables of the moving surface, where none are at hand and the search reads any. */
static int own_subject(struct search *s, const double *moving)
{
    int status = SRNF_OK;

    if (!s->subject) {
        status = registration_subject(s->sht, moving, s->options, s->tools, s->context, &s->own);
        s->subject = s->own;
    }
    return status;
}

int search_create(struct search *s, const struct srnf_sht *sht, const double *q1,
                  const double *template_surface, const double *moving,
                  const struct srnf_register_options *options, const struct subject *subject,
                  struct tabulated_tools *tools, const struct srnf_context *context)
{
    size_t degree = srnf_sht_degree(sht);
    int status;

    *s = (struct search){.options = options,
                         .context = context,
                         .sht = sht,
                         .subject = subject,
                         .tools = tools,
                         .rounds = options->degree > BASIN_DEGREE ? 1 : 0,
                         .has_template = options->exact && template_surface};
    status = full_target(s, sht, q1, template_surface);
    if (status == SRNF_OK) {
        status = template_series(s, q1);
    }
    if (status == SRNF_OK) {
        status = moving_create(&s->moving_full, degree, moving, degree, context);
    }
    if (status == SRNF_OK && s->has_template) {
        status = moving_create(&s->moving_template, degree, template_surface, degree, context);
    }
    if (status == SRNF_OK) {
        status = own_subject(s, moving);
    }
    if (status) {
        search_clear(s);
        return status;
    }
    s->moving_full.representation = options->representation;
    s->moving_template.representation = options->representation;
    s->full.moving = &s->moving_full;
    s->full.free_rotation = options->rotation && !options->common_pose;
    if (!options->exact) {
        s->full.penalty.jacobian = options->penalty_jacobian;
        s->full.penalty.displacement = options->penalty_displacement;
    }
    return SRNF_OK;
}

void search_clear(struct search *s)
{
    registration_subject_destroy(s->own);
    s->own = NULL;
    srnf_free(s->template_series);
    srnf_free(s->full_memory);
    moving_clear(&s->moving_full);
    moving_clear(&s->moving_template);
    s->template_series = s->full_memory = NULL;
}

size_t search_screen(const struct search *s, size_t capacity, struct start_rotation *starts,
                     int *status)
{
    double first[3 * SCREEN_COUNT];

    search_cut_series(srnf_sht_degree(s->sht), s->template_series, first);
    return registration_screen(first, s->subject->screen, capacity, starts, status);
}

int search_coarsen(const struct search *s, size_t rows, size_t degree, double **memory,
                   struct target *target)
{
    size_t full = srnf_coefficient_count(srnf_sht_degree(s->sht));
    size_t count = srnf_coefficient_count(degree);
    size_t n = 2 * rows * rows;
    const struct nodes_of nodes = {SRNF_GRID_GAUSS_LEGENDRE, rows, 2 * rows};
    struct srnf_sht *sht = NULL;
    double *field = srnf_alloc(3 * n + 3 * count, sizeof(double));
    void *workspace = NULL;
    int status = tools_transform(s->tools, degree, &nodes, &sht);

    *memory = srnf_alloc(7 * n, sizeof(double));
    workspace = status ? NULL : srnf_alloc(1, srnf_sht_workspace_size(sht, 3));
    if (*memory && field && workspace) {
        for (size_t c = 0; c < 3; c++) {
            memcpy(field + 3 * n + c * count, s->template_series + c * full,
                   count * sizeof(double));
        }
        srnf_sht_synthesis(sht, 3, field + 3 * n, field, workspace);
        place(target, srnf_sht_grid(sht), field, *memory);
    } else {
        status = status ? status : SRNF_ENOMEM;
    }
    srnf_free(field);
    srnf_free(workspace);
    tools_return_transform(s->tools, sht);
    return status;
}
