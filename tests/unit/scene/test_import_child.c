/* The importer's child process may fail in any way: the parent survives it and reports it in one line. */
#include "support/suite.h"

#include "solver/scene/import/imported_faces.h"
#include "store/confined.h"
#include "support/scene.h"

#include <dirent.h>
#include <fcntl.h>
#include <omp.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

/* A folder that each test has to itself. */
static char folder[64];

static void setup(void) {
    folder_make(folder);
}

static void teardown(void) {
    folder_remove(folder);
}

static lam_status reads_well(const char *path, imported_faces *s, lam_error *error) {
    const uint32_t corners[3] = {0, 1, 2};
    (void)path;
    for (int i = 0; i < 3; i++) {
        lam_status status = imported_faces_add_vertex(s, (const double[3]){i == 1, i == 2, 0}, error);
        if (status != LAM_OK) return status;
    }
    return imported_faces_add_polygon(s, corners, 3, TABLE_NONE, TABLE_NONE, 0, error);
}

static lam_status crashes(const char *path, imported_faces *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    raise(SIGSEGV);
    return LAM_OK;
}

static lam_status aborts(const char *path, imported_faces *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    abort();
}

static lam_status leaves(const char *path, imported_faces *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    _exit(0);
}

static lam_status spins(const char *path, imported_faces *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    for (volatile unsigned i = 0; i < 1000; i = 0) continue;
    return LAM_OK;
}

static lam_status sleeps(const char *path, imported_faces *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    while (pause() < 0) continue;
    return LAM_OK;
}

static lam_status hoards(const char *path, imported_faces *s, lam_error *error) {
    void *all = memory_allocate(3, (size_t)1 << 30, "hoard", error);
    if (all == NULL) return LAM_ERR_MEMORY;
    free(all);
    return reads_well(path, s, error);
}

static lam_status writes_a_file(const char *path, imported_faces *s, lam_error *error) {
    FILE *file = fopen(path, "w");
    if (file == NULL) return status_fail(error, LAM_ERR_IO, "%s: could not even open it", path);
    fputs("written by the child", file);
    fclose(file);
    return reads_well(path, s, error);
}

/* Tries to do more than read files. */
static lam_status reaches_out(const char *path, imported_faces *s, lam_error *error) {
    char made[300];
    (void)s;
    snprintf(made, sizeof made, "%s-made", path);
    const int sockets = socket(AF_INET, SOCK_STREAM, 0) >= 0 || socket(AF_UNIX, SOCK_STREAM, 0) >= 0;
    const int killed = kill(getppid(), 0) == 0, children = fork() >= 0,
              programs = execl("/bin/true", "true", (char *)NULL) == 0,
              is_made = open(made, O_RDONLY | O_CREAT, 0600) >= 0 || open(path, O_RDWR) >= 0 ||
                        mkdir(made, 0700) == 0 || rename(path, made) == 0 || unlink(path) == 0,
              is_read = open(path, O_RDONLY) >= 0;
    return status_fail(error, LAM_ERR_IO,
                       "%s: %d sockets, %d killed, %d children, %d programs, %d made, %d read", path, sockets,
                       killed, children, programs, is_made, is_read);
}

/* Opens a file on every descriptor but standard input, output and error, where the reply's pipe must be. */
static lam_status babbles(const char *path, imported_faces *s, lam_error *error) {
    (void)path, (void)s, (void)error;
    static const char nonsense[65536] = "lamsoup";
    for (int fd = 3; fd < 32; fd++)
        if (write(fd, nonsense, sizeof nonsense) < 0) continue;
    _exit(0);
}

static lam_status lies_about_corners(const char *path, imported_faces *s, lam_error *error) {
    (void)path;
    /* only the parent checks after imported_faces_split: an element is added by hand */
    lam_status status = reads_well(path, s, error);
    struct imported_element *element = calloc(64, sizeof *element);
    for (int i = 0; i < 4; i++) element->corners[i] = 1000000;
    s->elements = element;
    s->n_elements = 1;
    s->element_capacity = 64;
    return status;
}

