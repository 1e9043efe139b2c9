/*
 * report.c - HTML, tables and pictures of the report; charts are in chart.c.
 */
#include "paper/report_internal.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static const char style[] =
    "body{font:16px/1.5 Georgia,serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}"
    "h1,h2{font-family:Helvetica,Arial,sans-serif;line-height:1.2}h2{margin-top:2.5em}"
    "table{border-collapse:collapse;margin:1em 0;font:14px/1.4 Helvetica,Arial,sans-serif}"
    "caption{text-align:left;font-weight:bold;padding:.3em 0}"
    "th,td{border-bottom:1px solid #ccc;padding:.25em .7em;text-align:right}"
    "th:first-child,td:first-child{text-align:left}th{background:#f4f4f4}"
    "figure{margin:1em 0}figcaption{font-size:14px}.row{display:flex;flex-wrap:wrap;gap:.4em}"
    ".row figure{margin:0;text-align:center}.row img{width:150px;height:150px}"
    ".source{color:#666;font-style:italic}svg text{font:12px Helvetica,Arial,sans-serif}";

void report_must(bool good, const char *what)
{
    if (!good) {
        (void)fprintf(stderr, "paper: %s\n", what);
        exit(1);
    }
}

void report_escape(struct report *report, const char *text)
{
    for (; *text; text++) {
        switch (*text) {
        case '&':
            (void)fputs("&amp;", report->out);
            break;
        case '<':
            (void)fputs("&lt;", report->out);
            break;
        case '"':
            (void)fputs("&quot;", report->out);
            break;
        default:
            (void)fputc(*text, report->out);
        }
    }
}

__attribute__((format(printf, 2, 0))) static void
escape_formatted(struct report *report, const char *format, va_list arguments)
{
    char text[2000];
    int length = vsnprintf(text, sizeof text, format, arguments);

    report_must(length >= 0 && (size_t)length < sizeof text, "a text of the report is too long");
    report_escape(report, text);
}

struct report *report_open(const char *path, const char *title)
{
    struct report *report = calloc(1, sizeof *report);

    report_must(report != NULL, "out of memory");
    (void)snprintf(report->path, sizeof report->path, "%s", path);
    (void)snprintf(report->temporary, sizeof report->temporary, "%s.part", path);
    report->out = fopen(report->temporary, "w");
    report_must(report->out != NULL, "the report cannot be written");
    (void)fprintf(report->out,
                  "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/>"
                  "<title>%s</title><style>%s</style></head><body><h1>%s</h1>\n",
                  title, style, title);
    return report;
}

void report_close(struct report *report)
{
    (void)fputs("</body></html>\n", report->out);
    report_must(fflush(report->out) == 0 && !ferror(report->out) && fclose(report->out) == 0 &&
                    rename(report->temporary, report->path) == 0,
                "the report cannot be written");
    free(report);
}

void report_section(struct report *report, const char *title, const char *source)
{
    (void)fprintf(report->out, "<h2 id=\"section-%zu\">", ++report->sections);
    report_escape(report, title);
    (void)fputs("</h2><p class=\"source\">", report->out);
    report_escape(report, source);
    (void)fputs("</p>\n", report->out);
    (void)fflush(report->out);
}

void report_paragraph(struct report *report, const char *format, ...)
{
    va_list arguments;

    (void)fputs("<p>", report->out);
    va_start(arguments, format);
    escape_formatted(report, format, arguments);
    va_end(arguments);
    (void)fputs("</p>\n", report->out);
}

void report_table_open(struct report *report, const char *caption, size_t columns,
                       const char *const *headings)
{
    report->columns = columns;
    report->cell = 0;
    (void)fputs("<table><caption>", report->out);
    report_escape(report, caption);
    (void)fputs("</caption><tr>", report->out);
    for (size_t i = 0; i < columns; i++) {
        (void)fputs("<th>", report->out);
        report_escape(report, headings[i]);
        (void)fputs("</th>", report->out);
    }
    (void)fputs("</tr>\n", report->out);
}

void report_cell(struct report *report, const char *format, ...)
{
    va_list arguments;

    (void)fputs(report->cell == 0 ? "<tr><td>" : "<td>", report->out);
    va_start(arguments, format);
    escape_formatted(report, format, arguments);
    va_end(arguments);
    report->cell = (report->cell + 1) % report->columns;
    (void)fputs(report->cell == 0 ? "</td></tr>\n" : "</td>", report->out);
}

void report_table_close(struct report *report)
{
    report_must(report->cell == 0, "a table of the report has an unfinished row");
    (void)fputs("</table>\n", report->out);
}

void report_row_open(struct report *report, const char *caption)
{
    (void)fputs("<figure><figcaption>", report->out);
    report_escape(report, caption);
    (void)fputs("</figcaption><div class=\"row\">", report->out);
}

static void write_base64(FILE *out, const unsigned char *bytes, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

    for (size_t i = 0; i < size; i += 3) {
        size_t left = size - i;
        unsigned group = (unsigned)bytes[i] << 16 | (left > 1 ? (unsigned)bytes[i + 1] << 8 : 0) |
                         (left > 2 ? bytes[i + 2] : 0);

        (void)fputc(digits[group >> 18], out);
        (void)fputc(digits[group >> 12 & 63], out);
        (void)fputc(left > 1 ? digits[group >> 6 & 63] : '=', out);
        (void)fputc(left > 2 ? digits[group & 63] : '=', out);
    }
}

void report_picture(struct report *report, const unsigned char *png, size_t size,
                    const char *format, ...)
{
    va_list arguments;

    (void)fputs("<figure><img alt=\"\" src=\"data:image/png;base64,", report->out);
    write_base64(report->out, png, size);
    (void)fputs("\"/><figcaption>", report->out);
    va_start(arguments, format);
    escape_formatted(report, format, arguments);
    va_end(arguments);
    (void)fputs("</figcaption></figure>", report->out);
}

void report_row_close(struct report *report)
{
    (void)fputs("</div></figure>\n", report->out);
}
