/* Writes plots as SVG files: series of points, joined or not, over linear or logarithmic axes. */
#ifndef BENCH_PLOT_H
#define BENCH_PLOT_H

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

enum { PLOT_MAX_SERIES = 16, PLOT_MAX_POINTS = 64 };

typedef struct plot_series {
    char name[64];
    double x[PLOT_MAX_POINTS], y[PLOT_MAX_POINTS];
    size_t count;
    int joined; /* by lines, in the order of the points */
    int hollow; /* for figures that were not measured here */
} plot_series;

typedef struct plot {
    const char *title, *x_label, *y_label;
    int log_x, log_y;
    plot_series series[PLOT_MAX_SERIES];
    size_t count;
} plot;

/* The series of that name, made if it is new; null when there are too many. */
static plot_series *plot_find_series(plot *p, const char *name)
{
    plot_series *s;
    size_t i;
    for (i = 0; i < p->count; i++)
        if (strcmp(p->series[i].name, name) == 0)
            return &p->series[i];
    if (p->count == PLOT_MAX_SERIES)
        return NULL;
    s = &p->series[p->count++];
    s->count = 0;
    s->joined = 1;
    s->hollow = 0;
    snprintf(s->name, sizeof s->name, "%s", name);
    return s;
}

static void plot_add(plot *p, const char *name, double x, double y)
{
    plot_series *s = plot_find_series(p, name);
    if (!s || s->count == PLOT_MAX_POINTS)
        return;
    s->x[s->count] = x;
    s->y[s->count++] = y;
}

/* ---- Axes --------------------------------------------------------------- */

enum { PLOT_LEFT = 70, PLOT_TOP = 40, PLOT_WIDTH = 620, PLOT_HEIGHT = 400 };

typedef struct plot_axis {
    double low, high; /* of the values, or of their logarithms */
    int logarithmic, length, start, sign;
} plot_axis;

static double plot_place(const plot_axis *a, double value)
{
    double t = ((a->logarithmic ? log10(value) : value) - a->low) / (a->high - a->low);
    return a->start + a->sign * t * a->length;
}

static plot_axis plot_fit(const plot *p, int is_y)
{
    plot_axis a = { 1e300, -1e300, is_y ? p->log_y : p->log_x, 0, 0, 1 };
    double margin;
    size_t i, k;
    for (i = 0; i < p->count; i++)
        for (k = 0; k < p->series[i].count; k++) {
            double v = is_y ? p->series[i].y[k] : p->series[i].x[k];
            v = a.logarithmic ? log10(v) : v;
            a.low = v < a.low ? v : a.low;
            a.high = v > a.high ? v : a.high;
        }
    margin = a.high > a.low ? 0.06 * (a.high - a.low) : 0.5;
    a.low -= margin;
    a.high += margin;
    a.length = is_y ? PLOT_HEIGHT : PLOT_WIDTH;
    a.start = is_y ? PLOT_TOP + PLOT_HEIGHT : PLOT_LEFT;
    a.sign = is_y ? -1 : 1;
    return a;
}

static void plot_tick(FILE *file, const plot_axis *a, int is_y, double value)
{
    double at = plot_place(a, value);
    if (is_y)
        fprintf(file, "<path class='g' d='M%d %.1fh%d'/><text x='%d' y='%.1f' "
                "text-anchor='end'>%g</text>\n", PLOT_LEFT, at, PLOT_WIDTH, PLOT_LEFT - 6,
                at + 4.0, value);
    else
        fprintf(file, "<path class='g' d='M%.1f %dv%d'/><text x='%.1f' y='%d' "
                "text-anchor='middle'>%g</text>\n", at, PLOT_TOP, PLOT_HEIGHT, at,
                PLOT_TOP + PLOT_HEIGHT + 18, value);
}

static void plot_log_ticks(FILE *file, const plot_axis *a, int is_y)
{
    static const double steps[3] = { 1.0, 2.0, 5.0 };
    int decade, i;
    for (decade = (int)floor(a->low); decade <= (int)ceil(a->high); decade++)
        for (i = 0; i < (a->high - a->low < 3.0 ? 3 : 1); i++) {
            double value = steps[i] * pow(10.0, decade);
            if (log10(value) >= a->low && log10(value) <= a->high)
                plot_tick(file, a, is_y, value);
        }
}