/* Two lights of one name. */
static lam_status lies_about_lights(const char *path, imported_faces *s, lam_error *error) {
    const punctual_light light = {.name = "a", .kind = PUNCTUAL_POINT, .intensity = 1};
    s->punctual = calloc(2, sizeof *s->punctual);
    s->punctual[s->n_punctual++] = light;
    s->punctual[s->n_punctual++] = light;
    return reads_well(path, s, error);
}

static lam_status run_child(scene_reader *reader, imported_faces *s, lam_error *error) {
    const child_limits limits = {.cpu_seconds = 1, .memory_bytes = (size_t)1 << 30};
    char path[256];
    file_write(folder, "scene.xyz", "untouched", path);
    return import_in_child(reader, path, &limits, s, error);
}

START_TEST(child_is_survived) {
    const struct {
        scene_reader *reader;
        lam_status status;
        const char *says;
    } cases[] = {
        {crashes, LAM_ERR_FORMAT, "the importer crashed (signal 11)"},
        {aborts, LAM_ERR_FORMAT, "the importer crashed (signal 6)"},
        {leaves, LAM_ERR_FORMAT, "without an answer"},
        {spins, LAM_ERR_FORMAT, "more than its 1 s"},
        {sleeps, LAM_ERR_FORMAT, "more than its 1 s"},
        {babbles, LAM_ERR_INTERNAL, "damaged reply"},
        {lies_about_corners, LAM_ERR_INTERNAL, "damaged reply"},
        {lies_about_lights, LAM_ERR_INTERNAL, "damaged reply"},
#ifndef LAMBERT_SANITIZED /* where address space cannot be limited, and a killed write ends in another way   \
                           */
        {hoards, LAM_ERR_MEMORY, "more than its 1024 MiB"},
#endif
#ifdef LAMBERT_SANITIZED /* has no filter of calls; SIGXFSZ */
        {writes_a_file, LAM_ERR_FORMAT, "crashed (signal 25)"},
#else
        {writes_a_file, LAM_ERR_IO, "could not even open it"},
        {reaches_out, LAM_ERR_IO, "0 sockets, 0 killed, 0 children, 0 programs, 0 made, 1 read"},
#endif
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        imported_faces s = {0};
        lam_error error = {0};
        const lam_status status = run_child(cases[i].reader, &s, &error);
        ck_assert_msg(status == cases[i].status && strstr(error.message, cases[i].says) != NULL,
                      "case %zu: status %d, %s", i, (int)status, error.message);
        ck_assert_ptr_null(s.elements);
    }
    (void)hoards;
    (void)reaches_out;
    imported_faces s = {0};
    lam_error error = {0};
    ck_assert_int_eq(run_child(reads_well, &s, &error), LAM_OK);
    ck_assert_uint_eq(s.n_elements, 1);
    imported_faces_free(&s);
}
END_TEST

static void do_nothing(void *context) {
    (void)context;
}

/* The OpenMP of clang would leave some for each fork after its first use, by which a later process of the
 * child's number crashes. */
START_TEST(child_leaves_no_shared_memory) {
    const confined_limits limits = {.cpu_seconds = 10, .all_seconds = 30, .memory_bytes = (size_t)64 << 20};
    lam_error error;
    confined child;
    char number[32];
    int how = 0;
    ck_assert_int_ge(omp_get_max_threads(), 1);
    ck_ok(confined_start(do_nothing, NULL, -1, &limits, folder, &child, &error));
    ck_ok(confined_end(&child, false, folder, &how, &error));
    ck_assert_int_eq(how, 0);
    snprintf(number, sizeof number, "_%d_", (int)child.pid);
    DIR *shared = opendir("/dev/shm");
    ck_assert_ptr_nonnull(shared);
    for (const struct dirent *e = readdir(shared); e != NULL; e = readdir(shared))
        ck_assert_msg(strstr(e->d_name, number) == NULL, "%s", e->d_name);
    closedir(shared);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("import_child");
    TCase *tests = tcase_create("import_child");
    tcase_set_timeout(tests, 300);
    tcase_add_checked_fixture(tests, setup, teardown);
    tcase_add_test(tests, child_is_survived);
    tcase_add_test(tests, child_leaves_no_shared_memory);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
