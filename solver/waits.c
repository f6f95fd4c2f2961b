#include "solver/waits.h"

#include <limits.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <unistd.h>

/* libgomp reads its environment when it is loaded, before main and before any function of this program but
 * those of .preinit_array. They cannot add to the environment, as the C library takes it later from where the
 * kernel put it. But one of its entries may be replaced there: by the policy, for as long as libraries are
 * loaded, in place of a variable that none of them looks at. Where there is no such variable the program
 * starts once more, which takes some ten milliseconds. libomp reads its environment when it first needs it.
 */

static char policy[] = "OMP_WAIT_POLICY=passive";
static char *replaced; /* by it; NULL: nothing was */
static bool decided;   /* by the environment */

/* No function of the C library may be used yet, nor what sanitizers add to accesses. */
#define EARLY __attribute__((no_sanitize("address", "undefined", "thread")))

EARLY static bool has_name(const char *entry, const char *name) {
    while (*name != '\0' && *entry == *name) {
        entry++;
        name++;
    }
    return *name == '\0' && *entry == '=';
}

EARLY static bool is_one_of(const char *entry, const char *const *names) {
    while (*names != NULL && !has_name(entry, *names)) names++;
    return *names != NULL;
}

EARLY static void before_libraries(int argc, char **argv, char **environment) {
    static const char *const decide[] = {"OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "KMP_BLOCKTIME", NULL};
    static const char *const unread[] = {"_",    "SHLVL", "OLDPWD", "PWD",      "LOGNAME",
                                         "USER", "MAIL",  "SHELL",  "HOSTNAME", "INVOCATION_ID",
                                         "PATH", "TERM",  NULL};
    char **place = NULL;
    (void)argc;
    (void)argv;
    for (char **entry = environment; *entry != NULL; entry++) {
        if (is_one_of(*entry, decide)) decided = true;
        if (is_one_of(*entry, unread)) place = entry;
    }
    if (decided || place == NULL) return;
    replaced = *place;
    *place = policy;
}

__attribute__((section(".preinit_array"), used)) static void (*const first)(int, char **,
                                                                            char **) = before_libraries;

void waits_sleep(char **arguments) {
    char path[PATH_MAX] = "";
    if (decided) return;
    for (char **entry = environ; replaced != NULL && *entry != NULL; entry++)
        if (*entry == policy) *entry = replaced;
    if (getenv("OMP_WAIT_POLICY") != NULL || setenv("OMP_WAIT_POLICY", "passive", 1) != 0 || replaced != NULL)
        return;
    if (readlink("/proc/self/exe", path, sizeof path - 1) > 0) (void)execv(path, arguments);
}
