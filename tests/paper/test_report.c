/*
 * test_report.c - the report that `make paper` writes is complete and well formed: every element is
 * closed, and nothing in it refers to another file or to a network.
 *
 * The report is written so that it is XML too; expat judges it. Sections are long: here each kind
 * of content is written once, and the program is run with no section at all.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <expat.h>
#include <spawn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "paper/picture.h"
#include "paper/report.h"
#include "support/shapes.h"

#define DEGREE 6
#define POINTS ((size_t)3)

extern char **environ;

struct seen {
    size_t sections, pictures, charts, tables, outside;
};

static void start_element(void *user, const XML_Char *name, const XML_Char **attributes)
{
    struct seen *seen = user;

    seen->sections += strcmp(name, "h2") == 0;
    seen->pictures += strcmp(name, "img") == 0;
    seen->charts += strcmp(name, "svg") == 0;
    seen->tables += strcmp(name, "table") == 0;
    seen->outside += strcmp(name, "script") == 0 || strcmp(name, "link") == 0;
    for (size_t i = 0; attributes[i]; i += 2) {
        bool refers = strcmp(attributes[i], "src") == 0 || strstr(attributes[i], "href");
        const char *to = attributes[i + 1];

        seen->outside += refers && to[0] != '#' && strncmp(to, "data:", 5) != 0;
        seen->outside += strstr(to, "http:") || strstr(to, "https:") || strstr(to, "url(");
    }
}

/* False where the text is not well formed. */
static bool parse(const char *text, size_t size, struct seen *seen)
{
    XML_Parser parser = XML_ParserCreate("UTF-8");
    bool good;

    assert_non_null(parser);
    *seen = (struct seen){0};
    XML_SetUserData(parser, seen);
    XML_SetStartElementHandler(parser, start_element);
    good = XML_Parse(parser, text, (int)size, 1) == XML_STATUS_OK;
    if (!good) {
        printf("# line %lu: %s\n", (unsigned long)XML_GetCurrentLineNumber(parser),
               XML_ErrorString(XML_GetErrorCode(parser)));
    }
    XML_ParserFree(parser);
    return good;
}

static char *read_all(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    char *text;
    long length;

    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    length = ftell(file);
    assert_true(length > 0);
    rewind(file);
    text = malloc((size_t)length + 1);
    assert_non_null(text);
    *size = fread(text, 1, (size_t)length, file);
    assert_int_equal(*size, length);
    text[*size] = '\0';
    (void)fclose(file);
    return text;
}

