#include "server/config.h"

#include "solver/base/machine.h"
#include "solver/base/options/options.h"

#include <stdio.h>
#include <unistd.h>

_Static_assert(sizeof(size_t) == sizeof(uint64_t), "counts and sizes of the tables are uint64_t");

#define AT(member) offsetof(config, member)
#define SIZE_MOST 0x1p59

static const option_row store_rows[] = {
    {.name = "stores",
     .kind = OPTION_TEXT,
     .offset = AT(stores_dir),
     .argument = "DIR",
     .help = "Serve every *.h5 file of a folder, each under its name without .h5"},
    {.name = "strict",
     .kind = OPTION_FLAG,
     .offset = AT(strict),
     .help = "Start only if every store can be served, and be ready (/readyz) only if every one could be "
             "read last"},
    {.name = "verify",
     .kind = OPTION_FLAG,
     .offset = AT(verify),
     .help = "Compare all of a store with its checksums before it is served"},
    {.name = "verify-below",
     .kind = OPTION_SIZE,
     .offset = AT(verify_below),
     .argument = "SIZE",
     .preset = "256M",
     .least = 1,
     .most = SIZE_MOST,
     .help = "Compare the mapped arrays of a store before it is served where they take less than this, and "
             "of larger stores meanwhile"},
    {.name = "scrub",
     .kind = OPTION_NUMBER,
     .offset = AT(scrub_hours),
     .argument = "HOURS",
     .otherwise = "never",
     .unit = "h",
     .least = 0,
     .above = true,
     .most = 8760,
     .help = "Compare the mapped arrays of stores with their checksums again this long after the last time"},
    {.name = "max-memory",
     .kind = OPTION_SIZE,
     .offset = AT(max_memory),
     .argument = "SIZE",
     .otherwise = "no limit",
     .least = 1,
     .most = SIZE_MOST,
     .help = "Refuse stores that, with the work areas of the threads, take more memory than this"},
    {.name = "max-request-memory",
     .kind = OPTION_SIZE,
     .offset = AT(max_request_memory),
     .argument = "SIZE",
     .otherwise = "half of the memory of the machine or control group",
     .least = 1 << 20,
     .most = SIZE_MOST,
     .help =
         "Most memory that requests take: bodies, emissions, answers until they are sent; further ones wait "
         "within their time, and are answered 422 where they alone would take more than three quarters"},
    {.name = "max-variants",
     .kind = OPTION_COUNT,
     .offset = AT(max_variants),
     .argument = "N",
     .preset = "0",
     .least = 0,
     .most = 4096,
     .help = "Most variants of reflectance that clients may create; they need --token-file"},
    {0},
};
static const option_row connection_rows[] = {
    {.name = "listen",
     .kind = OPTION_TEXT,
     .offset = AT(listen_address),
     .argument = "HOST:PORT",
     .preset = "127.0.0.1:8317",
     .help = "Address to listen on; port 0 takes a free one"},
    {.name = "unix",
     .kind = OPTION_TEXT,
     .offset = AT(unix_path),
     .argument = "PATH",
     .help = "Listen on a socket in the file system instead"},
    {.name = "token-file",
     .kind = OPTION_TEXT,
     .offset = AT(token_file),
     .argument = "FILE",
     .help =
         "Ask under /v1 for a bearer token of this file: lines of TOKEN [read] [vary] [metrics] [name=TEXT]"},
    {.name = "allow-host",
     .kind = OPTION_LIST,
     .offset = AT(allowed_hosts),
     .argument = "NAME",
     .help = "Answer to this Host, too, beside localhost and the address of --listen; may be given again"},
    {.name = "allow-origin",
     .kind = OPTION_LIST,
     .offset = AT(allowed_origins),
     .argument = "ORIGIN",
     .help =
         "Let pages of this origin, https://HOST[:PORT], ask and read answers (CORS); may be given again"},
    {.name = "trusted-proxy",
     .kind = OPTION_LIST,
     .offset = AT(trusted_proxies),
     .argument = "ADDRESS[/BITS]|unix",
     .help =
         "Believe this proxy about the client's address (Forwarded, X-Forwarded-For); may be given again"},
    {.name = "no-viewer",
     .kind = OPTION_FLAG,
     .offset = AT(no_viewer),
     .help = "Serve no page at /, only the routes"},
    {.name = "access-log",
     .kind = OPTION_TEXT,
     .offset = AT(access_log),
     .argument = "-|FILE",
     .help = "Write one line of JSON for each request"},
    {0},
};
static const option_row limit_rows[] = {
    {.name = "threads",
     .kind = OPTION_COUNT,
     .offset = AT(threads),
     .argument = "T",
     .otherwise = "one per core, fewer where affinity or a control group allows fewer",
     .least = 1,
     .most = 4096,
     .help = "Threads that compute, all requests together"},
    {.name = "max-body",
     .kind = OPTION_SIZE,
     .offset = AT(max_body),
     .argument = "SIZE",
     .preset = "256M",
     .least = 1,
     .most = SIZE_MOST,
     .help = "Longest request body"},
    {.name = "max-batch",
     .kind = OPTION_COUNT,
     .offset = AT(max_batch),
     .argument = "N",
     .preset = "1024",
     .least = 1,
     .most = 1 << 20,
     .help = "Most vectors in a request"},
    {.name = "max-inflight",
     .kind = OPTION_COUNT,
     .offset = AT(max_inflight),
     .argument = "N",
     .preset = "256",
     .least = 1,
     .most = 1 << 20,
     .help = "Most solves that wait or run; further ones are answered 503"},
    {.name = "max-buffered",
     .kind = OPTION_SIZE,
     .offset = AT(max_buffered),
     .argument = "SIZE",
     .otherwise = "4 times --max-body",
     .least = 1,
     .most = SIZE_MOST,
     .help = "Most bytes of request bodies held at once; further ones are answered 503"},
    {.name = "max-connections",
     .kind = OPTION_COUNT,
     .offset = AT(max_connections),
     .argument = "N",
     .preset = "1000",
     .least = 1,
     .most = 1 << 16,
     .help = "Most open connections; above this, idle ones are closed for new ones"},
    {.name = "timeout",
     .kind = OPTION_COUNT,
     .offset = AT(timeout_s),
     .argument = "SECONDS",
     .preset = "60",
     .unit = "s",
     .least = 1,
     .most = 86400,
     .help = "Close a connection whose request lacks a part of its head for this long"},
    {.name = "keep-alive",
     .kind = OPTION_COUNT,
     .offset = AT(keep_alive_s),
     .argument = "SECONDS",
     .preset = "75",
     .unit = "s",
     .least = 1,
     .most = 86400,
     .help = "Close a connection that is idle between requests for this long; a balancer in front should "
             "close its own earlier"},
    {.name = "request-timeout",
     .kind = OPTION_COUNT,
     .offset = AT(request_timeout_s),
     .argument = "SECONDS",
     .preset = "300",
     .unit = "s",
     .least = 1,
     .most = 86400,
     .help = "Most time from the head of a request to the last byte of its answer; a client may ask for less "
             "by Lambert-Timeout: SECONDS"},
    {.name = "drain-delay",
     .kind = OPTION_COUNT,
     .offset = AT(drain_delay_s),
     .argument = "SECONDS",
     .preset = "0",
     .unit = "s",
     .least = 0,
     .most = 86400,
     .help = "On SIGTERM go on accepting for this long while /readyz is 503, so that balancers turn away"},
    {.name = "shutdown-timeout",
     .kind = OPTION_COUNT,
     .offset = AT(shutdown_timeout_s),
     .argument = "SECONDS",
     .preset = "25",
     .unit = "s",
     .least = 0,
     .most = 86400,
     .help = "Then finish what runs for at most this long; what still waits is answered 503"},
    {.name = "min-rate",
     .kind = OPTION_SIZE,
     .offset = AT(min_rate),
     .argument = "SIZE",
     .preset = "16K",
     .unit = "a second",
     .least = 1,
     .most = SIZE_MOST,
     .help = "Slowest rate, on average over --timeout, at which a client may send a body or read an answer"},
    {0},
};
static const option_row other_rows[] = {
    {.name = "version", .kind = OPTION_FLAG, .offset = AT(version), .help = "Print the version and stop"},
    {0},
};

