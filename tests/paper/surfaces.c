/*
 * surfaces.c - groups of surfaces for the sections of the report, and rows of their pictures.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "paper/paper.h"
#include "paper/report_internal.h"
#include "support/compare.h"
#include "support/meshes.h"

void paper_check(int status, const struct srnf_error *error, const char *what)
{
    char text[400];

    (void)snprintf(text, sizeof text, "%s: %s", what,
                   error && error->message[0] ? error->message : srnf_strerror(status));
    report_must(status >= 0, text);
}

struct paper_group paper_group_open(size_t degree, size_t n)
{
    struct paper_group group = {
        .n = n, .degree = degree, .count = 3 * srnf_coefficient_count(degree)};

    paper_check(srnf_sht_create(&group.sht, degree, SRNF_GRID_GAUSS_LEGENDRE, 0, 0), NULL,
                "preparing the transform");
    group.surfaces = calloc(n, sizeof *group.surfaces);
    group.scales = calloc(n, sizeof *group.scales);
    group.labels = calloc(n, sizeof *group.labels);
    report_must(group.surfaces && group.scales && group.labels, "out of memory");
    for (size_t i = 0; i < n; i++) {
        group.surfaces[i] = srnf_alloc(group.count, sizeof(double));
        report_must(group.surfaces[i] != NULL, "out of memory");
    }
    return group;
}

void paper_group_close(struct paper_group *group)
{
    for (size_t i = 0; i < group->n; i++) {
        srnf_free(group->surfaces[i]);
    }
    free(group->surfaces);
    free(group->scales);
    free(group->labels);
    srnf_sht_destroy(group->sht);
}

double paper_normalize(const struct paper_group *group, double *surface)
{
    size_t each = group->count / 3;
    struct srnf_surface_measures measures;
    void *workspace = srnf_alloc(1, srnf_surface_workspace_size(group->sht));
    double scale;

    report_must(workspace != NULL, "out of memory");
    srnf_surface_measure(group->sht, surface, &measures, workspace);
    scale = sqrt(measures.area);
    for (size_t c = 0; c < 3; c++) {
        surface[c * each] -= sqrt(4.0 * acos(-1.0)) * measures.centroid[c];
    }
    for (size_t k = 0; k < group->count; k++) {
        surface[k] /= scale;
    }
    srnf_free(workspace);
    return scale;
}

bool paper_encode(struct paper_group *group, size_t i, const char *path,
                  enum srnf_parameterization route)
{
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_error error = {0};
    struct srnf_mesh_report report;
    struct srnf_encoded encoded;
    struct srnf_mesh mesh;

    if (!meshes_load(path, &mesh)) {
        return false;
    }
    options.degree = group->degree;
    options.parameterization = route;
    paper_check(srnf_mesh_prepare(&mesh, false, &report), NULL, path);
    paper_check(srnf_encode(&mesh, &report, &options, NULL, &encoded, &error), &error, path);
    memcpy(group->surfaces[i], encoded.coefficients, group->count * sizeof(double));
    group->scales[i] = encoded.scale;
    srnf_free(encoded.coefficients);
    srnf_mesh_clear(&mesh);
    return true;
}

bool paper_load_ventricles(struct paper_group *group, size_t degree, size_t limit)
{
    char line[300];
    FILE *labels = fopen(PAPER_DATA "/lv_endocardium_ed/labels.csv", "r");
    size_t n = 0;

    if (!labels) {
        return false;
    }
    *group = paper_group_open(degree, limit);
    while (n < limit && fgets(line, sizeof line, labels)) {
        char name[200];
        char path[500];
        int label;

        if (sscanf(line, "%199[^,],%*[^,],%*[^,],%d", name, &label) != 2) {
            continue;
        }
        (void)snprintf(path, sizeof path, PAPER_DATA "/lv_endocardium_ed/%s", name);
        if (paper_encode(group, n, path, SRNF_PARAMETERIZATION_STAR)) {
            group->labels[n++] = label;
        }
    }
    (void)fclose(labels);
    for (size_t i = n; i < limit; i++) {
        srnf_free(group->surfaces[i]);
    }
    group->n = n;
    return n > 0;
}

void paper_row(struct paper *paper, const char *caption, const struct picture_view *view,
               size_t degree, size_t n, const double *const *surfaces, const double *reference,
               const char *const *captions)
{
    struct picture_view wide = *view;
    double highest = 0.0;

    for (size_t i = 0; i < n; i++) {
        wide.reach = compare_max(wide.reach, picture_reach(degree, surfaces[i]));
        if (reference) {
            highest = compare_max(highest, picture_largest(degree, surfaces[i], reference));
        }
    }
    report_row_open(paper->report, caption);
    for (size_t i = 0; i < n; i++) {
        struct picture picture = picture_draw(degree, surfaces[i], &wide, reference, highest);

        report_picture(paper->report, picture.png, picture.size, "%s", captions[i]);
        picture_clear(&picture);
    }
    report_row_close(paper->report);
}
