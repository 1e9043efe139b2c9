/*
 * classify_parts.h - what the files of the process classify-parts share.
 */
#ifndef SRNFD_PROCESSES_CLASSIFY_PARTS_H
#define SRNFD_PROCESSES_CLASSIFY_PARTS_H

#include "processes/classify.h"
#include "processes/pca_parts.h"

struct classify_parts {
    struct pca_parts parts; /* whose group stands part after part */
    struct classify_methods methods;
    json_t *covariates; /* names */
    long components;
    int covariance, scale;
    double size_weight;
    long permutations, seed;
};

/* Beside the joint comparison, that of one part alone: by the same folds, without other numbers. */
struct classify_parts_alone {
    struct srnf_classification results[CLASSIFY_METHODS];
};

/* classify_parts_inputs.c: for complete. The canonical cohort gets subjectLabels and values, of the
   covariates, an array for each; problems name who lacks what. */
void classify_parts_complete(struct process_inputs *given);
/* The same for other processes of labelled subjects, whose classes have `least` subjects each and
   are judged by check (classify_classes_check); memory for `copies` fields of each member. */
void classify_parts_complete_by(struct process_inputs *given, size_t copies, size_t least,
                                classify_check_folds *check);
/* The values of covariates of the n subjects, an array for each name, into the canonical cohort;
   false with a problem noted. */
bool classify_parts_values(struct process_inputs *given, const json_t *names, size_t n);
/* The numbers beside shape: sizes of the parts, and covariates. */
size_t classify_parts_count(const json_t *canonical);
/* The classes of the subjects of a canonical cohort; false: no memory. */
bool classify_parts_classes(const json_t *cohort, struct classify_classes *classes);

/* classify_parts_result.c: the result document; NULL with the problem set.
     answer  of the subjects
     names   [n] of the subjects */
json_t *classify_parts_document(struct jobs_run *run, const struct classify_parts *asked,
                                const struct classify_answer *answer,
                                const struct classify_parts_alone *alone,
                                struct jobs_result *result);

#endif
