/*
 * job_filters.c - the parameters of the list of jobs that OGC API - Processes 1.0 defines
 * (/req/job-list/..): ?type=, ?processID=, ?status=, ?datetime=, ?minDuration= and
 * ?maxDuration=.
 *
 * The first three are lists: with commas, or given several times, as OpenAPI writes arrays. All
 * jobs here are of the type process. A time is an instant, or two of them with a slash, of which
 * one may be open ("..", or nothing); an instant that says no fraction is its whole second, and a
 * date its whole day. Durations are whole seconds, bounds included. A job has one from its
 * beginning on.
 */
#include "api/lists.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/near.h"
#include "api/routes.h"
#include "store/job.h"
#include "store/store.h"

#define SECOND_MS 1000
#define DAY_MS ((int64_t)86400 * SECOND_MS)
#define DURATION_LONGEST ((int64_t)1 << 53)

/* ---- Lists ----------------------------------------------------------------------------------- */

/* Whether there are no more words, and no longer ones, than the description allows. */
static bool fits(const char *words)
{
    size_t count = 1, length = 0;

    for (; *words; words++) {
        if (*words == ',') {
            count++;
            length = 0;
        } else if (((unsigned char)*words & 0xc0) != 0x80) { /* a character begins */
            length++;
        }
        if (count > LIST_ITEMS_MAX || length > LIST_ITEM_MAX) {
            return false;
        }
    }
    return true;
}

static bool refuse_words(struct api_call *call, const char *name)
{
    char pointer[24], detail[96];

    (void)snprintf(pointer, sizeof pointer, "/%s", name);
    (void)snprintf(detail, sizeof detail,
                   "%s must have at most %d values of at most %d characters.", name, LIST_ITEMS_MAX,
                   LIST_ITEM_MAX);
    return list_refuse(call, pointer, detail);
}

/* All that is given under the name, with commas between; *given is NULL where nothing is. False
   when a problem was answered. */
static bool read_words(struct api_call *call, const char *name, char words[LIST_WORDS_MAX],
                       const char **given)
{
    const char *cursor = call->request->query;
    size_t used = 0, length = strlen(name);
    struct query_pair pair;

    *given = NULL;
    while (query_next(&cursor, &pair)) {
        if (pair.name_length != length || strncmp(pair.name, name, length) != 0) {
            continue;
        }
        used += *given ? 1 : 0;
        if (used >= LIST_WORDS_MAX) {
            return refuse_words(call, name);
        }
        if (!percent_decode(pair.value, pair.value_length, true, words + used,
                            LIST_WORDS_MAX - used)) {
            (void)problem_respond(call, "malformed-request",
                                  "The query parameter %s is too long or not well escaped.", name);
            return false;
        }
        if (*given) {
            words[used - 1] = ',';
        }
        used += strlen(words + used);
        *given = words;
    }
    return !*given || fits(words) || refuse_words(call, name);
}

/* The first word that is none of those known, into word; false: all are. */
static bool find_unknown(const char *words, const char *const *known, char word[64])
{
    for (;;) {
        size_t length = strcspn(words, ","), i = 0;

        (void)snprintf(word, 64, "%.*s", (int)length, words);
        while (known[i] && strcmp(known[i], word) != 0) {
            i++;
        }
        if (!known[i]) {
            return true;
        }
        if (!words[length]) {
            return false;
        }
        words += length + 1;
    }
}

static bool read_type(struct api_call *call, struct store_page *page)
{
    char words[LIST_WORDS_MAX];
    const char *given;

    if (!read_words(call, "type", words, &given)) {
        return false;
    }
    page->nothing = given && !list_has_exactly(given, "process");
    return true;
}

static bool read_process_id(struct api_call *call, struct list_filters *filters,
                            struct store_page *page)
{
    const char *known[API_PROCESSES_MAX], *given;
    char words[LIST_WORDS_MAX], word[64];

