#include "server/config.h"

#include <ctype.h>
#include <errno.h>
#include <getopt.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef enum option_kind {
    OPTION_TEXT,
    OPTION_COUNT,
    OPTION_SIZE, /* bytes, with K, M, G, T for powers of 1024 */
    OPTION_FLAG,
    OPTION_FUTURE_FLAG /* of the contract, refused until it is there */
} option_kind;

typedef struct option_row {
    const char *name;
    option_kind kind;
    const char *argument;
    size_t offset;
    size_t least, most;
    size_t preset; /* of OPTION_COUNT and OPTION_SIZE */
    const char *help;
} option_row;

#define AT(member) offsetof(config, member)

static const option_row rows[] = {
    {"stores", OPTION_TEXT, "DIR", AT(stores_dir), 0, 0, 0, "serve every *.h5 of a folder"},
    {"listen", OPTION_TEXT, "HOST:PORT", AT(listen_address), 0, 0, 0,
     "where to listen (127.0.0.1:8317); port 0 takes a free one"},
    {"unix", OPTION_TEXT, "PATH", AT(unix_path), 0, 0, 0, "listen on a socket in the file system instead"},
    {"threads", OPTION_COUNT, "T", AT(threads), 1, 4096, 0, "threads that solve (as many as cores)"},
    {"max-body", OPTION_SIZE, "BYTES", AT(max_body), 1, SIZE_MAX / 16, (size_t)256 << 20,
     "longest request body (256M)"},
    {"max-batch", OPTION_COUNT, "N", AT(max_batch), 1, 1u << 20, 1024, "most vectors in a request (1024)"},
    {"max-inflight", OPTION_COUNT, "N", AT(max_inflight), 1, 1u << 20, 256,
     "most solves that wait or run; more are answered 503 (256)"},
    {"max-buffered", OPTION_SIZE, "BYTES", AT(max_buffered), 1, SIZE_MAX / 16, 0,
     "most bytes of request bodies held at once; more are answered 503 (4 times --max-body)"},
    {"max-connections", OPTION_COUNT, "N", AT(max_connections), 1, 1u << 16, 1000,
     "most open connections; then idle ones are closed for others (1000)"},
    {"max-memory", OPTION_SIZE, "SIZE", AT(max_memory), 1, SIZE_MAX / 16, 0,
     "refuse stores that, with the threads' work areas, take more than so much"},
    {"max-variants", OPTION_COUNT, "N", AT(max_variants), 0, 4096, 0,
     "most variants of reflectance that clients may have made (0); they need --token-file"},
    {"timeout", OPTION_COUNT, "SECONDS", AT(timeout_s), 1, 86400, 60,
     "close a connection that is idle, or whose next request has not all of its head, for so long (60)"},
    {"min-rate", OPTION_SIZE, "BYTES", AT(min_rate), 1, SIZE_MAX / 16, (size_t)16 << 10,
     "a second, on average over --timeout, that a body has to come and an answer to be read (16K)"},
    {"token-file", OPTION_TEXT, "FILE", AT(token_file), 0, 0, 0,
     "ask for the bearer token in this file under /v1"},
    {"access-log", OPTION_TEXT, "-|FILE", AT(access_log), 0, 0, 0, "one JSON line for each request"},
    {"verify", OPTION_FLAG, NULL, AT(verify), 0, 0, 0,
     "compare all of a store with its checksums before it is served"},
    {"lock", OPTION_FUTURE_FLAG, NULL, 0, 0, 0, 0, "not supported yet"},
    {"no-viewer", OPTION_FLAG, NULL, AT(no_viewer), 0, 0, 0, "no page at / (there is none yet)"},
    {"help", OPTION_FLAG, NULL, AT(help), 0, 0, 0, "print this and exit"},
    {"version", OPTION_FLAG, NULL, AT(version), 0, 0, 0, "print the version and exit"},
};
#define N_ROWS (sizeof rows / sizeof rows[0])

