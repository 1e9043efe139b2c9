/*
 * score_inputs.c - the inputs of the process score that say what is expected of the surface: a
 * formula over the covariates of the model's members, and the surface's own.
 *
 * The members' covariates are those of the cohort that the model was made of, as they are now: the
 * canonical covariates hold the design that they make, so that changed ones are another question.
 */
#include "processes/score.h"

#include <string.h>

#include "api/cohorts.h"
#include "api/models.h"
#include "store/cohort.h"
#include "toolkit/group.h"

#define SUBJECTS_BESIDE ((size_t)4) /* the coefficients: see srnf/norms.h */

/* ---- Formula and covariates ------------------------------------------------------------------ */

static void read_formula(struct process_inputs *inputs, const struct process_input *input)
{
    const json_t *value = json_object_get(inputs->given, input->name);
    const char *text = json_string_value(value);
    struct formula *formula = srnf_alloc(1, sizeof *formula);
    char problem[FORMULA_PROBLEM_MAX];

    if (!formula) {
        json_memory_fail();
    } else if (!value || json_is_null(value)) {
        (void)json_object_set_new(inputs->canonical, input->name, json_null());
    } else if (!text) {
        problem_add(inputs->list, "/inputs/formula", "must be a formula, as shape ~ age, or null");
    } else if (!formula_parse(text, formula, problem)) {
        problem_add(inputs->list, "/inputs/formula", "%s", problem);
    } else {
        (void)json_object_set_new(inputs->canonical, input->name, json_string(text));
    }
    srnf_free(formula);
}

static bool type_formula(const json_t *value, void *member)
{
    struct score_expected *expected = member;

    expected->given = json_is_string(value);
    return expected->given || json_is_null(value);
}

const struct input_own score_formula = {
    .schema = "\"type\":[\"string\",\"null\"],\"minLength\":3,\"maxLength\":" PROCESS_TEXT(
        FORMULA_TEXT_MAX) ",\"default\":null",
    .read = read_formula,
    .type = type_formula,
};

static void read_covariates(struct process_inputs *inputs, const struct process_input *input)
{
    json_t *value = json_object_get(inputs->given, input->name);

    if (value && !json_is_object(value)) {
        problem_add(inputs->list, "/inputs/covariates",
                    "must be an object of covariates and their values");
        return;
    }
    (void)json_object_set_new(inputs->canonical, input->name,
                              value ? json_deep_copy(value) : json_object());
}

/* Of what score_describe has made of it; without a formula it is empty. */
static bool type_covariates(const json_t *value, void *member)
{
    struct score_expected *expected = member;
    const json_t *design = json_object_get(value, "design");
    size_t n = json_array_size(json_object_get(design, "rows"));

    if (!design) {
        return json_is_object(value);
    }
    expected->canonical = json_deep_copy(value);
    expected->told = json_object_get(expected->canonical, "design");
    return expected->canonical && design_type(design, n, &expected->design);
}

static void clear_covariates(void *member)
{
    struct score_expected *expected = member;

    design_clear(&expected->design);
    json_decref(expected->canonical);
    expected->canonical = expected->told = NULL;
}

/* The result has what was given, completed. */
static void echo_covariates(json_t *value)
{
    json_t *at =
        json_incref(json_array_get(json_object_get(json_object_get(value, "design"), "at"), 0));

    if (at) {
        (void)json_object_clear(value);
        (void)json_object_update(value, at);
    }
    json_decref(at);
}

const struct input_own score_covariates = {
    .schema = "\"type\":\"object\",\"default\":{}",
    .read = read_covariates,
    .type = type_covariates,
    .clear = clear_covariates,
    .echo = echo_covariates,
};

/* ---- The members of the model in its cohort -------------------------------------------------- */

