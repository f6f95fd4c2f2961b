/* lambert view: runs a daemon of its own for some stores and opens the viewer in the browser. Knows of the
 * daemon its name, its options and the line that says where it listens. */
#include "solver/base/options/options.h"
#include "solver/base/terminal.h"
#include "solver/light/emission.h"
#include "solver/verbs/sibling.h"
#include "solver/verbs/verbs.h"
#include "solver/verbs/view_link.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

/* The status of a child whose program cannot be run, as shells have it. */
enum { NOT_FOUND = 127 };

/* The pause between two looks at signals and the browser. */
enum { PAUSE_MS = 200 };

static const char announced[] = "listening on ";

typedef struct view_options {
    bool no_browser;
    option_list emit, dim;
} view_options;

static const option_row rows[] = {
    {.name = "emit",
     .kind = OPTION_LIST,
     .offset = offsetof(view_options, emit),
     .argument = "GROUP=V[,V,V][UNIT]",
     .otherwise = "the emission in the scene",
     .help = "The page begins with the first store lit by these groups alone, as the address says, with "
             "units as `lambert solve` has them; may be repeated"},
    {.name = "dim",
     .kind = OPTION_LIST,
     .offset = offsetof(view_options, dim),
     .argument = "NAME=V[,V,V]",
     .otherwise = "as their list says",
     .help = "The same of luminaires and groups of them, as `lambert solve` has it; alone or beside --emit"},
    {.name = "no-browser",
     .kind = OPTION_FLAG,
     .offset = offsetof(view_options, no_browser),
     .help = "Only print the address"},
    {0},
};

enum { STORES_MOST = 256 };

static const option_command verb = {
    .name = "lambert view",
    .arguments = "STORE.h5[:NAME]...",
    .summary =
        "Serve stores to this machine alone, by a lambertd of its own on a free port of the loopback, and "
        "open their viewer in the browser: by $BROWSER, else xdg-open. Prints the address.",
    .notes =
        "Ctrl-C ends the daemon, and so does the end of `lambert view`. Exit status: that of the daemon, 1 "
        "where no store can be served.",
    .least_arguments = 1,
    .most_arguments = STORES_MOST,
};

/* The daemon, its standard output and the browser. */
typedef struct viewing {
    pid_t daemon, browser; /* 0: none */
    int output;            /* -1: closed */
    char line[512];        /* of the output, as far as it came */
    size_t length;
    bool told; /* the daemon was asked to end */
    const view_options *options;
    const char *fragment; /* of the address: the lights of --emit and --dim, or "" */
} viewing;

/* Becomes the daemon, in a process group of its own: Ctrl-C on a terminal comes to `lambert view` alone,
 * which passes it on once, because a second signal would hurry the daemon. */
static void become_daemon(char *const *stores, size_t n_stores, int output, pid_t parent) {
    static char name[] = "lambertd", listen[] = "--listen", where[] = "127.0.0.1:0", end[] = "--";
    char *arguments[STORES_MOST + 5] = {name, listen, where, end};
    for (size_t k = 0; k < n_stores; k++) arguments[4 + k] = stores[k];
    (void)setpgid(0, 0);
    (void)prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(0); /* it ended before the line above */
    if (dup2(output, STDOUT_FILENO) >= 0) sibling_execute(arguments);
    fprintf(stderr,
            "lambert view: the program lambertd cannot be run: %s; build the target lambertd, and install it "
            "beside lambert or in PATH\n",
            strerror(errno));
    _exit(NOT_FOUND);
}

static lam_status start_daemon(viewing *v, char *const *stores, size_t n_stores, lam_error *error) {
    lam_status status = LAM_OK;
    int ends[2];
    const pid_t own = getpid();
    if (pipe2(ends, O_CLOEXEC) != 0) FAIL(error, LAM_ERR_IO, "lambertd cannot be run: %s", strerror(errno));
    v->output = ends[0];
    v->daemon = fork();
    if (v->daemon == 0) become_daemon(stores, n_stores, ends[1], own);
    close(ends[1]);
    if (v->daemon < 0) {
        v->daemon = 0;
        FAIL(error, LAM_ERR_IO, "lambertd cannot be run: %s", strerror(errno));
    }
done:
    return status;
}

