/*
 * tabulated_tools.c - what registrations in one thread make again and again, kept from one use to
 * the next: fields on their tables, and transforms.
 *
 * Their Legendre functions, plans and frames do not depend on what is registered. Who takes one has
 * it alone until it is returned; what it holds then is of no use to the next.
 */
#include "tabulated.h"

int tools_fields(struct tabulated_tools *tools, size_t degree, size_t order, size_t rows,
                 struct tabulated_fields *fields)
{
    for (size_t k = 0; tools && k < tools->n_fields; k++) {
        struct tabulated_fields *kept = &tools->fields[k];

        if (kept->degree == degree && kept->table.order == order && kept->table.rows == rows) {
            *fields = *kept;
            *kept = tools->fields[--tools->n_fields];
            return SRNF_OK;
        }
    }
    return tabulated_fields_create(fields, degree, order, rows);
}

void tools_return_fields(struct tabulated_tools *tools, struct tabulated_fields *fields)
{
    if (tools && fields->memory && tools->n_fields < TOOLS_FIELDS &&
        fields->degree <= TOOLS_DEGREE) {
        tools->fields[tools->n_fields++] = *fields;
        *fields = (struct tabulated_fields){0};
    } else {
        tabulated_fields_clear(fields);
    }
}

int tools_transform(struct tabulated_tools *tools, size_t degree, const struct nodes_of *nodes,
                    struct srnf_sht **sht)
{
    for (size_t k = 0; tools && k < tools->n_transforms; k++) {
        struct srnf_sht *kept = tools->transforms[k];
        const struct srnf_grid *grid = srnf_sht_grid(kept);

        if (srnf_sht_degree(kept) == degree && grid->kind == nodes->kind &&
            grid->n_theta == nodes->n_theta && grid->n_phi == nodes->n_phi) {
            *sht = kept;
            tools->transforms[k] = tools->transforms[--tools->n_transforms];
            return SRNF_OK;
        }
    }
    return srnf_sht_create(sht, degree, nodes->kind, nodes->n_theta, nodes->n_phi);
}

void tools_return_transform(struct tabulated_tools *tools, struct srnf_sht *sht)
{
    if (tools && sht && tools->n_transforms < TOOLS_TRANSFORMS &&
        srnf_sht_degree(sht) <= TOOLS_DEGREE) {
        tools->transforms[tools->n_transforms++] = sht;
    } else {
        srnf_sht_destroy(sht);
    }
}

struct tabulated_tools *tools_create(void)
{
    return srnf_alloc(1, sizeof(struct tabulated_tools));
}

void tools_destroy(struct tabulated_tools *tools)
{
    for (size_t k = 0; tools && k < tools->n_fields; k++) {
        tabulated_fields_clear(&tools->fields[k]);
    }
    for (size_t k = 0; tools && k < tools->n_transforms; k++) {
        srnf_sht_destroy(tools->transforms[k]);
    }
    srnf_free(tools);
}

void tools_pool_open(struct tools_pool *pool)
{
    for (size_t k = 0; k < TOOLS_PLACES; k++) {
        atomic_flag_clear(&pool->places[k].taken);
        pool->places[k].tools = NULL;
    }
}

void tools_pool_clear(struct tools_pool *pool)
{
    for (size_t k = 0; k < TOOLS_PLACES; k++) {
        tools_destroy(pool->places[k].tools);
        pool->places[k].tools = NULL;
    }
}

int tools_take(struct tools_pool *pool, struct tabulated_tools **tools)
{
    *tools = NULL;
    for (size_t k = 0; k < TOOLS_PLACES; k++) {
        struct tools_place *place = &pool->places[k];

        if (atomic_flag_test_and_set_explicit(&place->taken, memory_order_acquire)) {
            continue;
        }
        place->tools = place->tools ? place->tools : tools_create();
        if (!place->tools) {
            atomic_flag_clear_explicit(&place->taken, memory_order_release);
            return SRNF_ENOMEM;
        }
        place->tools->place = k;
        *tools = place->tools;
        break;
    }
    return SRNF_OK;
}

void tools_give_back(struct tools_pool *pool, const struct tabulated_tools *tools)
{
    if (tools) {
        atomic_flag_clear_explicit(&pool->places[tools->place].taken, memory_order_release);
    }
}
