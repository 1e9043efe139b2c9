/*
 * export_study.h - an export while it is written: what lists a record in the manifest, and what
 * adds its files to the zip. One pair of functions for each kind of record.
 */
#ifndef SRNFD_API_EXPORT_STUDY_H
#define SRNFD_API_EXPORT_STUDY_H

#include <jansson.h>

#include "api/study.h"
#include "api/zip.h"
#include "store/cohort.h"

struct export
{
    struct study study;
    struct zip_writer zip;
    json_t *manifest, *graph, *parts, *files;
    const struct store_cohort *cohort; /* NULL: of a model */
    size_t held;                       /* bytes of the file that are counted */
    bool beyond;                       /* the caller's share is full */
    bool full;                         /* the disk is */
};

struct store *export_store(const struct export *export);
/* Notes a failure of the store; true where there is none. */
bool export_good(struct export *export, int status);

/* Adds a file to the zip, and its digest to those of the manifest (export_manifest.c). */
void export_put(struct export *export, const char *path, const void *bytes, size_t size);

/* Lists the cohort; it has one. */
void export_list_cohort(struct export *export);
/* Lists the record in the manifest, and its files in the metadata (export_manifest.c). */
void export_list_volume(struct export *export, const char *id);
void export_list_mesh(struct export *export, const char *id);
void export_list_surface(struct export *export, const char *id);
void export_list_model(struct export *export, const char *id);
void export_list_job(struct export *export, const char *id);
/* The metadata of the whole, as RO-Crate has it (new reference). */
json_t *export_crate(struct export *export, const char *name);

/* Adds the files of a record to the zip, the first of them at this path (export_files.c). */
void export_add_volume(struct export *export, const char *id, const char *path);
void export_add_mesh(struct export *export, const char *id, const char *path);
void export_add_surface(struct export *export, const char *id, const char *path);
void export_add_model(struct export *export, const char *id, const char *path);
void export_add_job(struct export *export, const char *id, const char *path);

#endif
