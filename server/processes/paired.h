/*
 * paired.h - what the processes change and asymmetry share: cohorts with two surfaces of each
 * subject, and what their differences come to.
 */
#ifndef SRNFD_PROCESSES_PAIRED_H
#define SRNFD_PROCESSES_PAIRED_H

#include "toolkit/mean.h"
#include "toolkit/permutation_test.h"

struct paired {
    struct group_input group; /* both members of each subject, and nobody else */
    struct mean_input mean;
    long permutations, bootstraps, seed;
    size_t n, *first, *second; /* [n] members, of each subject */
    /* [n] so many from there on are measurements of the same side; NULL: one each */
    size_t *first_count, *second_count;
    int scale; /* enum paired_scale */
    bool fields;
    bool turned; /* all members are taken as the mirror images of what group.cohort says */
};
enum paired_scale { PAIRED_SHAPE_AND_SIZE, PAIRED_SHAPE };
extern const char *const paired_scales[];

/* paired_inputs.c: the rows of a table whose typed inputs are a struct paired. */
extern const struct input_own paired_cohort;
extern const struct input_own paired_time; /* a number or null; typed: nothing */
/* paired_cohort.c: for complete. The canonical cohort gets the members that are compared alone, in
   an order that is theirs whatever the cohort's is, with first and second, their places. */
void paired_describe_visits(struct process_inputs *given);
void paired_describe_sides(struct process_inputs *given);
/* paired_times.c: whether two subjects have members of the same two times. of: [members] numbers of
   their subjects. */
bool paired_share_times(const json_t *members, const size_t *of);

#define PAIRED_COPIES 16 /* fields of each surface: those of the mean, and of pairs */

#define PAIRED_INPUTS(difference)                                                                  \
    {"scale", INPUT_CHOICE, offsetof(struct paired, scale),                                        \
     "shape-and-size: surfaces as large as they are; shape: the two of a subject brought to one "  \
     "area, at their mean size.",                                                                  \
     .choices = paired_scales},                                                                    \
        {"permutations",                                                                           \
         INPUT_INTEGER,                                                                            \
         offsetof(struct paired, permutations),                                                    \
         "Flips of the signs of whole subjects' differences. No p can be below 1 / "               \
         "(permutations + 1).",                                                                    \
         .lowest = 1,                                                                              \
         .highest = PROCESS_PERMUTATIONS_MAX,                                                      \
         .fallback = PROCESS_PERMUTATIONS_DEFAULT},                                                \
        {"bootstraps",                                                                             \
         INPUT_INTEGER,                                                                            \
         offsetof(struct paired, bootstraps),                                                      \
         "Samples of subjects for intervals.",                                                     \
         .lowest = 100,                                                                            \
         .highest = 10000,                                                                         \
         .fallback = 1000},                                                                        \
        {"seed", INPUT_INTEGER, offsetof(struct paired, seed), "Of both.",                         \
         .highest = PROCESS_SEED_MAX},                                                             \
        {"fields", INPUT_BOOLEAN, offsetof(struct paired, fields),                                 \
         "Put the " difference " of each subject along the normal, on the grid, into perSubject.", \
         .fallback = 0},                                                                           \
        MEAN_INPUTS(paired, NULL),                                                                 \
        MEAN_SRNF_METHOD(paired, "srnf: of the space of SRNFs, in which differences are vectors.", \
                         NULL)

#define PAIRED_NUMBERS "{\"type\":\"array\",\"items\":{\"type\":\"number\"}}"
#define PAIRED_ESTIMATE                                                     \
    OUTPUT_OBJECT ",\"required\":[\"value\",\"interval\"],\"properties\":{" \
                  "\"value\":{" OUTPUT_NUMBER_OR_NULL "},\"interval\":" PAIRED_NUMBERS "}"
#define PAIRED_SUBJECTS                                                                      \
    "\"type\":\"array\",\"items\":{" OUTPUT_OBJECT                                           \
    ",\"required\":[\"subject\",\"sizes\",\"length\",\"deviation\",\"along\",\"distance\"]," \
    "\"properties\":{\"subject\":{" OUTPUT_STRING "},\"sizes\":" PAIRED_NUMBERS              \
    ",\"length\":{" OUTPUT_NUMBER_OR_NULL "},\"deviation\":{" OUTPUT_NUMBER_OR_NULL          \
    "},\"along\":{" OUTPUT_NUMBER_OR_NULL "},\"distance\":{" OUTPUT_NUMBER_OR_NULL           \
    "},\"field\":{" OUTPUT_NUMBERS_OR_NULLS "}}}"

