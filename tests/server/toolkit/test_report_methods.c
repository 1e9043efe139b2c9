/*
 * test_report_methods.c - the paragraph on methods of a report says what a job did, by its inputs
 * and its results, and nothing that it did not do.
 * srnfd-test: once (texts alone)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "processes/processes.h"
#include "processes/report.h"

static const struct api_process *find(const char *id)
{
    const struct api_process *const *rows = processes.rows;

    while (*rows && strcmp((*rows)->id, id) != 0) {
        rows++;
    }
    assert_non_null(*rows);
    return *rows;
}

/* The section of one job (malloc). */
static char *section_of(const char *process, const char *results)
{
    const struct report_job job = {.id = "job-1", .process = process};
    json_t *document = json_loads(results, 0, NULL);
    struct report_methods methods;
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);

    assert_non_null(document);
    assert_non_null(out);
    assert_true(report_methods_open(&methods));
    report_methods_add(&methods, &job, document, find(process));
    assert_true(report_methods_close(&methods, out));
    assert_int_equal(fclose(out), 0);
    json_decref(document);
    return text;
}

/* Whether it has each of the texts of `with`, and none of those of `without`, up to a NULL. */
static void says(const char *process, const char *results, const char *const *with,
                 const char *const *without)
{
    char *text = section_of(process, results);

    for (size_t i = 0; with[i]; i++) {
        if (!strstr(text, with[i])) {
            fail_msg("%s does not say \"%s\": %s", process, with[i], text);
        }
    }
    for (size_t i = 0; without[i]; i++) {
        if (strstr(text, without[i])) {
            fail_msg("%s says \"%s\": %s", process, without[i], text);
        }
    }
    free(text);
}
#define LIST(...) ((const char *const[]){__VA_ARGS__, NULL})
#define NOTHING ((const char *const[]){NULL})

/* Permutations are those that were taken, not those that were asked for. */
static void test_permutations(void **state)
{
    (void)state;
    says("change",
         "{\"inputs\":{\"permutations\":2000},\"permutations\":511,\"relabellings\":512,"
         "\"exact\":true,\"individual\":{\"value\":1}}",
         LIST("All 512 flips of signs were taken, the observed one among them."),
         LIST("2000 permutations", "There were 511"));
    says("change",
         "{\"inputs\":{\"permutations\":200},\"permutations\":200,\"relabellings\":512,"
         "\"exact\":false,\"individual\":{\"value\":1}}",
         LIST("There were 200 flips of signs."), LIST("512", "All"));
    says("compare-groups",
         "{\"inputs\":{\"permutations\":10000},\"permutations\":34,\"relabellings\":35,"
         "\"exact\":true}",
         LIST("All 35 different relabellings were taken, the observed one among them."),
         LIST("10000 permutations"));
    says("regress",
         "{\"inputs\":{\"permutations\":99,\"bootstraps\":100},\"permutations\":99,"
         "\"relabellings\":720,\"exact\":false,\"terms\":[{\"name\":\"age\",\"level\":\"exact\"}]}",
         LIST("There were 99 permutations.", "There were 100 bootstrap samples."), LIST("720"));
    says("classify",
         "{\"inputs\":{\"permutations\":0},\"permutations\":0,\"relabellings\":null,\"exact\":"
         "null}",
         NOTHING, LIST("permutations.", " All "));
}

/* Of slopes signs are flipped, and only of terms residuals permuted; replicates have their own. */
static void test_two_tests(void **state)
{
    (void)state;
    says("trajectories",
         "{\"inputs\":{\"permutations\":99},\"permutations\":99,\"relabellings\":720,\"exact\":"
         "false,\"terms\":[{\"name\":\"label\"}],\"slope\":{\"permutations\":63,\"relabellings\":"
         "64,\"exact\":true}}",
         LIST("All 64 flips of signs of slopes were taken", "There were 99 permutations of terms."),
         LIST("720"));
    says("trajectories",
         "{\"inputs\":{\"permutations\":99},\"permutations\":99,\"relabellings\":720,\"exact\":"
         "false,\"terms\":[],\"slope\":{\"permutations\":63,\"relabellings\":64,\"exact\":true}}",
         LIST("All 64 flips of signs of slopes were taken"), LIST("99 permutations"));
    says("asymmetry",
         "{\"inputs\":{\"permutations\":99},\"permutations\":63,\"relabellings\":64,\"exact\":true,"
         "\"individual\":{\"value\":1},\"replicates\":{\"permutations\":99,\"relabellings\":1e6}}",
         LIST("All 64 flips of signs were taken",
              "There were 99 permutations of measurements within subjects."),
         NOTHING);
}

