/*
 * tabulated_pull.c - chains of warps followed by tables, and a surface pulled back along one.
 *
 * gamma <- exp(w) o gamma moves points in the domain of the moving surface f. To move them in that
 * of the template, gamma <- gamma o exp(v), f o gamma is tabulated as a surface of its own, and
 * exp(v) is a left step of it. Its normal is J n(gamma). What it was pulled back by is tabulated as
 * g = sqrt(J) gamma, which a warp delta acts on as on a square-root field, (g, delta) = sqrt(J of
 * both) gamma o delta: all that the penalties of gamma o delta need.
 *
 * Steps of one kind alone lower the objective ever more slowly: where gamma compresses or
 * stretches, fields of a low degree fit only one of the two domains.
 */
#include "tabulated.h"

#include <math.h>
#include <string.h>

#define ROWS_MIN ((size_t)16)
#define PULL_ORDER ((size_t)6)
#define PULL_ROWS ((size_t)52)     /* at least: of fields of degree 12 */
#define PULL_ROWS_MAX ((size_t)64) /* steps of such fields see no more of a finer surface */

const struct field_table follow_table = {8, 4.4};
static const struct field_table pull_table = {6, 3.5};

size_t field_table_rows(const struct field_table *table, size_t degree)
{
    size_t rows = ((size_t)ceil(table->fineness * (double)degree) + 3) / 4 * 4;

    return rows < ROWS_MIN ? ROWS_MIN : rows;
}

int cloud_follow(struct cloud *cloud, const struct srnf_warp *chain,
                 const struct field_table *table, struct tabulated_tools *tools,
                 const struct srnf_context *context)
{
    struct tabulated_fields fields = {0};
    int status = SRNF_OK;

    for (size_t k = 0; k < chain->n_links && status == SRNF_OK; k++) {
        const struct srnf_warp_link *link = &chain->links[k];

        if (link->kind == SRNF_WARP_ROTATION) {
            cloud_turn(cloud, link->values);
            continue;
        }
        if (fields.degree != link->degree) {
            tools_return_fields(tools, &fields);
            status = tools_fields(tools, link->degree, table->order,
                                  field_table_rows(table, link->degree), &fields);
        }
        if (status == SRNF_OK) {
            tabulated_fields_fill(&fields, link->values);
            (void)cloud_move(&fields.table, cloud, cloud);
            status = srnf_is_canceled(context) ? SRNF_ECANCELED : SRNF_OK;
        }
    }
    tools_return_fields(tools, &fields);
    return status;
}

/* ---- The nodes of a table -------------------------------------------------------------------- */

static int open_nodes(struct cloud *cloud, size_t rows)
{
    int status = cloud_create(cloud, (rows + 1) * 2 * rows);

    if (status) {
        return status;
    }
    for (size_t k = 0; k < 2 * rows; k++) { /* on the first row cosine and sine of phi */
        double phi = SRNF_PI * (double)k / (double)rows;

        cloud->point[0][k] = cos(phi);
        cloud->point[1][k] = sin(phi);
    }
    for (size_t row = rows + 1; row-- > 0;) {
        double theta = SRNF_PI * (double)row / (double)rows;
        double c = cos(theta);
        double s = sin(theta);

        for (size_t k = 0; k < 2 * rows; k++) {
            size_t i = row * 2 * rows + k;

            cloud->point[0][i] = s * cloud->point[0][k];
            cloud->point[1][i] = s * cloud->point[1][k];
            cloud->point[2][i] = c;
            cloud->jacobian[i] = 1.0;
        }
    }
    return SRNF_OK;
}

enum node_value {
    NODE_FIELD,   /* x with q = x / sqrt|x| */
    NODE_NORMAL,  /* the same, times J */
    NODE_CARRIED, /* sqrt(J) gamma */
};

static int fill(struct sphere_spline *s, size_t rows, const struct cloud *cloud,
                enum node_value value)
{
    int status = sphere_spline_create(s, PULL_ORDER, rows);

    for (size_t i = 0; i < cloud->n && status == SRNF_OK; i++) {
        double *const *from = value == NODE_CARRIED ? cloud->point : cloud->q;
        const double x[3] = {from[0][i], from[1][i], from[2][i]};
        double *node = sphere_spline_node(s, i / s->columns, i % s->columns);
        double scale = value == NODE_CARRIED  ? sqrt(cloud->jacobian[i])
                       : value == NODE_NORMAL ? sqrt(vector_dot(x, x)) * cloud->jacobian[i]
                                              : sqrt(vector_dot(x, x));

        for (size_t c = 0; c < 3; c++) {
            node[c] = scale * x[c];
        }
        node[3] = 0.0;
    }
    if (status == SRNF_OK) {
        sphere_spline_filter(s);
    }
    return status;
}

int tabulated_moving_pull(struct tabulated_moving *m, const struct tabulated_moving *from,
                          const struct srnf_warp *chain, struct tabulated_tools *tools,
                          const struct srnf_context *context)
{
    size_t rows = from->normal.rows < PULL_ROWS       ? PULL_ROWS
                  : from->normal.rows > PULL_ROWS_MAX ? PULL_ROWS_MAX
                                                      : from->normal.rows;
    /* Any table read as if it were of normals gives x / sqrt|x|. */
    struct tabulated_moving plain = {.degree = from->degree, .normal = from->normal};
    struct cloud cloud = {0};
    int status = open_nodes(&cloud, rows);

    *m = (struct tabulated_moving){
        .representation = from->representation, .degree = from->degree, .pulled = true};
    status = status ? status : cloud_follow(&cloud, chain, &pull_table, tools, context);
    if (status == SRNF_OK) {
        cloud_evaluate(&plain, &cloud);
        status = fill(&m->normal, rows, &cloud, NODE_NORMAL);
        status = status ? status : fill(&m->carried, rows, &cloud, NODE_CARRIED);
    }
    if (status == SRNF_OK && from->representation == SRNF_REPRESENTATION_SRM) {
        plain.normal = from->position;
        cloud_evaluate(&plain, &cloud);
        status = fill(&m->position, rows, &cloud, NODE_FIELD);
    }
    cloud_clear(&cloud);
    if (status) {
        tabulated_moving_clear(m);
    }
    return status;
}
