/*
 * arrays.c - arrays of pilots from their intent to their end.
 *
 *   intended --sbatch answers, or squeue shows the name--> submitted --> ending --> (no row)
 *
 * The row is written before sbatch runs. Where it is not known whether sbatch has done its work (it
 * was killed, or the daemon was), the name decides: an array that squeue shows is ours and counts,
 * and one that it has not shown for twice the time that sbatch may take is given up. Even then it
 * is looked for some minutes more, and cancelled should it come to light. So no array is counted
 * twice and none is forgotten.
 *
 * squeue that gives no answer tells nothing: everything stays as it was. An array without elements
 * that wait or run is over. What is given up is cancelled by its number all the same, and from the
 * second in a row it counts as if it ran while it is looked for: a queue that hides its jobs must
 * not be filled.
 */
#include "slurm/internal.h"

#include "clock.h"
#include "log.h"
#include "store/digest.h"

#include <sodium.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DOUBTS 2.0   /* times of a program after which an array that is not shown is given up */
#define WATCHED 20.0 /* the same, after which it is no longer looked for */

/* ---- Rows ------------------------------------------------------------------------------------ */

void slurm_name_prefix(const struct slurm *slurm, char prefix[SLURM_PREFIX_MAX])
{
    (void)snprintf(prefix, SLURM_PREFIX_MAX, "srnfd-%.16s-", slurm->config.installation);
}

static void put(struct slurm *slurm, const struct slurm_array *array)
{
    int status = store_pilots_put(slurm->config.store, &array->row);

    if (status != 0) {
        LOG_ERROR("pilots-not-written", log_text("name", array->row.name),
                  log_text("message", store_strerror(status)));
    }
}

static struct slurm_array *add(struct slurm *slurm, const struct store_pilots *row)
{
    struct slurm_array *array = calloc(1, sizeof *array);

    if (array) {
        array->row = *row;
        array->next = slurm->arrays;
        slurm->arrays = array;
    }
    return array;
}

static void drop(struct slurm *slurm, struct slurm_array *array)
{
    struct slurm_array **link = &slurm->arrays;

    while (*link != array) {
        link = &(*link)->next;
    }
    *link = array->next;
    jobs_pass_drop(slurm->config.jobs, array->row.token);
    (void)store_pilots_drop(slurm->config.store, array->row.name);
    free(array);
}

/* It is a failure of its job, and counts as if it ran. False without memory. */
static bool load_vanished(struct slurm *slurm, struct slurm_array *array)
{
    struct slurm_operation *operation = slurm_operation_of(slurm, array->row.job);

    array->pending = (size_t)array->row.size;
    if (operation) {
        slurm_operation_fail(operation, "an array is not known to it");
    }
    return operation != NULL;
}

int slurm_arrays_load(struct slurm *slurm)
{
    struct store_pilots *rows = NULL;
    char prefix[SLURM_PREFIX_MAX];
    size_t n = 0;
    int status = store_pilots_list(slurm->config.store, &rows, &n);

    slurm_name_prefix(slurm, prefix);
    for (size_t i = 0; status == 0 && i < n; i++) {
        struct slurm_array *array;

        if (strncmp(rows[i].name, prefix, strlen(prefix)) != 0) {
            /* A copy of another installation's data: these arrays are the other's. */
            (void)store_pilots_drop(slurm->config.store, rows[i].name);
            continue;
        }
        array = add(slurm, &rows[i]);
        if (!array ||
            (rows[i].status != STORE_PILOTS_ENDING &&
             !jobs_pass_add(slurm->config.jobs, rows[i].token, rows[i].job)) ||
            (rows[i].vanished && !load_vanished(slurm, array))) {
            status = STORE_NOMEM;
        } else {
            array->doubt =
                clock_now() + (rows[i].vanished ? WATCHED : DOUBTS) * slurm->config.seconds;
        }
    }
    free(rows);
    return status;
}

void slurm_arrays_free(struct slurm *slurm)
{
    while (slurm->arrays) {
        struct slurm_array *array = slurm->arrays;

        slurm->arrays = array->next;
        free(array);
    }
    free(slurm->elements);
    slurm->elements = NULL;
}

