/*
 * study.h - all that belongs to a study, and its manifest: what an export writes and an import
 * reads.
 */
#ifndef SRNFD_API_STUDY_H
#define SRNFD_API_STUDY_H

#include "api/handler.h"

#define STUDY_MANIFEST "srnfd-study.json"
#define STUDY_FORMAT "srnfd-study"
#define STUDY_VERSION 1

/* What was gathered. */
struct study {
    struct api_call *call;
    const char *owner; /* whose it is */
    json_t *ids;       /* of volumes, meshes, surfaces and models, as keys */
    json_t *jobs;      /* ids as keys */
    json_t *makers;    /* of surfaces and models: the jobs that made them, if records tell */
    int status;        /* of the store */
};

/* Name of the file of an array of a model within its .npz (export_files.c). */
const char *study_array_file(size_t array);

/* SHA-256 of what a job was asked, in hexadecimal: process, numeric build and canonical inputs. ""
   is no digest: there was no memory. */
void study_job_digest(char digest[65], const char *process, const char *build, const char *inputs);

bool study_begin(struct study *study, struct api_call *call, const char *owner);
void study_end(struct study *study);
/* Adds what the id names, if the owner has it, with what it cannot be without: the mesh of a
   surface, the surfaces and the mean of a model. */
void study_add(struct study *study, const char *id);
/* Adds the successful jobs whose inputs name nothing but what is in the study, and what they made,
   until there are no more of them. */
void study_add_jobs(struct study *study);
/* Adds only those of them that made what is in the study: what else was asked about the same
   members stays where it is. */
void study_add_makers(struct study *study);

#endif
