/* Gives files, and the files of folders, to a fuzz harness one by one: what was found once stays found, and
 * the harnesses run where there is no fuzzer.
 *
 *     fuzz_NAME FILE|FOLDER ...
 */
#include "fuzz/fuzz.h"

#include <dirent.h>
#include <sys/stat.h>

static size_t replay(const char *path) {
    struct stat about;
    size_t count = 0;
    FUZZ_CHECK(stat(path, &about) == 0);
    if (S_ISDIR(about.st_mode)) {
        struct dirent **entries = NULL;
        const int n = scandir(path, &entries, NULL, alphasort);
        FUZZ_CHECK(n >= 0);
        for (int i = 0; i < n; i++) {
            char inside[4096];
            snprintf(inside, sizeof inside, "%s/%s", path, entries[i]->d_name);
            if (entries[i]->d_name[0] != '.') count += replay(inside);
            free(entries[i]);
        }
        free(entries);
        return count;
    }
    FILE *file = fopen(path, "rb");
    const size_t size = (size_t)about.st_size;
    uint8_t *data = malloc(size + 1);
    FUZZ_CHECK(file != NULL && data != NULL && fread(data, 1, size, file) == size);
    fclose(file);
    /* The copy has a size of its own, so that reading past its end is seen. */
    uint8_t *exact = malloc(size > 0 ? size : 1);
    FUZZ_CHECK(exact != NULL);
    memcpy(exact, data, size);
    free(data);
    LLVMFuzzerTestOneInput(exact, size);
    free(exact);
    return 1;
}

int main(int argc, char **argv) {
    size_t count = 0;
    for (int i = 1; i < argc; i++) count += replay(argv[i]);
    printf("%zu inputs\n", count);
    return count > 0 ? 0 : 1;
}