#define TEMPLATE "\"template: the medoid\",\"registrations to it\""

/* What folds had in common is never said to have been made anew in each of them. */
static void test_folds(void **state)
{
    (void)state;
    says(
        "classify",
        "{\"inputs\":{\"refit\":\"shared\"},\"methods\":{\"srnf-nn\":{\"refitted\":[],\"shared\":"
        "[" TEMPLATE "]}}}",
        LIST("The method srnf-nn was nearest neighbour by square-root normal fields; made once for "
             "all folds, of all subjects: template (the medoid); registrations to it; nothing was "
             "made anew in a fold."),
        LIST("made anew in each fold"));
    says("classify",
         "{\"inputs\":{\"refit\":\"fold\"},\"methods\":{\"srnf-gauss\":{\"refitted\":[" TEMPLATE
         ",\"mean\"],\"shared\":[]}}}",
         LIST("srnf-gauss was normal distributions",
              "made anew in each fold, without the subject "
              "that was left out: template (the medoid); registrations to it; mean."),
         LIST("made once", "nothing"));
    says("classify-parts",
         "{\"inputs\":{},\"methods\":{\"srm-nn\":{\"refitted\":[],\"shared\":[" TEMPLATE "]}}}",
         LIST("square-root maps; made once"), LIST("made anew in each fold"));
    says("classify",
         "{\"inputs\":{},\"methods\":{\"icp-nn\":{\"refitted\":[],\"shared\":[\"distances between "
         "pairs\"]}}}",
         LIST("icp-nn was nearest neighbour by closest points; made once for all folds, of all "
              "subjects: distances between pairs; nothing was made anew in a fold."),
         LIST("template", "components"));
}

/* What counts beside shape is told by what the result says of it, not by the input covariates. */
static void test_numbers(void **state)
{
    (void)state;
    says("train",
         "{\"inputs\":{\"scale\":\"shape-and-size\",\"covariates\":[\"EF\"],\"method\":"
         "\"srnf-nn\",\"priors\":\"equal\"},\"features\":[\"size\",\"EF\"],\"refitted\":[" TEMPLATE
         "]}",
         LIST("Beside shape these numbers counted: size, EF.", "Priors of the classes were equal.",
              "The method srnf-nn was nearest neighbour by square-root normal fields; made anew in "
              "each fold"),
         LIST("Covariates were"));
    says("train", "{\"inputs\":{\"scale\":\"shape\",\"priors\":\"cohort\"},\"features\":[]}",
         LIST("Shape alone counted, without size.",
              "Priors of the classes were their shares among the subjects."),
         LIST("Beside shape", "equal"));
    says("compare-groups", "{\"inputs\":{\"covariates\":[]},\"regressedOut\":[]}", NOTHING,
         LIST("Covariates were", "Regressed out", "Priors", "The method"));
}

/* What compares no square-root normal fields is not said to; what warps nothing names no warp. */
static void test_metrics(void **state)
{
    (void)state;
    says("distances", "{\"inputs\":{\"metric\":\"srnf\",\"register\":true}}",
         LIST("pair by pair after elastic registration.",
              "Distances were the L2 distance of their "
              "square-root normal fields (SRNFs).",
              "ECCV 2014"),
         LIST("not registered"));
    says("distances", "{\"inputs\":{\"metric\":\"srm\",\"register\":false}}",
         LIST("Shapes were not registered, but compared as they are parameterized.",
              "square-root maps"),
         LIST("elastic registration", "normal fields", "ECCV"));
    says("distances", "{\"inputs\":{\"metric\":\"harmonic\",\"register\":true}}",
         LIST("pair by pair. Distances were the L2 distance of the surfaces as parameterized"),
         LIST("elastic", "normal fields", "ECCV"));
    says("distances", "{\"inputs\":{\"metric\":\"icp\",\"register\":false}}",
         LIST("closest points"), LIST("elastic", "not registered", "normal fields", "ECCV"));
    says("classify", "{\"inputs\":{},\"methods\":{\"harmonic-nn\":{},\"icp-nn\":{}}}",
         LIST("harmonic-nn was", "icp-nn was"), LIST("normal fields", "ECCV"));
    says("classify", "{\"inputs\":{},\"methods\":{\"harmonic-nn\":{},\"srnf-nn\":{}}}",
         LIST("ECCV 2014"), NOTHING);
}

