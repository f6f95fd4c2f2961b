#include "store/large_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* The name of the file between its creation and the unlink that follows. */
#define NAME "large-array"

struct large_file {
    const large_place *place;
    int fd;
    void *bytes; /* NULL: nothing is mapped */
    size_t n_bytes;
};

lam_status large_file_create(const large_place *place, large_file **out, lam_error *error) {
    large_file *f = memory_allocate(1, sizeof *f, "a large array", error);
    if (f == NULL) return LAM_ERR_MEMORY;
    f->place = place;
    f->fd = openat(place->folder, NAME, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (f->fd < 0 || unlinkat(place->folder, NAME, 0) != 0) {
        const lam_status status =
            status_fail(error, LAM_ERR_IO, "%s/" NAME ": %s", place->name, strerror(errno));
        large_file_free(f);
        return status;
    }
    *out = f;
    return LAM_OK;
}

/* Reserves disk space; returns an error number. */
static int set_length(const large_file *f, size_t n_bytes) {
    if (n_bytes > f->n_bytes) {
        const int why = posix_fallocate(f->fd, 0, (off_t)n_bytes);
        if (why == 0) return 0;
        return ftruncate(f->fd, (off_t)f->n_bytes) == 0 ? why : errno;
    }
    return ftruncate(f->fd, (off_t)n_bytes) == 0 ? 0 : errno;
}

lam_status large_file_resize(large_file *f, size_t n_bytes, void **bytes, lam_error *error) {
    if (n_bytes == 0) n_bytes = 1; /* an empty file cannot be mapped */
    const int why = n_bytes > f->n_bytes ? set_length(f, n_bytes) : 0;
    if (why != 0)
        return status_fail(error, LAM_ERR_IO, "%s: no room for an array of %zu bytes: %s", f->place->name,
                           n_bytes, strerror(why));
    void *map = f->bytes == NULL ? mmap(NULL, n_bytes, PROT_READ | PROT_WRITE, MAP_SHARED, f->fd, 0)
                                 : mremap(f->bytes, f->n_bytes, n_bytes, MREMAP_MAYMOVE);
    if (map == MAP_FAILED)
        return status_fail(error, LAM_ERR_MEMORY, "%s: an array of %zu bytes cannot be mapped: %s",
                           f->place->name, n_bytes, strerror(errno));
    f->bytes = map;
    /* Failing to shrink the file only wastes space. */
    if (n_bytes < f->n_bytes) set_length(f, n_bytes);
    f->n_bytes = n_bytes;
    *bytes = map;
    return LAM_OK;
}

void large_file_free(large_file *f) {
    if (f == NULL) return;
    if (f->bytes != NULL) munmap(f->bytes, f->n_bytes);
    if (f->fd >= 0) close(f->fd);
    free(f);
}