static lam_status read_number(const option_row *row, const char *text, size_t *value, lam_error *error) {
    lam_status status = LAM_OK;
    char *end;
    errno = 0;
    unsigned long long number = strtoull(text, &end, 10);
    size_t scaled = (size_t)number;
    bool good = isdigit((unsigned char)text[0]) && errno == 0 && number <= SIZE_MAX;
    if (good && row->kind == OPTION_SIZE && *end != '\0') {
        static const char units[] = "KMGT";
        const char *unit = strchr(units, toupper((unsigned char)*end));
        good = unit != NULL &&
               (end[1] == '\0' || strcasecmp(end + 1, "B") == 0 || strcasecmp(end + 1, "iB") == 0);
        for (const char *u = units; good && u <= unit; u++) good = size_multiply(scaled, 1024, &scaled);
    } else if (*end != '\0') {
        good = false;
    }
    if (!good)
        FAIL(error, LAM_ERR_ARGUMENT, "--%s %s: must be a number%s", row->name, text,
             row->kind == OPTION_SIZE ? " of bytes, such as 4096 or 256M" : "");
    if (scaled < row->least || scaled > row->most)
        FAIL(error, LAM_ERR_ARGUMENT, "--%s %s: must be from %zu to %zu", row->name, text, row->least,
             row->most);
    *value = scaled;
done:
    return status;
}

static lam_status read_option(config *c, const option_row *row, const char *text, lam_error *error) {
    lam_status status = LAM_OK;
    void *member = (char *)c + row->offset;
    switch (row->kind) {
    case OPTION_TEXT:
        *(const char **)member = text;
        break;
    case OPTION_COUNT:
    case OPTION_SIZE:
        TRY(read_number(row, text, member, error));
        break;
    case OPTION_FLAG:
        *(bool *)member = true;
        break;
    case OPTION_FUTURE_FLAG:
        FAIL(error, LAM_ERR_UNSUPPORTED, "--%s: not supported yet", row->name);
    }
done:
    return status;
}

lam_status config_read(config *c, int argc, char **argv, lam_error *error) {
    lam_status status = LAM_OK;
    struct option options[N_ROWS + 1] = {0};
    long cores = sysconf(_SC_NPROCESSORS_ONLN);
    *c = (config){.listen_address = "127.0.0.1:8317"};
    for (size_t i = 0; i < N_ROWS; i++) {
        bool flag = rows[i].kind == OPTION_FLAG || rows[i].kind == OPTION_FUTURE_FLAG;
        options[i] = (struct option){rows[i].name, flag ? no_argument : required_argument, NULL, 0};
        if (rows[i].preset > 0) *(size_t *)(void *)((char *)c + rows[i].offset) = rows[i].preset;
    }
    c->threads = cores > 0 ? (size_t)cores : 1;
    opterr = 0;
    for (;;) {
        int which = -1, before = optind;
        int found = getopt_long(argc, argv, ":", options, &which);
        if (found == -1) break;
        if (found == ':') FAIL(error, LAM_ERR_ARGUMENT, "%s: needs an argument (see --help)", argv[before]);
        if (found == '?') FAIL(error, LAM_ERR_ARGUMENT, "%s: no such option (see --help)", argv[before]);
        TRY(read_option(c, &rows[which], optarg, error));
    }
    c->stores = argv + optind;
    c->n_stores = (size_t)(argc - optind);
    if (c->n_stores == 0 && c->stores_dir == NULL && !c->help && !c->version)
        FAIL(error, LAM_ERR_ARGUMENT, "no store is given: lambertd STORE.h5[:NAME] ... or --stores DIR");
    if (c->max_buffered == 0) c->max_buffered = 4 * c->max_body;
    if (c->max_buffered < c->max_body)
        FAIL(error, LAM_ERR_ARGUMENT, "--max-buffered %zu: must be at least --max-body (%zu)",
             c->max_buffered, c->max_body);
done:
    return status;
}

void config_print_help(FILE *to) {
    fprintf(to, "Usage: lambertd STORE.h5[:NAME] ... | --stores DIR [OPTION ...]\n"
                "Answers over HTTP what light a scene's surfaces have under any emission.\n\n");
    for (size_t i = 0; i < N_ROWS; i++) {
        char left[64];
        snprintf(left, sizeof left, "--%s%s%s", rows[i].name, rows[i].argument == NULL ? "" : " ",
                 rows[i].argument == NULL ? "" : rows[i].argument);
        fprintf(to, "  %-24s %s\n", left, rows[i].help);
    }
    fprintf(to, "\nSIGHUP reads the stores again; SIGTERM finishes what runs and exits.\n");
}