/* The first member of that id that is not taken yet, or their number. */
static size_t find_member(const json_t *members, const char *id, const bool *taken)
{
    size_t i = 0;

    while (i < json_array_size(members)) {
        const char *own = json_string_value(json_object_get(json_array_get(members, i), "id"));

        if (!taken[i] && own && strcmp(own, id) == 0) {
            break;
        }
        i++;
    }
    return i;
}

/* The members of the cohort in the order of the model's, of several structures those of the first;
   NULL with a problem noted. */
static json_t *align(struct process_inputs *given, const json_t *surfaces, size_t subjects,
                     const json_t *members, const char *cohort)
{
    size_t n = json_array_size(members);
    bool *taken = srnf_alloc(n ? n : 1, sizeof *taken);
    json_t *aligned = json_array();

    if (!taken) {
        json_memory_fail();
    }
    for (size_t i = 0; taken && i < subjects; i++) {
        const char *id = json_string_value(json_array_get(surfaces, i));
        size_t at = find_member(members, id ? id : "", taken);

        if (at == n) {
            problem_add(given->list, "/inputs/formula",
                        "member %zu of the model, %.40s, is not in the cohort %.60s any more, "
                        "which has the covariates: make the model of it again",
                        i, id ? id : "?", cohort);
            json_decref(aligned);
            aligned = NULL;
            break;
        }
        taken[at] = true;
        (void)json_array_append(aligned, json_array_get(members, at));
    }
    srnf_free(taken);
    return aligned;
}

static json_t *find_members(struct process_inputs *given, const json_t *made, size_t n)
{
    const json_t *name = json_object_get(made, "cohort");
    struct store_cohort cohort = {.record = NULL};
    json_t *members = NULL, *aligned = NULL;

    if (!json_is_string(name)) {
        problem_add(given->list, "/inputs/formula",
                    "needs covariates of the model's members, and the model was made of surfaces, "
                    "which have none: make it of a cohort");
    } else if (group_find_cohort(given, name, &cohort)) {
        members = cohort_members(&cohort);
        aligned =
            align(given, json_object_get(made, "surfaces"), n, members, json_string_value(name));
    }
    json_decref(members);
    store_cohort_clear(&cohort);
    return aligned;
}

/* ---- What holds between them ----------------------------------------------------------------- */

/* Whether all components are kept, without which nothing can be predicted of the members. */
static bool check_complete(struct process_inputs *given, struct store_model *model,
                           const json_t *record)
{
    const struct srnf_pca pca = {.n = (size_t)model->subjects,
                                 .components = (size_t)model->components,
                                 .eigenvalues = model->arrays[STORE_MODEL_EIGENVALUES]};
    double total = json_number_value(json_object_get(record, "totalVariance"));
    bool complete = false;

    (void)srnf_pca_kept_variance(&pca, total, &complete);
    if (!complete || !(total > 0.0)) {
        problem_add(given->list, "/inputs/formula",
                    "needs all components of the members, and the model keeps %zu: make it again "
                    "without the input components",
                    pca.components);
        return false;
    }
    return true;
}

/* The covariates of the surface must be those of the formula, all of them. */
static bool check_covariates(struct process_inputs *given, const struct formula *formula,
                             const json_t *covariates)
{
    bool good = true;

    for (size_t f = 0; f < formula->factors; f++) {
        bool used = false;

        for (size_t t = 0; t < formula->terms; t++) {
            used = used || formula->term[t] >> f & 1;
        }
        if (used && !json_object_get(covariates, formula->factor[f].name)) {
            problem_add(given->list, "/inputs/covariates",
                        "has no \"%.60s\", which the formula "
                        "names",
                        formula->factor[f].name);
            good = false;
        }
    }
    return good;
}

