/* The HDF5 file driver of stores: plain reads and writes of a descriptor that we opened ourselves
 * (exclusive, close-on-exec, unlocked). A failed write is remembered, not reported: HDF5 cannot close a file
 * that it cannot write to, so it is left to believe that all is well and the store looks at file->error. */
#include "store/store_private.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct driver_file {
    H5FD_t base; /* first: HDF5 fills and reads it */
    store_file *file;
    haddr_t eoa; /* end of what HDF5 has allocated */
} driver_file;

/* The content of the file access properties. */
typedef struct driver_info {
    store_file *file;
} driver_info;

static store_file *driver_of(const H5FD_t *base) {
    return ((const driver_file *)base)->file;
}

static H5FD_t *driver_open(const char *name, unsigned flags, hid_t properties, haddr_t max_address) {
    (void)name;
    (void)max_address;
    const driver_info *info = H5Pget_driver_info(properties);
    if (info == NULL || ((flags & H5F_ACC_RDWR) != 0 && !info->file->writable)) return NULL;
    driver_file *driver = calloc(1, sizeof *driver);
    if (driver == NULL) return NULL;
    driver->file = info->file;
    return &driver->base;
}

static herr_t driver_close(H5FD_t *base) {
    free(base); /* the descriptor belongs to the store */
    return 0;
}

static int driver_compare(const H5FD_t *a, const H5FD_t *b) {
    uintptr_t first = (uintptr_t)driver_of(a), second = (uintptr_t)driver_of(b);
    return (first > second) - (first < second);
}

static herr_t driver_query(const H5FD_t *base, unsigned long *flags) {
    (void)base;
    *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
             H5FD_FEAT_AGGREGATE_SMALLDATA | H5FD_FEAT_DEFAULT_VFD_COMPATIBLE;
    return 0;
}

static haddr_t driver_get_eoa(const H5FD_t *base, H5FD_mem_t type) {
    (void)type;
    return ((const driver_file *)base)->eoa;
}

static herr_t driver_set_eoa(H5FD_t *base, H5FD_mem_t type, haddr_t address) {
    (void)type;
    ((driver_file *)base)->eoa = address;
    return 0;
}

static haddr_t driver_get_eof(const H5FD_t *base, H5FD_mem_t type) {
    (void)type;
    return driver_of(base)->size;
}

/* Reads up to size bytes; fewer at the end of the file alone. */
static ssize_t read_available(store_file *file, uint64_t offset, char *buffer, size_t size) {
    size_t done = 0;
    while (done < size) {
        ssize_t n = pread(file->fd, buffer + done, size - done, (off_t)(offset + done));
        if (n == 0) break;
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) {
            if (file->error == 0) file->error = errno;
            return -1;
        }
        done += (size_t)n;
    }
    return (ssize_t)done;
}

bool store_file_read(store_file *file, uint64_t offset, void *buffer, size_t size) {
    ssize_t n = read_available(file, offset, buffer, size);
    if (n >= 0 && (size_t)n < size && file->error == 0) file->error = EIO;
    return n >= 0 && (size_t)n == size;
}

static herr_t driver_read(H5FD_t *base, H5FD_mem_t type, hid_t transfer, haddr_t address, size_t size,
                          void *buffer) {
    (void)type;
    (void)transfer;
    store_file *file = driver_of(base);
    if (!file->writable) return store_file_read(file, address, buffer, size) ? 0 : -1;
    /* Bytes that were allocated and never written, or dropped, read as zero. */
    ssize_t n = read_available(file, address, buffer, size);
    if (n < 0) n = 0;
    memset((char *)buffer + n, 0, size - (size_t)n);
    return 0;
}

static herr_t driver_write(H5FD_t *base, H5FD_mem_t type, hid_t transfer, haddr_t address, size_t size,
                           const void *buffer) {
    (void)type;
    (void)transfer;
    store_file *file = driver_of(base);
    if (!file->writable) return -1;
    size_t done = 0;
    while (done < size && file->error == 0) {
        ssize_t n = pwrite(file->fd, (const char *)buffer + done, size - done, (off_t)(address + done));
        if (n < 0 && errno == EINTR) continue;
        if (n < 0)
            file->error = errno;
        else
            done += (size_t)n;
    }
    if (address + size > file->size) file->size = address + size;
    return 0;
}

static herr_t driver_truncate(H5FD_t *base, hid_t transfer, hbool_t closing) {
    (void)transfer;
    (void)closing;
    store_file *file = driver_of(base);
    haddr_t eoa = ((driver_file *)base)->eoa;
    if (!file->writable || eoa == file->size) return 0;
    if (file->error == 0 && ftruncate(file->fd, (off_t)eoa) != 0) file->error = errno;
    file->size = eoa;
    return 0;
}

static const H5FD_class_t driver_class = {
#ifdef H5FD_CLASS_VERSION /* HDF5 1.14 and later, which keep the values below 512 for themselves */
    .version = H5FD_CLASS_VERSION,
    .value = 512,
#endif
    .name = "lambert",
    .maxaddr = (haddr_t)INT64_MAX,
    .fc_degree = H5F_CLOSE_STRONG,
    .fapl_size = sizeof(driver_info),
    .open = driver_open,
    .close = driver_close,
    .cmp = driver_compare,
    .query = driver_query,
    .get_eoa = driver_get_eoa,
    .set_eoa = driver_set_eoa,
    .get_eof = driver_get_eof,
    .read = driver_read,
    .write = driver_write,
    .truncate = driver_truncate,
    .fl_map = H5FD_FLMAP_DICHOTOMY,
};

hid_t store_driver_properties(store_file *file) {
    const driver_info info = {.file = file};
    if (file->driver < 0) file->driver = H5FDregister(&driver_class);
    if (file->driver < 0) return -1;
    hid_t properties = H5Pcreate(H5P_FILE_ACCESS);
    if (properties >= 0 && (H5Pset_driver(properties, file->driver, &info) < 0 ||
                            H5Pset_fclose_degree(properties, H5F_CLOSE_STRONG) < 0)) {
        H5Pclose(properties);
        properties = -1;
    }
    return properties;
}

void store_driver_release(store_file *file) {
    if (file->driver >= 0) H5FDunregister(file->driver);
    file->driver = -1;
}
