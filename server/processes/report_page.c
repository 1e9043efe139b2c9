/*
 * report_page.c - a report as one file of HTML: how texts get into it, and how its parts are put
 * together.
 *
 * The frame is web/dist/report.html, which the dashboard's sources make: the policy, the style, and
 * the program that draws charts and shapes, each by its hash. It has a place for the title, for the
 * body and for the data that the program reads:
 *
 *   {"lists": [..], "shapes": [..], "views": [..], "sections": [{"process", "results"}]}
 *
 * The policy allows no other program and no other style, so that a text which got past report_text
 * would still not run. Data are JSON without < and >, which ends no script element.
 *
 * All is written into memory: shapes up to REPORT_SHAPES_MAX, tables up to REPORT_ROWS_MAX rows,
 * and of results what is left without long arrays.
 */
#include "processes/report.h"

#include <stdlib.h>
#include <string.h>

#include "api/ui.h"

#define FRAME "report.html"

static const char *const places[] = {"<!--title-->", "<!--body-->", "<!--data-->"};
#define PLACES 3

/* ---- Texts ----------------------------------------------------------------------------------- */

void report_text(FILE *out, const char *text)
{
    for (; text && *text; text++) {
        unsigned char c = (unsigned char)*text;

        switch (c) {
        case '&':
            (void)fputs("&amp;", out);
            break;
        case '<':
            (void)fputs("&lt;", out);
            break;
        case '>':
            (void)fputs("&gt;", out);
            break;
        case '"':
            (void)fputs("&quot;", out);
            break;
        case '\'':
            (void)fputs("&#39;", out);
            break;
        default:
            (void)fputc(c < ' ' || c == 0x7f ? ' ' : c, out);
        }
    }
}

void report_scalar(FILE *out, const json_t *value)
{
    if (json_is_string(value)) {
        report_text(out, json_string_value(value));
    } else if (json_is_integer(value)) {
        (void)fprintf(out, "%lld", (long long)json_integer_value(value));
    } else if (json_is_real(value)) {
        (void)fprintf(out, "%.6g", json_real_value(value));
    } else {
        (void)fputs(json_is_true(value) ? "yes" : json_is_false(value) ? "no" : "–", out);
    }
}

bool report_json(FILE *out, const json_t *document)
{
    char *text = json_memory_dumps(document, JSON_COMPACT | JSON_ENCODE_ANY);

    for (const char *at = text; at && *at; at++) {
        if (*at == '<' || *at == '>') {
            (void)fputs(*at == '<' ? "\\u003c" : "\\u003e", out);
        } else {
            (void)fputc(*at, out);
        }
    }
    free(text);
    return text != NULL;
}

/* ---- The page -------------------------------------------------------------------------------- */

bool report_page_open(struct report_page *page, struct jobs_run *run, const struct report *asked,
                      struct jobs_result *result)
{
    FILE **const files[4] = {&page->body, &page->shapes, &page->views, &page->sections};
    int status;

    *page = (struct report_page){.run = run, .asked = asked, .result = result};
    for (size_t i = 0; i < 4; i++) {
        *files[i] = open_memstream(&page->texts[i], &page->sizes[i]);
        if (!*files[i]) {
            (void)compute_fail(result, SRNF_ENOMEM, NULL, "the report");
            return false;
        }
    }
    status = srnf_mesh_icosphere((size_t)asked->resolution, &page->sphere);
    return !status || compute_fail(result, status, NULL, "the report") == 0;
}

/* Ends the four texts. False where one of them is not whole. */
static bool end_texts(struct report_page *page)
{
    FILE **const files[4] = {&page->body, &page->shapes, &page->views, &page->sections};
    bool whole = true;

    for (size_t i = 0; i < 4; i++) {
        if (*files[i]) {
            whole = ferror(*files[i]) == 0 && whole;
            whole = fclose(*files[i]) == 0 && whole;
            *files[i] = NULL;
        }
        whole = whole && page->texts[i];
    }
    return whole;
}

void report_page_clear(struct report_page *page)
{
    (void)end_texts(page);
    for (size_t i = 0; i < 4; i++) {
        free(page->texts[i]);
    }
    srnf_mesh_clear(&page->sphere);
    *page = (struct report_page){0};
}

void report_omitted(const struct report_page *page, char *text, size_t size)
{
    (void)snprintf(text, size,
                   "%zu shape%s not shown, as the shapes of a report have %d MiB: take a lower "
                   "resolution than %ld, fewer modes, or several reports.",
                   page->n_omitted, page->n_omitted == 1 ? " is" : "s are", REPORT_SHAPES_MIB,
                   page->asked->resolution);
}

/* At the beginning, where it is seen. */
static void put_omitted(FILE *out, const struct report_page *page)
{
    char text[240];

    if (page->n_omitted > 0) {
        report_omitted(page, text, sizeof text);
        (void)fputs("<section class=\"warning\"><p>", out);
        report_text(out, text);
        (void)fputs("</p></section>", out);
    }
}

static void put(FILE *out, const struct report_page *page, size_t text)
{
    (void)fwrite(page->texts[text], 1, page->sizes[text], out);
}

static void fill(FILE *out, const struct report_page *page, size_t place)
{
    if (place == 0) {
        report_text(out, page->asked->title);
    } else if (place == 1) {
        (void)fputs("<h1>", out);
        report_text(out, page->asked->title);
        (void)fputs("</h1>", out);
        put_omitted(out, page);
        put(out, page, 0);
    } else {
        (void)fputs("{\"lists\":[{\"bits\":16,\"data\":\"", out);
        report_faces(out, &page->sphere);
        (void)fputs("\"}],\"shapes\":[", out);
        put(out, page, 1);
        (void)fputs("],\"views\":[", out);
        put(out, page, 2);
        (void)fputs("],\"sections\":[", out);
        put(out, page, 3);
        (void)fputs("]}", out);
    }
}

/* The frame with its places filled, each once and in this order. */
static bool write_page(FILE *out, const struct report_page *page, const char *frame, size_t size)
{
    const char *end = frame + size;

    for (size_t i = 0; i < PLACES; i++) {
        const char *found = memmem(frame, (size_t)(end - frame), places[i], strlen(places[i]));

        if (!found) {
            return false;
        }
        (void)fwrite(frame, 1, (size_t)(found - frame), out);
        fill(out, page, i);
        frame = found + strlen(places[i]);
    }
    (void)fwrite(frame, 1, (size_t)(end - frame), out);
    return true;
}

char *report_page_close(struct report_page *page, size_t *size)
{
    char *text = NULL;
    size_t length = 0;
    unsigned char *frame = ui_unpacked(FRAME, &length);
    FILE *out = frame && end_texts(page) ? open_memstream(&text, size) : NULL;
    bool whole = out && write_page(out, page, (const char *)frame, length);

    if (out) {
        whole = ferror(out) == 0 && whole;
        whole = fclose(out) == 0 && whole;
    }
    free(frame);
    if (!whole) {
        free(text);
        (void)compute_fail(page->result, SRNF_ENOMEM, NULL, "the report");
        return NULL;
    }
    return text;
}