void slurm_array_end(struct slurm *slurm, struct slurm_array *array)
{
    array->row.status = STORE_PILOTS_ENDING;
    put(slurm, array);
    jobs_pass_drop(slurm->config.jobs, array->row.token);
}

/* ---- Looking --------------------------------------------------------------------------------- */

/* "--name=A,B,.." (malloc). */
static char *names_of(const struct slurm *slurm)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);

    if (!out) {
        return NULL;
    }
    (void)fputs("--name=", out);
    for (const struct slurm_array *array = slurm->arrays; array; array = array->next) {
        (void)fprintf(out, "%s%s", array == slurm->arrays ? "" : ",", array->row.name);
    }
    if (fclose(out) != 0) {
        free(text);
        text = NULL;
    }
    return text;
}

/* Takes the answer over; false: it is none. */
static bool read_answer(struct slurm *slurm, const struct slurm_answer *answer)
{
    struct slurm_element *elements;
    size_t n;

    if (answer->status != 0) {
        (void)snprintf(slurm->why, sizeof slurm->why, "%s", answer->why);
        return false;
    }
    if (!answer->text || !slurm_queue_read(answer->text, &elements, &n)) {
        (void)snprintf(slurm->why, sizeof slurm->why, "squeue printed what cannot be read");
        return false;
    }
    free(slurm->elements);
    slurm->elements = elements;
    slurm->n_elements = n;
    return true;
}

void slurm_look(struct slurm *slurm)
{
    char *names = slurm->arrays ? names_of(slurm) : NULL;
    const char *const arguments[] = {"squeue", "-h",         "-r",  "-t", "all",
                                     "-o",     SLURM_FORMAT, names, NULL};
    struct slurm_answer answer;
    bool blind;

    slurm->looked = clock_now();
    if (!slurm->arrays) {
        slurm->n_elements = 0;
        slurm->blind = false;
        return;
    }
    if (!names) {
        return;
    }
    slurm_run(&(struct slurm_command){.arguments = arguments,
                                      .seconds = slurm->config.seconds,
                                      .hurry = &slurm->closing},
              &answer);
    blind = !read_answer(slurm, &answer);
    if (blind && !slurm->blind) {
        LOG_WARN("slurm-silent", log_text("message", slurm->why));
    } else if (!blind && slurm->blind) {
        LOG("slurm-answers", log_text("message", "squeue is answered again"));
    }
    slurm->blind = blind;
    slurm_answer_clear(&answer);
    free(names);
}

/* ---- What a look means ----------------------------------------------------------------------- */

/* Of an element that has ended: whether that is worth telling. */
static bool ended_badly(const struct slurm_element *element)
{
    return element->state == SLURM_ENDED && strcmp(element->word, "COMPLETED") != 0 &&
           strcmp(element->word, "CANCELLED") != 0;
}

static void count(const struct slurm *slurm, struct slurm_array *array)
{
    array->pending = array->running = array->leaving = array->delayed = 0;
    for (size_t i = 0; i < slurm->n_elements; i++) {
        const struct slurm_element *element = &slurm->elements[i];

        if (strcmp(element->name, array->row.name) != 0) {
            continue;
        }
        array->seen = true;
        array->pending += element->state == SLURM_PENDING;
        array->running += element->state == SLURM_RUNNING;
        array->ran = array->ran || element->state == SLURM_RUNNING;
        array->leaving += element->state == SLURM_LEAVING;
        if (element->state == SLURM_PENDING) {
            array->delayed += array->ran && strcmp(element->reason, "BeginTime") == 0;
            memcpy(array->reason, element->reason, sizeof array->reason);
        }
        if (ended_badly(element)) {
            (void)snprintf(array->ended, sizeof array->ended, "%s (%s)", element->word,
                           element->reason);
        }
        if (!array->row.number[0]) {
            (void)snprintf(array->row.number, sizeof array->row.number, "%.*s",
                           (int)strcspn(element->id, "_"), element->id);
        }
    }
}

static void tell_ended(const struct slurm_array *array, struct slurm_operation *operation)
{
    if (array->spent) {
        (void)snprintf(operation->trouble, sizeof operation->trouble,
                       "a pilot ran out of memory, the next get %lld MiB",
                       (long long)operation->memory);
    } else if (array->ended[0]) {
        (void)snprintf(operation->trouble, sizeof operation->trouble, "a pilot ended: %s",
                       array->ended);
    }
    if (array->ended[0]) {
        operation->refused = false;
    }
}

