/*
 * bench_marching_cubes.c - what becomes of surfaces as programs of marching cubes write them.
 *
 * FOLDER, the program's argument or else SRNFD_MARCHING_CUBES, is what tests/data/marching_cubes/
 * make.py FOLDER has written; without one nothing is measured. For each file: the components and
 * vertices of the mesh as it is, what was repaired, and of its encoding at degree 31 the volume
 * against that of the repaired mesh, the root mean square of the fit against the diagonal, and the
 * distortion of the map. "formula" is the volume of the mesh against that of the image's formula:
 * marching cubes has an error of its own, and 8 bits have one.
 *
 * Required of each mesh that is one surface: a volume within 0.5 %, a fit below 0.3 %.
 *
 * Exit status: 0 if the requirement is met, 1 otherwise.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "support/meshes.h"

#define VOLUME_REQUIRED 0.005
#define FIT_REQUIRED 0.003

struct row {
    char file[160], image[40], tool[40];
    double level, truth;
};

struct count {
    size_t right, refused, wrong;
};

static void print_repairs(const struct srnf_mesh_repairs *repairs)
{
    printf(" %6zu %5zu %4zu %4zu %5zu", repairs->duplicate_vertices_merged,
           repairs->collapsed_faces_dropped, repairs->duplicate_faces_dropped,
           repairs->folded_faces_dropped, repairs->touching_vertices_kept_apart);
}

static void measure(const struct row *row, struct srnf_mesh *mesh, struct count *count)
{
    struct srnf_mesh_report report;
    struct srnf_encode_options options = srnf_encode_options_defaults();
    struct srnf_encoded encoded = {0};
    struct srnf_error error = {0};
    double volume;
    double fit;
    int status = srnf_mesh_prepare(mesh, true, &report);

    options.parameterization = SRNF_PARAMETERIZATION_AREA;
    printf("%-10s %6.6g  %-22s", row->image, row->level, row->tool);
    print_repairs(&report.repairs);
    if (status == SRNF_OK) {
        status = srnf_encode(mesh, &report, &options, NULL, &encoded, &error);
    }
    if (status != SRNF_OK) {
        printf("  refused: %s\n", error.message);
        count->refused++;
        return;
    }
    volume = encoded.measures.volume * pow(encoded.scale, 3.0) / report.volume - 1.0;
    fit = encoded.fit.rms / encoded.fit.diagonal;
    if (fabs(volume) <= VOLUME_REQUIRED && fit <= FIT_REQUIRED) {
        count->right++;
    } else {
        count->wrong++;
    }
    printf(" %9.3f", report.volume);
    if (row->truth > 0.0) {
        printf(" %8.3f %%", 100.0 * (report.volume / row->truth - 1.0));
    } else {
        printf(" %10s", "");
    }
    printf(" %8.3f %% %7.4f %% %8.3g %5.2f\n", 100.0 * volume, 100.0 * fit,
           encoded.distortion.symmetric_dirichlet, encoded.distortion.log_area_deviation);
    srnf_free(encoded.coefficients);
}

int main(int argc, char **argv)
{
    const char *folder = argc > 1 ? argv[1] : getenv("SRNFD_MARCHING_CUBES");
    struct count count = {0, 0, 0};
    struct row row;
    char path[512];
    char line[400];
    FILE *manifest;

    if (!folder) {
        printf("not measured: SRNFD_MARCHING_CUBES names no folder\n");
        return 0;
    }
    (void)snprintf(path, sizeof path, "%s/MANIFEST.tsv", folder);
    manifest = fopen(path, "r");
    if (!manifest) {
        perror(path);
        return 2;
    }
    printf("%-10s %6s  %-22s %6s %5s %4s %4s %5s %9s %10s %10s %9s %8s %5s\n", "image", "level",
           "tool", "merged", "coll.", "dup.", "fold", "touch", "volume", "formula", "encoded",
           "fit", "energy", "sd");
    while (fgets(line, sizeof line, manifest)) {
        struct srnf_mesh mesh = {0};

        if (sscanf(line, "%159s %39s %lf %39s %lf", row.file, row.image, &row.level, row.tool,
                   &row.truth) != 5) {
            fprintf(stderr, "%s: not a row: %s", path, line);
            return 2;
        }
        (void)snprintf(path, sizeof path, "%s/%s", folder, row.file);
        if (!meshes_load(path, &mesh)) {
            perror(path);
            return 2;
        }
        measure(&row, &mesh, &count);
        srnf_mesh_clear(&mesh);
    }
    (void)fclose(manifest);
    printf("%zu right, %zu refused, %zu wrong\n", count.right, count.refused, count.wrong);
    return count.wrong > 0;
}
