/*
 * ventricles.h - the hundred real left ventricles as groups for the benches; vertex i corresponds
 * across all of them.
 */
#ifndef TESTS_BENCH_VENTRICLES_H
#define TESTS_BENCH_VENTRICLES_H

#include "core/stats/group.h"
#include "support/folders.h"

#define VENTRICLES "../shared/data/lv_endocardium_ed"

/* The i-th of n meshes, taken in turn from both ends of the sorted names: both of the groups that
   the names tell apart. False where the data are not there. */
static inline bool ventricles_load(size_t i, size_t n, struct srnf_mesh *mesh)
{
    char *paths[FOLDERS_FILES_MAX];
    size_t found = folders_list(VENTRICLES, paths);
    bool loaded = found >= n && meshes_load(paths[i % 2 ? found - 1 - i / 2 : i / 2], mesh);

    for (size_t k = 0; k < found; k++) {
        free(paths[k]);
    }
    return loaded;
}

/* By a route; false, saying so, when the data are not there. */
static inline bool ventricles_open(struct group *g, size_t degree, size_t n,
                                   enum srnf_parameterization route)
{
    struct srnf_mesh mesh;

    if (!ventricles_load(0, n, &mesh)) {
        printf("# skipped: no %s\n", VENTRICLES);
        return false;
    }
    srnf_mesh_clear(&mesh);
    group_open(g, degree, n);
    for (size_t i = 0; i < n; i++) {
        assert_true(ventricles_load(i, n, &mesh));
        group_encode(g, i, &mesh, route);
    }
    return true;
}

#endif