/* No element waits or runs. */
static void settle_over(struct slurm *slurm, struct slurm_array *array,
                        struct slurm_operation *operation)
{
    bool idle = operation->waits && operation->done <= array->done && !array->cut;

    LOG("pilots-over", log_text("job", array->row.job), log_text("name", array->row.name),
        log_text("ended", array->ended));
    if (idle) {
        char trouble[SLURM_WHY_MAX];

        (void)snprintf(trouble, sizeof trouble, "%s",
                       operation->trouble[0] ? operation->trouble : "pilots ended without a task");
        LOG_WARN("pilots-did-nothing", log_text("job", array->row.job),
                 log_text("name", array->row.name), log_text("ended", array->ended));
        slurm_operation_fail(operation, trouble);
    } else {
        operation->failures = 0;
    }
    drop(slurm, array);
}

/* It is not shown, and should be. */
static void settle_unseen(struct slurm *slurm, struct slurm_array *array,
                          struct slurm_operation *operation)
{
    bool submitted = array->row.status == STORE_PILOTS_SUBMITTED;
    bool refused = array->row.status == STORE_PILOTS_INTENDED && array->doubt <= 0.0;

    if (slurm->looked < array->doubt) {
        /* sbatch may still be at work. What it took may not be shown yet, and is not to be asked
           for twice. */
        array->pending = submitted ? (size_t)array->row.size : 0;
        return;
    }
    if (!refused) {
        LOG_WARN("pilots-vanished", log_text("job", array->row.job),
                 log_text("name", array->row.name), log_text("number", array->row.number));
        slurm_operation_fail(operation, "an array is not known to it");
        array->row.vanished = true;
        slurm_array_end(slurm, array);
        array->doubt = clock_now() + WATCHED * slurm->config.seconds;
        array->pending = (size_t)array->row.size;
    } else {
        drop(slurm, array);
    }
}

static void settle_one(struct slurm *slurm, struct slurm_array *array)
{
    struct slurm_operation *operation = slurm_operation_of(slurm, array->row.job);
    bool submitted;

    if (!operation) {
        return;
    }
    count(slurm, array);
    if (array->seen && array->row.status == STORE_PILOTS_INTENDED) {
        array->row.status = STORE_PILOTS_SUBMITTED;
        put(slurm, array);
        LOG("pilots-adopted", log_text("job", array->row.job), log_text("name", array->row.name),
            log_text("number", array->row.number));
    }
    submitted = array->row.status == STORE_PILOTS_SUBMITTED;
    if (submitted) {
        slurm_memory_note(slurm, array, operation);
        tell_ended(array, operation);
    }
    if (array->pending + array->running + array->leaving > 0) {
        return;
    }
    if (array->row.status == STORE_PILOTS_ENDING) {
        if (array->seen || slurm->looked >= array->doubt) {
            drop(slurm, array);
        } else if (array->row.vanished) {
            array->pending = (size_t)array->row.size;
        }
    } else if (array->seen) {
        settle_over(slurm, array, operation);
    } else {
        settle_unseen(slurm, array, operation);
    }
}

void slurm_settle(struct slurm *slurm)
{
    for (struct slurm_array *array = slurm->arrays, *next; array && !slurm->blind; array = next) {
        next = array->next;
        settle_one(slurm, array);
    }
}

/* ---- Submitting ------------------------------------------------------------------------------ */

static void make_token(char token[JOBS_PASS_SIZE])
{
    unsigned char bytes[32];
    size_t prefix = sizeof JOBS_PASS_PREFIX - 1;

    randombytes_buf(bytes, sizeof bytes);
    memcpy(token, JOBS_PASS_PREFIX, prefix);
    (void)sodium_bin2base64(token + prefix, JOBS_PASS_SIZE - prefix, bytes, sizeof bytes,
                            sodium_base64_VARIANT_URLSAFE_NO_PADDING);
    sodium_memzero(bytes, sizeof bytes);
}