static const option_command daemon_command = {
    .name = "lambertd",
    .arguments = "STORE.h5[:NAME] ... | --stores DIR",
    .summary = "Answer over HTTP the radiosity of scenes under any emission.",
    .notes = "SIGHUP reads the stores again; SIGTERM finishes running requests and exits, a second one "
             "within a second.",
    .most_arguments = SIZE_MAX,
};

/* Threads and processes beside those that compute: the one for short solves, main, input and output,
 * connections, those that are closed, verification, variants, a child that opens a store. */
enum { BESIDE = 8 };

/* A machine that does not tell is taken to have this much. */
#define UNKNOWN_MEMORY ((uint64_t)2 << 30)

/* Fills in threads and the memory of requests, half of all, where they were not given. */
static void choose_by_machine(config *c) {
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    const uint64_t all = pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page : UNKNOWN_MEMORY;
    machine limits;
    machine_read("", &limits);
    if (c->threads == 0) c->threads = machine_threads(&limits, BESIDE, c->threads_why, sizeof c->threads_why);
    if (c->max_request_memory == 0)
        c->max_request_memory = (limits.memory_most < all ? limits.memory_most : all) / 2;
}

int config_read(config *c, int argc, char **argv) {
    const option_table tables[] = {{"stores", store_rows, c},
                                   {"connections", connection_rows, c},
                                   {"limits", limit_rows, c},
                                   {"other", other_rows, c},
                                   {0}};
    option_result given;
    *c = (config){.threads = 0};
    const int code = options_parse(&daemon_command, tables, argc, argv, &given);
    if (code != OPTIONS_GO) return code;
    if (c->version) {
        puts("lambertd " LAMBERT_VERSION);
        return 0;
    }
    c->stores = given.arguments;
    c->n_stores = given.n_arguments;
    if (c->n_stores == 0 && c->stores_dir == NULL)
        return options_usage(daemon_command.name, "no store is given; usage: lambertd %s",
                             daemon_command.arguments);
    if (c->threads == 0 || c->max_request_memory == 0) choose_by_machine(c);
    if (c->max_buffered == 0) c->max_buffered = 4 * c->max_body;
    if (c->max_buffered < c->max_body)
        return options_usage(daemon_command.name, "--max-buffered %zu: must be at least --max-body (%zu)",
                             c->max_buffered, c->max_body);
    return OPTIONS_GO;
}