/* Round steps, 4 to 10 of them. */
static void plot_linear_ticks(FILE *file, const plot_axis *a, int is_y)
{
    double span = a->high - a->low, step = pow(10.0, floor(log10(span / 4.0))), at;
    if (span / step > 20.0)
        step *= 5.0;
    else if (span / step > 8.0)
        step *= 2.0;
    for (at = ceil(a->low / step); at * step <= a->high; at += 1.0)
        plot_tick(file, a, is_y, at * step);
}

/* ---- The file ----------------------------------------------------------- */

static const char *plot_colour(size_t i)
{
    static const char *const colours[8] = { "#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                            "#e69f00", "#56b4e9", "#000000", "#7f7f7f" };
    return colours[i % 8];
}

static void plot_draw_series(FILE *file, const plot *p, size_t index, const plot_axis *x,
                             const plot_axis *y)
{
    const plot_series *s = &p->series[index];
    const char *colour = plot_colour(index), *fill = s->hollow ? "white" : colour;
    int row = PLOT_TOP + 14 + (int)index * 18, column = PLOT_LEFT + PLOT_WIDTH + 16;
    size_t k;
    if (s->joined && s->count > 1) {
        fprintf(file, "<polyline fill='none' stroke='%s' stroke-width='1.5' points='", colour);
        for (k = 0; k < s->count; k++)
            fprintf(file, "%.1f,%.1f ", plot_place(x, s->x[k]), plot_place(y, s->y[k]));
        fprintf(file, "'/>\n");
    }
    for (k = 0; k < s->count; k++)
        fprintf(file, "<circle cx='%.1f' cy='%.1f' r='4' fill='%s' stroke='%s' "
                "stroke-width='1.5'/>\n", plot_place(x, s->x[k]), plot_place(y, s->y[k]), fill,
                colour);
    fprintf(file, "<circle cx='%d' cy='%d' r='4' fill='%s' stroke='%s' stroke-width='1.5'/>"
            "<text x='%d' y='%d'>%s</text>\n", column, row, fill, colour, column + 10, row + 4,
            s->name);
}

/* Returns 0 when the file cannot be written. */
static int plot_write(const plot *p, const char *path)
{
    plot_axis x = plot_fit(p, 0), y = plot_fit(p, 1);
    FILE *file = fopen(path, "w");
    size_t i;
    if (!file)
        return 0;
    fprintf(file, "<svg xmlns='http://www.w3.org/2000/svg' width='960' height='500' "
            "font-family='sans-serif' font-size='12'>\n<style>.g{stroke:#ddd}</style>\n"
            "<rect width='960' height='500' fill='white'/>\n"
            "<text x='%d' y='24' font-size='15'>%s</text>\n", PLOT_LEFT, p->title);
    if (x.logarithmic)
        plot_log_ticks(file, &x, 0);
    else
        plot_linear_ticks(file, &x, 0);
    if (y.logarithmic)
        plot_log_ticks(file, &y, 1);
    else
        plot_linear_ticks(file, &y, 1);
    fprintf(file, "<rect x='%d' y='%d' width='%d' height='%d' fill='none' stroke='#888'/>\n",
            PLOT_LEFT, PLOT_TOP, PLOT_WIDTH, PLOT_HEIGHT);
    fprintf(file, "<text x='%d' y='%d' text-anchor='middle'>%s</text>\n",
            PLOT_LEFT + PLOT_WIDTH / 2, PLOT_TOP + PLOT_HEIGHT + 40, p->x_label);
    fprintf(file, "<text transform='translate(20 %d) rotate(-90)' text-anchor='middle'>%s"
            "</text>\n", PLOT_TOP + PLOT_HEIGHT / 2, p->y_label);
    for (i = 0; i < p->count; i++)
        plot_draw_series(file, p, i, &x, &y);
    fprintf(file, "</svg>\n");
    return fclose(file) == 0;
}

#endif
