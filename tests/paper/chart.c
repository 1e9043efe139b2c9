/*
 * chart.c - line charts as SVG in the text of the report: axes with round numbers, one colour a
 * line, a legend, standard errors as bars.
 */
#include "paper/report_internal.h"

#include <math.h>

#define WIDTH 640.0
#define HEIGHT 320.0
#define LEFT 70.0
#define RIGHT 150.0
#define TOP 15.0
#define BOTTOM 45.0
#define TICKS 6

static const char *const colours[] = {"#1b6ca8", "#d1495b", "#3a7d44", "#8e5ea2",
                                      "#c98b2b", "#444444", "#17a2a2", "#a05195"};
#define COLOURS (sizeof colours / sizeof colours[0])

struct axis {
    double low, high;
    bool logarithmic;
};

static double place(const struct axis *axis, double value)
{
    double v = axis->logarithmic ? log10(value) : value;

    return axis->high > axis->low ? (v - axis->low) / (axis->high - axis->low) : 0.5;
}

static bool shows(const struct axis *axis, double value)
{
    return isfinite(value) && (!axis->logarithmic || value > 0.0);
}

static void widen(struct axis *axis, double value)
{
    double v;

    if (!shows(axis, value)) {
        return;
    }
    v = axis->logarithmic ? log10(value) : value;
    axis->low = fmin(axis->low, v);
    axis->high = fmax(axis->high, v);
}

static void find_axes(size_t count, const struct report_line *lines, struct axis *x, struct axis *y)
{
    for (size_t i = 0; i < count; i++) {
        for (size_t k = 0; k < lines[i].count; k++) {
            double error = lines[i].error ? lines[i].error[k] : 0.0;

            widen(x, lines[i].x[k]);
            widen(y, lines[i].y[k] + error);
            widen(y, lines[i].y[k] - error);
        }
    }
    if (y->logarithmic) {
        y->low = floor(y->low);
        y->high = fmax(ceil(y->high), y->low + 1.0);
    } else {
        double margin = 0.05 * (y->high - y->low);

        y->low = y->low >= 0.0 && y->low < 0.5 * y->high ? 0.0 : y->low - margin;
        y->high += margin;
    }
}

/* A step of 1, 2 or 5 times a power of ten that cuts the span into at most TICKS parts. */
static double round_step(double span)
{
    double step = pow(10.0, floor(log10(span / TICKS)));

    while (span / step > TICKS) {
        double lead = step / pow(10.0, floor(log10(step) + 1e-9));

        step *= lead < 1.5 ? 2.0 : lead < 3.0 ? 2.5 : 2.0;
    }
    return step;
}

static double to_x(const struct axis *x, double value)
{
    return LEFT + place(x, value) * (WIDTH - LEFT - RIGHT);
}

static double to_y(const struct axis *y, double value)
{
    return HEIGHT - BOTTOM - place(y, value) * (HEIGHT - TOP - BOTTOM);
}

static void draw_axes(FILE *out, const struct axis *x, const struct axis *y)
{
    double span_x = x->high > x->low ? x->high - x->low : 1.0;
    double span_y = y->high > y->low ? y->high - y->low : 1.0;
    double step_x = round_step(span_x);
    double step_y = y->logarithmic ? fmax(1.0, ceil(span_y / TICKS)) : round_step(span_y);

    for (double t = ceil(x->low / step_x) * step_x; t <= x->high + 1e-9 * span_x; t += step_x) {
        double at = to_x(x, t);

        (void)fprintf(out,
                      "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>"
                      "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%g</text>",
                      at, at, TOP, HEIGHT - BOTTOM, at, HEIGHT - BOTTOM + 16.0,
                      fabs(t) < 1e-12 * span_x ? 0.0 : t);
    }
    for (double t = ceil(y->low / step_y) * step_y; t <= y->high + 1e-9 * span_y; t += step_y) {
        double value = y->logarithmic ? pow(10.0, t) : t;
        double at = to_y(y, value);

        (void)fprintf(out,
                      "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>"
                      "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%.3g</text>",
                      LEFT, WIDTH - RIGHT, at, at, LEFT - 6.0, at + 4.0,
                      fabs(value) < 1e-12 * span_y && !y->logarithmic ? 0.0 : value);
    }
}

static void draw_line(FILE *out, const struct axis *x, const struct axis *y,
                      const struct report_line *line, const char *colour)
{
    (void)fprintf(out, "<polyline fill=\"none\" stroke=\"%s\" stroke-width=\"2\" points=\"",
                  colour);
    for (size_t k = 0; k < line->count; k++) {
        if (shows(y, line->y[k])) {
            (void)fprintf(out, "%.1f,%.1f ", to_x(x, line->x[k]), to_y(y, line->y[k]));
        }
    }
    (void)fputs("\"/>", out);
    for (size_t k = 0; k < line->count; k++) {
        double at = to_x(x, line->x[k]);

        if (!shows(y, line->y[k])) {
            continue;
        }
        (void)fprintf(out, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2.5\" fill=\"%s\"/>", at,
                      to_y(y, line->y[k]), colour);
        if (line->error && shows(y, line->y[k] - line->error[k])) {
            (void)fprintf(out,
                          "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"%s\"/>",
                          at, at, to_y(y, line->y[k] - line->error[k]),
                          to_y(y, line->y[k] + line->error[k]), colour);
        }
    }
}

static void draw_legend(struct report *report, size_t count, const struct report_line *lines)
{
    for (size_t i = 0; i < count; i++) {
        double at = TOP + 12.0 + 18.0 * (double)i;

        (void)fprintf(report->out,
                      "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" "
                      "stroke-width=\"2\"/><text x=\"%.1f\" y=\"%.1f\">",
                      WIDTH - RIGHT + 8.0, WIDTH - RIGHT + 28.0, at - 4.0, at - 4.0,
                      colours[i % COLOURS], WIDTH - RIGHT + 33.0, at);
        report_escape(report, lines[i].name);
        (void)fputs("</text>", report->out);
    }
}

void report_chart(struct report *report, const char *caption, const char *x_title,
                  const char *y_title, bool logarithmic, size_t count,
                  const struct report_line *lines)
{
    struct axis x = {INFINITY, -INFINITY, false};
    struct axis y = {INFINITY, -INFINITY, logarithmic};

    find_axes(count, lines, &x, &y);
    report_must(isfinite(x.low) && isfinite(y.low), "a chart of the report has no points");
    (void)fputs("<figure><figcaption>", report->out);
    report_escape(report, caption);
    (void)fprintf(report->out,
                  "</figcaption><svg viewBox=\"0 0 %.0f %.0f\" width=\"%.0f\" height=\"%.0f\">",
                  WIDTH, HEIGHT, WIDTH, HEIGHT);
    draw_axes(report->out, &x, &y);
    for (size_t i = 0; i < count; i++) {
        draw_line(report->out, &x, &y, &lines[i], colours[i % COLOURS]);
    }
    draw_legend(report, count, lines);
    (void)fprintf(report->out, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">",
                  (LEFT + WIDTH - RIGHT) / 2.0, HEIGHT - 8.0);
    report_escape(report, x_title);
    (void)fprintf(report->out,
                  "</text><text x=\"14\" y=\"%.1f\" text-anchor=\"middle\" "
                  "transform=\"rotate(-90 14 %.1f)\">",
                  (TOP + HEIGHT - BOTTOM) / 2.0, (TOP + HEIGHT - BOTTOM) / 2.0);
    report_escape(report, y_title);
    (void)fputs("</text></svg></figure>\n", report->out);
}
