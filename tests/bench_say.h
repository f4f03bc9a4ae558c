/* What all benchmarks share: how they stop, where they write, and what machine they ran on. What
   is said goes to the terminal and to build/bench/NAME.md; rows of its tables to NAME.tsv too. */
#ifndef BENCH_SAY_H
#define BENCH_SAY_H

#include "terrimp.h"

#include "examples/host/stats.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const char bench_folder[] = "build/bench";
static FILE *say_report, *say_rows;

/* ---- Ending early ------------------------------------------------------- */

static inline void bench_stop(const char *what, const char *trouble)
{
    fprintf(stderr, "bench: %s: %s\n", what, trouble);
    exit(2);
}

static inline void need(terrimp_result result)
{
    if (result != TERRIMP_OK)
        bench_stop("terrimp", terrimp_result_text((int)result));
}

static inline void *need_memory(size_t bytes)
{
    void *memory = malloc(bytes ? bytes : 1);
    if (!memory)
        bench_stop("memory", "there is none");
    return memory;
}

static inline double mean(const stats *s)
{
    return stats_summarise(s).mean;
}

/* ---- What is asked for -------------------------------------------------- */

/* Whether BENCH_ALL asks for the whole protocol. */
static inline int bench_all(void)
{
    const char *all = getenv("BENCH_ALL");
    return all && *all && *all != '0';
}

/* BENCH_FRAMES, or so many. */
static inline size_t bench_frames(size_t frames)
{
    const char *wanted = getenv("BENCH_FRAMES");
    long count = wanted ? strtol(wanted, NULL, 10) : 0;
    return count > 0 ? (size_t)count : frames;
}

/* Where the real tiles and the flight paths are. */
static inline const char *bench_data(void)
{
    const char *folder = getenv("TERRIMP_DATA");
    return folder && *folder ? folder : "../shared/data";
}

/* ---- Saying ------------------------------------------------------------- */

/* Opens a file of the folder for writing. */
static inline FILE *bench_output(const char *name, const char *ending)
{
    char path[256];
    FILE *file;
    mkdir("build", 0777);
    mkdir(bench_folder, 0777);
    snprintf(path, sizeof path, "%s/%s%s", bench_folder, name, ending);
    file = fopen(path, "w");
    if (!file)
        bench_stop(path, "cannot be written");
    return file;
}

/* Rows: whether tables are to be written as NAME.tsv, too; a program may have a better one. */
static inline void say_open(const char *name, int rows)
{
    say_report = bench_output(name, ".md");
    say_rows = rows ? bench_output(name, ".tsv") : NULL;
}

/* A row of a Markdown table with tabs between its cells; the line under the headings has none. */
static inline void say_row(const char *line)
{
    const char *cell = line + 1, *end;
    if (!say_rows || line[0] != '|' || strncmp(line, "|--", 3) == 0)
        return;
    for (; (end = strchr(cell, '|')) != NULL; cell = end + 1) {
        const char *from = cell, *to = end;
        while (from < to && *from == ' ')
            from++;
        while (to > from && to[-1] == ' ')
            to--;
        fprintf(say_rows, "%s%.*s", cell == line + 1 ? "" : "\t", (int)(to - from), from);
    }
    fprintf(say_rows, "\n");
}

/* Like printf. A row may be said in pieces. */
static inline void say(const char *format, ...)
{
    static char line[4096];
    size_t used = strlen(line), length;
    va_list arguments;
    char *end;
    va_start(arguments, format);
    vsnprintf(line + used, sizeof line - used, format, arguments);
    va_end(arguments);
    fputs(line + used, stdout);
    fputs(line + used, say_report);
    fflush(stdout);
    while ((end = strchr(line, '\n')) != NULL) {
        *end = 0;
        say_row(line);
        length = strlen(end + 1);
        memmove(line, end + 1, length + 1);
    }
}

/* renderer: that of OpenGL, or null. */
static inline void say_machine(const char *renderer)
{
    char line[256] = "", load[64] = "";
    FILE *file = fopen("/proc/cpuinfo", "r");
    while (file && fgets(line, sizeof line, file) && strncmp(line, "model name", 10) != 0)
        ;
    if (file)
        fclose(file);
    file = fopen("/proc/loadavg", "r");
    if (file && fscanf(file, "%63s", load) != 1)
        load[0] = 0;
    if (file)
        fclose(file);
    line[strcspn(line, "\n")] = 0;
    say("Machine: %s; load at the start %s\n",
        strchr(line, ':') ? strchr(line, ':') + 2 : "unknown", load);
    if (renderer)
        say("Renderer: %s\n", renderer);
}

static inline void say_close(void)
{
    if (fclose(say_report) != 0 || (say_rows && fclose(say_rows) != 0))
        bench_stop(bench_folder, "a report could not be written to its end");
}

#endif