#define ROTATED "Registrations rotated nothing, as for shapes that share a pose."

static void test_means(void **state)
{
    (void)state;
    says("mean",
         "{\"inputs\":{\"register\":true,\"commonPose\":true,\"maxIterations\":1},\"iterations\":1,"
         "\"converged\":false}",
         LIST("The mean is where it was stopped, after 1 iteration, before it came to rest.",
              ROTATED),
         LIST("Karcher"));
    says(
        "pca",
        "{\"inputs\":{\"register\":true,\"commonPose\":false},\"iterations\":6,\"converged\":true}",
        LIST("The mean, a Karcher mean, came to rest in 6 iterations."), LIST("pose", "stopped"));
    says(
        "compare-groups",
        "{\"inputs\":{\"register\":false,\"commonPose\":true},\"iterations\":2,\"converged\":true}",
        LIST("Shapes were not registered"), LIST("pose"));
    says("mean",
         "{\"inputs\":{\"method\":\"pullback\"},\"iterations\":6,\"converged\":false,\"pullback\":"
         "{\"iterations\":3,\"converged\":false}}",
         LIST("pull back to surfaces was sought. The mean is where it was stopped, after 3"),
         LIST("Karcher"));
}

/* Lengths with and without size differ by more than twice, so which they are is told. */
static void test_scale(void **state)
{
    static const char *const processes_told[] = {"change", "asymmetry", "trajectories"};

    (void)state;
    for (size_t i = 0; i < 3; i++) {
        says(processes_told[i], "{\"inputs\":{\"scale\":\"shape\"},\"individual\":{},\"slope\":{}}",
             LIST("Size was taken out: the surfaces of each subject were brought to one area, at "
                  "their mean size."),
             LIST("as large as"));
        says(processes_told[i],
             "{\"inputs\":{\"scale\":\"shape-and-size\"},\"individual\":{},\"slope\":{}}",
             LIST("Surfaces were as large as they are, so that size counts."), LIST("taken out"));
    }
    says("train", "{\"inputs\":{\"scale\":\"shape\"},\"features\":[]}", NOTHING,
         LIST("taken out", "as large as"));
}

/* Covariates that are regressed out are said to be, with what that means for the level. */
static void test_levels(void **state)
{
    (void)state;
    says("compare-groups",
         "{\"inputs\":{\"covariates\":[\"S\",\"E\"]},\"regressedOut\":[\"S\",\"E\"],\"level\":"
         "\"asymptotic\"}",
         LIST("Regressed out were S, E: what the model without groups leaves was permuted "
              "(Freedman and Lane).",
              "The level of the test is asymptotic"),
         LIST("Covariates were"));
    says("regress",
         "{\"inputs\":{},\"terms\":[{\"name\":\"age\",\"level\":\"asymptotic\"},{\"name\":\"x\","
         "\"level\":\"exact\"},{\"name\":\"sex\",\"level\":\"asymptotic\"}]}",
         LIST("The level is asymptotic of the test of age, sex: it holds in the limit of many "
              "subjects."),
         NOTHING);
    says("compare-groups", "{\"inputs\":{},\"regressedOut\":[],\"level\":\"exact\"}", NOTHING,
         LIST("asymptotic", "Regressed"));
}

/* A path is what its method makes of it. */
static void test_paths(void **state)
{
    (void)state;
    says("geodesic", "{\"inputs\":{\"method\":\"linear\"},\"times\":[0,1]}",
         LIST("It is the straight line between the surfaces themselves."), LIST("inverted"));
    says("geodesic", "{\"inputs\":{\"method\":\"pullback\"},\"times\":[0,1]}",
         LIST("It is the geodesic in the space of surfaces"), LIST("inverted"));
    says("geodesic", "{\"inputs\":{\"method\":\"srnf\"},\"times\":[0,1]}",
         LIST("each point of which was inverted numerically."), NOTHING);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_paths),     cmocka_unit_test(test_permutations),
        cmocka_unit_test(test_two_tests), cmocka_unit_test(test_folds),
        cmocka_unit_test(test_numbers),   cmocka_unit_test(test_metrics),
        cmocka_unit_test(test_means),     cmocka_unit_test(test_levels),
        cmocka_unit_test(test_scale),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