#define PAIRED_OUTPUTS(difference, between)                                                        \
    {"pValue", OUTPUT_NUMBER,                                                                      \
     "Of the mean " difference ", by flips of the signs of whole subjects' differences: p of the " \
     "hypothesis that " between " could be exchanged."},                                           \
        {"pValueIsFloor", OUTPUT_BOOLEAN, "As in compare-groups."},                                \
        {"pValueInterval", OUTPUT_NUMBERS_OR_NULLS, "As in compare-groups."},                      \
        {"permutations", OUTPUT_INTEGER, "Flips that the differences were compared with."},        \
        {"relabellings", OUTPUT_NUMBER_OR_NULL, "Different ones that there are."},                 \
        {"exact", "\"type\":[\"boolean\",\"null\"]", "Whether all of them were taken."},           \
        {"leastSignificance", OUTPUT_NUMBER,                                                       \
         "Least value of significance on the map: p of the hypothesis of no difference "           \
         "anywhere."},                                                                             \
        {"leastSignificanceIsFloor", OUTPUT_BOOLEAN, "As of pValue."},                             \
        {"leastSignificanceInterval", OUTPUT_NUMBERS_OR_NULLS, "As of pValue."},                   \
        {"leastFdr", OUTPUT_NUMBER, "Least value of fdr on the map."},                             \
        {"largestEffect", OUTPUT_NUMBER,                                                           \
         "Largest value of effect on the map: a maximum, larger than the true one, as noise adds " \
         "to it; no estimate with an interval. The largest of normalEffect less confidence is a "  \
         "lower bound of the true one, at 95 %."},                                                 \
        {"largestConfidence", OUTPUT_NUMBER, "Largest value of confidence on the map."},           \
        {"distance", OUTPUT_NUMBER, "Norm of the mean " difference ", in L2 of SRNFs."},           \
        {"distanceInterval", OUTPUT_NUMBERS_OR_NULLS,                                              \
         "As in compare-groups; [null, null] also where no difference is another than the "        \
         "others: "                                                                                \
         "so are the intervals of all that is the same."},                                         \
        {"individual", PAIRED_ESTIMATE,                                                            \
         "{value, interval}: standard deviation of the subjects, each the mean of its two "        \
         "surfaces, as those above."},                                                             \
        {"share", PAIRED_ESTIMATE,                                                                 \
         "{value, interval}: share of the mean in the squares of all differences, in L2 of "       \
         "SRNFs. The value is too large by what noise explains, which the interval is free "       \
         "of: in small groups it lies near the upper end."},                                       \
        {"perSubject", PAIRED_SUBJECTS,                                                            \
         "[{subject, sizes (roots of areas, of both), length (root of the mean square of its "     \
         "displacement), deviation (of that from the mean of the other subjects), along (its "     \
         "part along that mean), distance (in L2 of SRNFs), field}]. Lengths in the units of the " \
         "input."},                                                                                \
        {"surface", OUTPUT_OBJECT,                                                                 \
         "The mean of all surfaces, with the maps effect (length of the mean displacement), "      \
         "normalEffect (outward positive), standardError and confidence (half the width of a "     \
         "95 % region for normalEffect that holds at all points together), in the units of the "   \
         "input, and significance, fdr, pointwiseP and statistic (Hotelling's T2)."},              \
        {"subjects", OUTPUT_INTEGER, "What is compared: each has two surfaces."},                  \
        MEAN_MEMBERS_OUTPUTS

/* paired.c: runs the process; difference and spread are its names of the mean displacement and of
   its standard deviation in the result. */
json_t *paired_run(struct jobs_run *run, const struct paired *asked, const char *process,
                   const char *difference, const char *spread, struct jobs_result *result);
/* paired_replicates.c. A field, size and surface near it for each subject and side, from its
   measurements: one as it is, of several their mean. mean_q [3][P]; near [3][(L+1)^2] or NULL. */
struct paired_side {
    double *q, *near, size;
};
void paired_average(struct jobs_run *run, const struct group_mean *mean, size_t from, size_t count,
                    struct paired_side *side);
/* The test of fluctuating asymmetry against the error of measurement; NULL json without repeated
   ones. Returns 0, or a negative status with the problem in result. */
int paired_replicates(struct jobs_run *run, const struct paired *asked,
                      const struct group_mean *mean, const struct srnf_sht *sht, json_t **found,
                      struct jobs_result *result);
/* Warns where too few subjects were measured repeatedly. */
void paired_warn_replicates(json_t *document, const struct paired *asked, const json_t *replicates);
/* change_doubts.c: warnings of visits that look mistaken. */
void change_warn(const struct paired *asked, const struct group_mean *mean,
                 const struct srnf_paired *found, json_t *document);
double paired_seconds(const struct api_work *work, const json_t *canonical);

#endif
