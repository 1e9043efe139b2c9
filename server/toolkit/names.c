/*
 * names.c - see names.h.
 */
#include "toolkit/names.h"

#include <stdio.h>
#include <string.h>

#include "store/mesh.h"
#include "store/surface.h"

json_t *group_name_of(struct jobs_run *run, const char *id)
{
    struct store *store = jobs_run_store(run);
    const char *owner = jobs_run_owner(run);
    struct store_surface surface = {0};
    struct store_mesh mesh = {0};
    json_t *name = NULL;

    if (strncmp(id, "mesh-", 5) == 0) {
        if (process_read(store_mesh_get_as(store, owner, id, &mesh)) && mesh.name && mesh.name[0]) {
            name = json_string(mesh.name);
        }
        store_mesh_clear(&mesh);
    } else {
        if (process_read(store_surface_get_as(store, owner, id, false, &surface)) && surface.name &&
            surface.name[0]) {
            name = json_string(surface.name);
        }
        store_surface_clear(&surface);
    }
    return name ? name : json_string(id);
}

void group_who(struct jobs_run *run, const json_t *surfaces, const json_t *subjects, size_t i,
               char text[GROUP_WHO])
{
    const char *id = json_string_value(json_array_get(surfaces, i));
    const char *subject = json_string_value(json_array_get(subjects, i));
    json_t *name = id ? group_name_of(run, id) : NULL;
    const char *own = json_string_value(name);
    bool called = own && strcmp(own, id) != 0;

    (void)snprintf(text, GROUP_WHO, "Member %zu (%.80s)", i,
                   called    ? own
                   : subject ? subject
                   : id      ? id
                             : "?");
    json_decref(name);
}