/* Exit status of the program with these arguments. */
static int run(char *output, char *section)
{
    const char *build = getenv("SRNFD_BUILD");
    char program[1000];
    char *arguments[] = {program, output, section, NULL};
    pid_t child;
    int status;

    (void)snprintf(program, sizeof program, "%s/paper", build ? build : "build");
    assert_int_equal(posix_spawn(&child, program, NULL, NULL, arguments, environ), 0);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static void name_report(char path[1000])
{
    const char *folder = getenv("TMPDIR");

    (void)snprintf(path, 1000, "%s/report-%ld.html", folder ? folder : "/tmp", (long)getpid());
}

/* Reads, parses and removes a report that must be good. */
static void judge(const char *path, struct seen *seen)
{
    char part[1010];
    size_t size;
    char *text;

    (void)snprintf(part, sizeof part, "%s.part", path);
    assert_int_not_equal(access(part, F_OK), 0);
    text = read_all(path, &size);
    (void)unlink(path);
    assert_true(parse(text, size, seen));
    printf("# %zu bytes: %zu sections, %zu pictures, %zu charts, %zu tables\n", size,
           seen->sections, seen->pictures, seen->charts, seen->tables);
    assert_int_equal(seen->outside, 0);
    assert_null(strstr(text, "http://"));
    assert_null(strstr(text, "https://"));
    free(text);
}

static void write_picture(struct report *report, const struct srnf_grid *grid, const double *field)
{
    struct shapes_surface s;
    struct picture_view view;
    struct picture pictures[2];

    shapes_open(&s, DEGREE);
    shapes_fill(&s, shapes_ellipsoid, 1.7);
    view = picture_view_of(DEGREE, s.f);
    pictures[0] = picture_draw(DEGREE, s.f, &view, s.f, 1.0);
    pictures[1] = picture_draw_field(DEGREE, s.f, &view, grid, field, 1.0);
    report_row_open(report, "A row");
    for (size_t i = 0; i < 2; i++) {
        assert_true(pictures[i].size > 100);
        assert_memory_equal(pictures[i].png, "\x89PNG", 4);
        report_picture(report, pictures[i].png, pictures[i].size, "a < b & \"c\"");
    }
    /* A field that is not 0 must change the picture. */
    assert_true(pictures[0].size != pictures[1].size ||
                memcmp(pictures[0].png, pictures[1].png, pictures[0].size) != 0);
    report_row_close(report);
    picture_clear(&pictures[0]);
    picture_clear(&pictures[1]);
    shapes_close(&s);
}

static void write_all_kinds(const char *path)
{
    static const char *const headings[] = {"<name>", "a & b"};
    static const double x[POINTS] = {0.0, 1.0, 2.0};
    static const double y[POINTS] = {1.0, 0.1, 0.01};
    const struct report_line lines[] = {{"y < 1 & more", POINTS, x, y, NULL},
                                        {"with bars", POINTS, x, y, y}};
    struct report *report = report_open(path, "A report");
    struct shapes_surface s;
    double *field;

    shapes_open(&s, DEGREE);
    field = shapes_doubles(s.points);
    for (size_t p = 0; p < s.points; p++) {
        field[p] = 0.5 + 0.5 * s.grid->cos_theta[p / s.grid->n_phi];
    }
    report_section(report, "Section <1> & \"more\"", "from <nowhere>");
    report_paragraph(report, "%s and %d < 4", "</p><b>", 3);
    report_table_open(report, "table < 1", 2, headings);
    report_cell(report, "%s", "<td>");
    report_cell(report, "%.1f", 0.5);
    report_table_close(report);
    report_chart(report, "plain", "x", "y", false, 2, lines);
    report_chart(report, "logarithmic", "x & y", "y", true, 2, lines);
    write_picture(report, s.grid, field);
    report_close(report);
    srnf_free(field);
    shapes_close(&s);
}

static void every_kind_of_content_is_well_formed(void **state)
{
    char path[1000];
    struct seen seen;

    (void)state;
    name_report(path);
    write_all_kinds(path);
    judge(path, &seen);
    assert_int_equal(seen.sections, 1);
    assert_int_equal(seen.tables, 1);
    assert_int_equal(seen.charts, 2);
    assert_int_equal(seen.pictures, 2);
}

static void judge_is_not_blind(void **state)
{
    static const char unclosed[] = "<html><body><p>text</body></html>";
    static const char reference[] = "<html><img src=\"picture.png\"/></html>";
    struct seen seen;

    (void)state;
    assert_false(parse(unclosed, strlen(unclosed), &seen));
    assert_true(parse(reference, strlen(reference), &seen));
    assert_int_equal(seen.outside, 1);
}

static void program_writes_a_report(void **state)
{
    char section[] = "none";
    char path[1000];
    struct seen seen;

    (void)state;
    name_report(path);
    assert_int_equal(run(path, section), 0);
    judge(path, &seen);
    assert_int_equal(seen.sections, 0);
}

static void report_that_cannot_be_written_is_an_error(void **state)
{
    char path[] = "/nonexistent/report.html";
    char section[] = "none";

    (void)state;
    assert_int_equal(run(path, section), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_content_is_well_formed),
        cmocka_unit_test(judge_is_not_blind),
        cmocka_unit_test(program_writes_a_report),
        cmocka_unit_test(report_that_cannot_be_written_is_an_error),
    };

    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