    if (!read_words(call, "processID", words, &given) || !given) {
        return !given;
    }
    if (page->process) {
        return list_refuse(call, "/processID", "processID and process are the same: give one.");
    }
    api_process_names(call->api, known);
    if (find_unknown(given, known, word)) {
        return list_refuse_unknown(call, "processID", word, known);
    }
    memcpy(filters->process, words, sizeof words);
    page->process = filters->process;
    return true;
}

static bool read_status(struct api_call *call, struct list_filters *filters,
                        struct store_page *page)
{
    const char *known[STORE_JOB_DISMISSED + 2] = {NULL};
    char word[64];

    for (int i = STORE_JOB_ACCEPTED; i <= STORE_JOB_DISMISSED; i++) {
        known[i] = store_job_status_name((enum store_job_status)i);
    }
    if (!read_words(call, "status", filters->status, &page->status)) {
        return false;
    }
    return !page->status || !find_unknown(page->status, known, word) ||
           list_refuse_unknown(call, "status", word, known);
}

/* ---- Times ----------------------------------------------------------------------------------- */

/* The ms from an instant on that it stands for, and their number. */
static bool read_instant(const char *text, int64_t *ms, int64_t *span)
{
    *span = strlen(text) == 10 ? DAY_MS : strchr(text, '.') ? 1 : SECOND_MS;
    return list_time(text, ms);
}

/* The part of an interval: *ms is 0 where it is open. */
static bool read_end(const char *text, int64_t *ms, int64_t *span)
{
    *ms = *span = 0;
    return !text[0] || strcmp(text, "..") == 0 || read_instant(text, ms, span);
}

static bool read_datetime(struct api_call *call, struct store_page *page)
{
    char text[96], *slash;
    int64_t from, to, span;
    bool refused = false, good;

    if (!query_get(call, "datetime", text, sizeof text, &refused)) {
        return !refused;
    }
    slash = strchr(text, '/');
    if (!slash) {
        good = read_instant(text, &from, &span);
        to = good ? from : 0;
    } else {
        *slash = '\0';
        good = read_end(text, &from, &span) && read_end(slash + 1, &to, &span) && (from || to) &&
               (!from || !to || from < to + span);
    }
    if (!good) {
        return list_refuse(call, "/datetime",
                           "datetime must be an instant of RFC 3339, such as "
                           "2026-01-31T12:00:00Z, or two in their order with a slash between, of "
                           "which one may be \"..\".");
    }
    if (from > page->since_ms) {
        page->since_ms = from;
    }
    if (to && (page->until_ms == 0 || to + span < page->until_ms)) {
        page->until_ms = to + span;
    }
    return true;
}

/* ---- Durations ------------------------------------------------------------------------------- */

static bool read_seconds(struct api_call *call, const char *name, struct store_page *page,
                         int64_t *ms)
{
    char text[24], pointer[24], detail[80];
    bool refused = false;
    long number;

    if (!query_get(call, name, text, sizeof text, &refused)) {
        return !refused;
    }
    if (!query_whole(text, &number)) {
        (void)snprintf(pointer, sizeof pointer, "/%s", name);
        (void)snprintf(detail, sizeof detail, "%s must be a whole number of seconds.", name);
        return list_refuse(call, pointer, detail);
    }
    page->by_duration = true;
    *ms = (int64_t)number * SECOND_MS;
    return true;
}

static bool read_durations(struct api_call *call, struct store_page *page)
{
    page->shortest_ms = 0;
    page->longest_ms = DURATION_LONGEST;
    page->now_ms = store_now_ms();
    if (!read_seconds(call, "minDuration", page, &page->shortest_ms) ||
        !read_seconds(call, "maxDuration", page, &page->longest_ms)) {
        return false;
    }
    return page->shortest_ms <= page->longest_ms ||
           list_refuse(call, "/maxDuration", "maxDuration must not be less than minDuration.");
}

bool job_filters_read(struct api_call *call, struct list_filters *filters, struct store_page *page)
{
    return read_type(call, page) && read_process_id(call, filters, page) &&
           read_status(call, filters, page) && read_datetime(call, page) &&
           read_durations(call, page);
}
