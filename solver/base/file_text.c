#include "solver/base/file_text.h"

#include "solver/base/array_grow.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { PIPE_BYTES = 65536 };

/* Room for one byte more than the file seems to hold, so that its end is seen without growing again, and for
 * the NUL. */
static size_t first_capacity(FILE *file) {
    struct stat about;
    if (fstat(fileno(file), &about) != 0 || !S_ISREG(about.st_mode) || about.st_size < 0 ||
        (uint64_t)about.st_size > SIZE_MAX / 2)
        return PIPE_BYTES;
    return (size_t)about.st_size + 2;
}

lam_status file_text(const char *path, char **out, size_t *out_length, lam_error *error) {
    lam_status status = LAM_OK;
    char *text = NULL;
    size_t capacity = 0, length = 0;
    FILE *file = fopen(path, "rb");
    if (file == NULL) FAIL(error, LAM_ERR_IO, "%s: cannot read: %s", path, strerror(errno));
    while (!feof(file) && !ferror(file)) {
        if (capacity - length < 2)
            TRY(array_grow(&text, &capacity, capacity == 0 ? first_capacity(file) : capacity + 1, 1, path,
                           error));
        length += fread(text + length, 1, capacity - length - 1, file);
    }
    if (ferror(file)) FAIL(error, LAM_ERR_IO, "%s: cannot read: %s", path, strerror(errno));
    text[length] = '\0';
    *out = text;
    *out_length = length;
    text = NULL;
done:
    if (file != NULL) fclose(file);
    free(text);
    return status;
}