/* "123" or "123;cluster", a line. */
static bool read_number(const char *text, char number[STORE_PILOTS_NUMBER_MAX])
{
    size_t digits = text ? strspn(text, "0123456789") : 0;

    if (digits == 0 || digits >= STORE_PILOTS_NUMBER_MAX ||
        (text[digits] != '\n' && text[digits] != ';')) {
        return false;
    }
    (void)snprintf(number, STORE_PILOTS_NUMBER_MAX, "%.*s", (int)digits, text);
    return true;
}

/* What sbatch has said of an array whose row is written. */
static void conclude(struct slurm *slurm, struct slurm_array *array,
                     struct slurm_operation *operation, const struct slurm_answer *answer)
{
    if (answer->status == 0 && read_number(answer->text, array->row.number)) {
        array->row.status = STORE_PILOTS_SUBMITTED;
        array->doubt = clock_now() + DOUBTS * slurm->config.seconds;
        array->pending = (size_t)array->row.size;
        operation->pending += array->pending;
        if (operation->refused) {
            operation->trouble[0] = '\0';
            operation->refused = false;
        }
        LOG("pilots-submitted", log_text("job", array->row.job), log_text("name", array->row.name),
            log_text("number", array->row.number), log_number("size", (double)array->row.size),
            log_number("memory", (double)array->row.memory));
        put(slurm, array);
        return;
    }
    slurm_operation_fail(operation,
                         answer->status == 0 ? "sbatch printed what cannot be read" : answer->why);
    operation->refused = true;
    if (answer->ended && answer->status != 0) {
        array->doubt = 0.0; /* the next look tells */
        LOG_WARN("sbatch-refused", log_text("job", array->row.job),
                 log_text("name", array->row.name), log_text("message", answer->why));
    } else {
        array->doubt = clock_now() + DOUBTS * slurm->config.seconds;
        LOG_WARN("sbatch-unclear", log_text("job", array->row.job),
                 log_text("name", array->row.name), log_text("message", operation->trouble));
    }
}

/* The intent, with the digest of the token. NULL: it could not be written. */
static struct slurm_array *intend(struct slurm *slurm, struct slurm_operation *operation,
                                  size_t size, const char *token)
{
    struct store_pilots row = {.status = STORE_PILOTS_INTENDED,
                               .attempt = operation->attempt + 1,
                               .size = (int64_t)size,
                               .memory = operation->memory};
    struct slurm_array *array = NULL;
    char prefix[SLURM_PREFIX_MAX];

    slurm_name_prefix(slurm, prefix);
    (void)snprintf(row.job, sizeof row.job, "%s", operation->job);
    (void)snprintf(row.name, sizeof row.name, "%s%.40s-%lld-%s", prefix, operation->job,
                   (long long)row.attempt, slurm->start);
    store_sha256_hex(row.token, token, strlen(token));
    if (store_pilots_put(slurm->config.store, &row) == 0) {
        array = add(slurm, &row);
        if (array && !jobs_pass_add(slurm->config.jobs, row.token, row.job)) {
            drop(slurm, array);
            array = NULL;
        }
    }
    if (array) {
        operation->attempt = row.attempt;
        array->done = operation->done;
    }
    return array;
}

void slurm_submit(struct slurm *slurm, struct slurm_operation *operation, size_t size)
{
    struct slurm_arguments *arguments = calloc(1, sizeof *arguments);
    char token[JOBS_PASS_SIZE], message[SLURM_WHY_MAX] = "the intent could not be written";
    struct slurm_array *array;
    struct slurm_answer answer;
    char *script = NULL;

    make_token(token);
    array = arguments ? intend(slurm, operation, size, token) : NULL;
    if (array) {
        script = slurm_script(&slurm->config, token, message, sizeof message);
    }
    if (array && script) {
        slurm_submit_arguments(&slurm->config, &array->row, arguments);
        slurm_run(&(struct slurm_command){.arguments = arguments->list,
                                          .input = script,
                                          .seconds = slurm->config.seconds,
                                          .hurry = &slurm->closing},
                  &answer);
        conclude(slurm, array, operation, &answer);
        slurm_answer_clear(&answer);
        sodium_memzero(script, strlen(script));
    } else {
        if (array) {
            drop(slurm, array);
        }
        LOG_ERROR("pilots-not-asked-for", log_text("job", operation->job),
                  log_text("message", message));
        slurm_operation_fail(operation, message);
    }
    sodium_memzero(token, sizeof token);
    free(script);
    free(arguments);
}