/* A column that tells one subject from all others predicts nothing of it from them. */
static void check_each(struct process_inputs *given, const json_t *design, const size_t *subjects)
{
    const json_t *rows = json_object_get(design, "rows"),
                 *names = json_object_get(design, "columns");
    size_t n = json_array_size(rows), m = json_array_size(names);
    double *values = srnf_alloc(m * n + 1, sizeof *values);
    enum srnf_covariate *verdicts = srnf_alloc(m + 1, sizeof *verdicts);
    bool good = values && verdicts;

    for (size_t i = 0; good && i < n && given->list->count == 0; i++) {
        size_t inside = 0, count = 0;

        for (size_t k = 0; k < n; k++) {
            count += subjects[k] != subjects[i];
        }
        for (size_t k = 0; k < n; k++) {
            for (size_t c = 0; c < m && subjects[k] != subjects[i]; c++) {
                values[c * count + inside] =
                    json_number_value(json_array_get(json_array_get(rows, k), c));
            }
            inside += subjects[k] != subjects[i];
        }
        good = srnf_covariates_check(m, count, values, verdicts) == 0;
        for (size_t c = 0; good && c < m && given->list->count == 0; c++) {
            if (verdicts[c] != SRNF_COVARIATE_FREE) {
                problem_add(given->list, "/inputs/formula",
                            "the column %.120s cannot be told without the subject of member %zu: "
                            "the others do not differ in it beside the columns before it",
                            json_string_value(json_object_get(json_array_get(names, c), "name")),
                            i);
            }
        }
    }
    if (!values || !verdicts) {
        json_memory_fail();
    }
    srnf_free(values);
    srnf_free(verdicts);
}

static void describe(struct process_inputs *given, struct store_model *model,
                     const struct formula *formula)
{
    json_t *covariates = json_object_get(given->canonical, "covariates"), *point, *members = NULL;
    json_t *record = json_loads(model->record ? model->record : "{}", 0, NULL);
    json_t *made = json_object_get(record, "madeFrom");
    size_t n = (size_t)model->subjects, count = 0, largest;
    size_t *subjects =
        group_subject_numbers(json_object_get(made, "subjects"), n, &count, &largest);

    if (!subjects) {
        json_memory_fail();
    } else if (check_complete(given, model, record) &&
               check_covariates(given, formula, covariates)) {
        members = find_members(given, made, n);
    }
    if (members) {
        point = json_pack("[o]", json_deep_copy(covariates));
        (void)json_object_clear(covariates);
        design_describe(given, formula, members, covariates, point, "/inputs/covariates");
        json_decref(point);
    }
    if (members && given->list->count == 0) {
        const json_t *design = json_object_get(covariates, "design");
        size_t columns = json_array_size(json_object_get(design, "columns"));

        if (count < SUBJECTS_BESIDE + columns) {
            problem_add(given->list, "/inputs/formula",
                        "has %zu columns; that needs %zu subjects, and the model has %zu", columns,
                        SUBJECTS_BESIDE + columns, count);
        } else {
            check_each(given, design, subjects);
        }
    }
    json_decref(members);
    json_decref(record);
    srnf_free(subjects);
}

static void describe_expected(struct process_inputs *given)
{
    const char *id = json_string_value(json_object_get(given->canonical, "model"));
    const char *text = json_string_value(json_object_get(given->canonical, "formula"));
    const json_t *covariates = json_object_get(given->canonical, "covariates");
    struct formula *formula = srnf_alloc(1, sizeof *formula);
    struct store_model model = {.record = NULL};
    char problem[FORMULA_PROBLEM_MAX];

    if (!formula) {
        json_memory_fail();
    } else if (!text && json_object_size(covariates) > 0) {
        problem_add(given->list, "/inputs/covariates",
                    "are of no use without a formula, as shape ~ age");
    } else if (text && id && formula_parse(text, formula, problem) &&
               store_model_get_as(given->call->api->config.store, given->call->request->caller.name,
                                  id, 1u << STORE_MODEL_EIGENVALUES, &model) == 0) {
        describe(given, &model, formula);
    }
    store_model_clear(&model);
    srnf_free(formula);
}

void score_describe(struct process_inputs *given)
{
    subject_check(given);
    if (!given->list->errors) {
        describe_expected(given);
    }
}
