#include "solver/bench/bench_files.h"

#include "solver/base/atomic_file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

lam_status bench_files_open(bench_files *b, lam_error *error) {
    lam_status status = LAM_OK;
    char *probe = NULL;
    b->made = mkdir(b->folder, 0777) == 0;
    if (!b->made && errno != EEXIST)
        FAIL(error, LAM_ERR_IO, "%s: the folder cannot be made: %s; give another -o", b->folder,
             strerror(errno));
    if (asprintf(&probe, "%s/results", b->folder) < 0) {
        probe = NULL;
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its name", b->folder);
    }
    TRY(output_file_check(probe, error));
    const time_t now = time(NULL);
    struct tm utc;
    gmtime_r(&now, &utc);
    strftime(b->time, sizeof b->time, "%Y-%m-%dT%H:%M:%SZ", &utc);
    b->run.time = b->time;
done:
    free(probe);
    return status;
}

void bench_files_close(bench_files *b) {
    if (b->made && b->n_files == 0) rmdir(b->folder);
}

/* One file of the folder, for the forms that write to a stream. */
static lam_status file_open(const bench_files *b, const char *name, const char *extension, output_file *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    char *path = NULL;
    if (asprintf(&path, "%s/%s-%s.%s", b->folder, b->suite, name, extension) < 0) {
        path = NULL;
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its name", b->folder);
    }
    TRY(output_file_open(path, out, error));
done:
    free(path);
    return status;
}

static lam_status put_table(void *context, const table *t, lam_error *error) {
    lam_status status = LAM_OK;
    bench_files *b = context;
    output_file out = {0};
    TRY(file_open(b, t->name, "csv", &out, error));
    table_csv(t, out.stream);
    TRY(output_file_commit(&out, error));
    b->n_files++;
    TRY(file_open(b, t->name, "json", &out, error));
    TRY(table_json(t, &b->run, out.stream, error));
    TRY(output_file_commit(&out, error));
    b->n_files++;
    if (t->printed) {
        terminal_clear(b->t);
        table_print(t, stdout);
        fflush(stdout);
    }
done:
    output_file_abort(&out);
    return status;
}

static lam_status put_plot(void *context, const plot *p, lam_error *error) {
    lam_status status = LAM_OK;
    bench_files *b = context;
    output_file out = {0};
    TRY(file_open(b, p->name, "svg", &out, error));
    TRY(plot_svg(p, out.stream, error));
    TRY(output_file_commit(&out, error));
    b->n_files++;
    TRY(file_open(b, p->name, "png", &out, error));
    TRY(plot_png(p, out.stream, error));
    TRY(output_file_commit(&out, error));
    b->n_files++;
done:
    output_file_abort(&out);
    return status;
}

static void say(void *context, const char *line) {
    bench_files *b = context;
    terminal_log(b->t, "%s", line);
}

bench_sink bench_files_sink(bench_files *b) {
    return (bench_sink){.table = put_table, .plot = put_plot, .say = say, .context = b};
}