/* Starts the browser, without a shell and in a group of its own, which Ctrl-C does not reach. */
static void open_browser(viewing *v, char *address, terminal *t) {
    static char preset[] = "xdg-open";
    char *given = getenv("BROWSER"), *program = given != NULL && given[0] != '\0' ? given : preset;
    char *arguments[] = {program, address, NULL};
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    int failed = ENOMEM;
    if (posix_spawn_file_actions_init(&actions) != 0) return;
    if (posix_spawnattr_init(&attributes) == 0) {
        (void)posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
        if (posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0) == 0 &&
            posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0) == 0 &&
            posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0) == 0)
            failed = posix_spawnp(&v->browser, program, &actions, &attributes, arguments, environ);
        posix_spawnattr_destroy(&attributes);
    }
    posix_spawn_file_actions_destroy(&actions);
    if (failed == 0) return;
    v->browser = 0;
    terminal_log(t, "%s cannot be run: %s; open the address in a browser", program, strerror(failed));
}

/* Says where the browser could not open the address. */
static void look_at_browser(viewing *v, terminal *t) {
    int ended;
    if (v->browser == 0 || waitpid(v->browser, &ended, WNOHANG) != v->browser) return;
    v->browser = 0;
    if (!WIFEXITED(ended) || WEXITSTATUS(ended) != 0)
        terminal_log(t, "the browser did not open the address; open it yourself");
}

/* A line of the daemon: its address, when its stores are loaded, or one for the log. */
static void take_line(viewing *v, terminal *t) {
    v->line[v->length] = '\0';
    v->length = 0;
    if (strncmp(v->line, announced, sizeof announced - 1) != 0) {
        terminal_log(t, "%s", v->line);
        return;
    }
    const char *address = v->line + sizeof announced - 1;
    char *whole = NULL;
    if (asprintf(&whole, "%s/%s", address, v->fragment) < 0) return;
    puts(whole);
    fflush(stdout);
    if (!v->options->no_browser) open_browser(v, whole, t);
    free(whole);
}

/* Takes what the daemon has written; closes its output at the end of it. */
static void take_output(viewing *v, terminal *t) {
    char text[1024];
    const ssize_t got = read(v->output, text, sizeof text);
    if (got < 0 && errno == EINTR) return;
    for (ssize_t i = 0; i < got; i++) {
        if (text[i] == '\n')
            take_line(v, t);
        else if (v->length + 2 < sizeof v->line)
            v->line[v->length++] = text[i];
    }
    if (got > 0) return;
    close(v->output);
    v->output = -1;
}

/* Passes the first signal on to the daemon. */
static void pass_signal(viewing *v) {
    if (v->told || !terminal_cancelled()) return;
    v->told = true;
    kill(v->daemon, SIGTERM);
}

/* Waits for the daemon to end and returns its exit status. */
static int stay(viewing *v, terminal *t) {
    int ended = 0;
    while (v->output >= 0) {
        struct pollfd waiting = {.fd = v->output, .events = POLLIN};
        const int ready = poll(&waiting, 1, PAUSE_MS);
        pass_signal(v);
        look_at_browser(v, t);
        if (ready > 0) take_output(v, t);
    }
    while (waitpid(v->daemon, &ended, 0) < 0 && errno == EINTR) pass_signal(v);
    if (WIFSIGNALED(ended)) {
        fprintf(stderr, "lambert view: lambertd was ended by signal %d\n", WTERMSIG(ended));
        return 1;
    }
    return WEXITSTATUS(ended) == NOT_FOUND ? 1 : WEXITSTATUS(ended);
}

int cmd_view(int argc, char **argv) {
    view_options options = {0};
    option_result result = {0};
    lam_error error = {0};
    terminal t;
    viewing v = {.output = -1, .options = &options};
    char *fragment = NULL;
    int code;
    const option_table tables[] = {{NULL, rows, &options}, {0}};
    const int go = options_parse(&verb, tables, argc, argv, &result);
    if (go != OPTIONS_GO) return go;
    if (emission_check_items(&options.emit, &error) != LAM_OK ||
        emission_check_dims(&options.dim, &error) != LAM_OK)
        return options_usage(verb.name, "%s", error.message);
    terminal_open(&t, verb.name, false, false);
    if (view_link(result.arguments[0], &options.emit, &options.dim, &fragment, &error) == LAM_OK &&
        start_daemon(&v, result.arguments, result.n_arguments, &error) == LAM_OK) {
        v.fragment = fragment;
        code = stay(&v, &t);
    } else {
        code = terminal_fail(&t, &error);
    }
    free(fragment);
    return code;
}
