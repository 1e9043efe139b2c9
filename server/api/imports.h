/*
 * imports.h - what the files of an import share: whole studies that come in one request.
 */
#ifndef SRNFD_API_IMPORTS_H
#define SRNFD_API_IMPORTS_H

#include "api/cohorts.h"
#include "api/respond.h"
#include "api/study.h"
#include "api/study_table.h"
#include "compute/prepared.h"

struct labels;      /* api/labels.h */
struct store_batch; /* store/batch.h */

/* All that an import unpacks, entries of archives and what is packed in files, holds at most so
   many times --max-body. */
#define IMPORT_GROWTH 8
#define IMPORT_REFUSALS_MAX ((size_t)1000) /* that an answer names; it counts all */

#define IMPORT_LABELS_SHOWN 100
#define IMPORT_PREPARED_MAX ((size_t)16 << 20) /* 100 meshes of 6,000 faces; others at first need */

#define IMPORT_CHANGED \
    "it is not what " STUDY_MANIFEST " says of it: its content was changed, or what is said of it"
#define IMPORT_LACKING \
    "it stands on surfaces that did not come with it and are not yours: send them with it"
#define IMPORT_UNUSABLE "%.60s (%.200s) cannot be used: %s"
#define IMPORT_EDITED "what it says of %.60s (%.200s) is not what the export wrote: it was changed"

/* A mesh of the import, or a file that was refused or passed over when it was read, which has a
   path alone. */
struct import_file {
    char *path;       /* as it came */
    const char *base; /* its last part, within path */
    size_t number;    /* in the order in which they came */
    char id[STORE_ID_MAX];
    json_t *answer;       /* what is told of it */
    bool volume;          /* and no mesh */
    char *flaw;           /* of a mesh that cannot be analysed, its first problem in words; free */
    bool untransformed;   /* as mesh_untransformed says */
    unsigned char *bytes; /* of its own, that the batch reads; srnf_free; NULL: none */
    size_t put;           /* of the batch; SIZE_MAX: the owner had it */
    bool refused;
    bool passed; /* refused, but for nothing more than a warning: import_is_companion */
};

struct import {
    struct api_call *call;
    struct store_batch *batch;
    char cohort[STORE_COHORT_NAME_MAX]; /* "": none is made */
    bool partial;
    bool answered; /* a problem was answered, and all is over */
    struct import_file *files;
    size_t n_files, capacity;
    json_t *refused;
    size_t n_refused;
    struct study_table table;
    char *table_path; /* NULL: there is no table */
    json_t *labels;   /* how many members have each, the first IMPORT_LABELS_SHOWN; NULL: none */
    /* Of an export: its manifest, its files by their paths, the degrees of its surfaces by their
       ids (all must come), the ids that came, and of the next mesh its id, format, name and source;
       NULL otherwise. How many surfaces, models and jobs came with it. */
    json_t *manifest, *by_path, *surfaces, *seen;
    json_t *made; /* of an export: paths of files that were made of the others, as they come, and
                     whether they are as they were written */
    const char *id, *format, *name, *source;
    bool volume;           /* the next one is a volume */
    bool edited;           /* what is refused is what the manifest says, and not a file */
    char why[API_WHY_MAX]; /* it is refused, where that is known; otherwise "" */
    bool fresh;            /* a surface or model of it is new to the caller */
    bool lacking; /* it stands on a surface that did not come, and that the caller has not */
    size_t n_restored[3];
    size_t unpack_left; /* bytes that may still be unpacked */
    int64_t room;       /* bytes that the owner may still take; below 0: any number */
    size_t charged;
    struct import_prepared
        *prepared; /* of new meshes, IMPORT_PREPARED_MAX bytes: kept at the end */
    size_t n_prepared, prepared_bytes;
};

/* A mesh as it was prepared, which can be kept only when the mesh is stored. */
struct import_prepared {
    char id[STORE_ID_MAX];
    struct compute_prepared mesh;
};

/* One file as it came. */
struct import_given {
    const char *path, *type; /* type: its media type, or "" */
    const unsigned char *bytes;
    size_t size;
    unsigned char
        *own; /* bytes, where the import may keep them (then it is set to NULL); or NULL */
};

/* Notes that a file is not taken (imports_refuse.c). */
void import_refuse(struct import *import, const char *path, const char *code, const char *format,
                   ...) __attribute__((format(printf, 4, 5)));
/* The same of a mesh that was taken before. */
void import_drop(struct import *import, struct import_file *file, const char *code,
                 const char *detail);
/* Whether it is a label volume, by its bytes or its name. */
bool import_is_volume(const struct import_given *given);
/* Whether it is a text that goes with meshes, by its name and its bytes (imports_companions.c). */
bool import_is_companion(const struct import_given *given);
/* What a file is called: the last part of its path without its ending; "" where that is no name. */
void import_name_of(const char *path, char name[NAME_SIZE]);
/* Takes one file: a mesh, a volume or the table (imports_files.c). */
void import_take(struct import *import, struct import_given *given);

/* Answers that the import does not fit into memory. */
void import_answer_memory(struct import *import);
/* Answers that it unpacks to too much; path: where that was found. */
void import_answer_growth(struct import *import, const char *path);
/* What an import may unpack. */
size_t import_growth(const struct api_call *call);

/* Reads the body, whatever form it has, and takes each of its files (imports_body.c). */
void import_read_body(struct import *import);

/* Takes the manifest of an export, where this is one; false where it is none (imports_study.c). */
bool import_take_manifest(struct import *import, const struct import_given *given);
/* Takes a file of an export; false where it is a mesh or a volume, taken as others are. */
bool import_take_study(struct import *import, struct import_given *given);
/* The tags that the manifest gives one thing, and its name where that is asked for; not given where
   they are empty. labels_clear must follow. */
void import_read_labels(const json_t *record, bool with_name, struct labels *labels,
                        struct problem_list *list);
/* A whole number of a record, within bounds; false: it is none. A text of a record, free; NULL: it
   is none, or there is no memory. */
bool import_whole(const json_t *record, const char *name, int64_t least, int64_t most,
                  int64_t *value);
char *import_text(const json_t *record, const char *name);
/* Whether the bytes have the digest of the manifest, which finds damage and edits but no forger;
   archives of older versions have none. wanted: the digest; NULL: there is none. */
bool import_unchanged(const json_t *wanted, const void *bytes, size_t size);
/* Takes a surface or a model (imports_restore.c) or a job (imports_jobs.c) of an export. False
   where it is not what its record in the manifest says; otherwise *status is that of the store. */
bool import_restore_surface(struct import *import, const json_t *record, const char *id,
                            const struct import_given *given, int *status);
bool import_restore_model(struct import *import, const json_t *record, const char *id,
                          const struct import_given *given, int *status);
bool import_restore_job(struct import *import, const json_t *record, const char *id,
                        const struct import_given *given, int *status);
/* The members that the manifest names; false when a problem was answered. */
bool import_study_members(struct import *import, struct cohort_text *members);

/* Answers (imports_answer.c): why nothing is kept, or what was taken; created: anything is new. */
void import_respond_refused(struct import *import);
void import_respond_taken(struct import *import, const struct store_cohort *cohort, bool created);

/* Matches the table with the files, and refuses what stands in one of them alone; then the members
   of the cohort (imports_match.c). */
void import_match(struct import *import, struct cohort_text *members);

#endif
