/* Finished blocks of packed rows are appended to a scratch file, each behind a head with checksums. The next
 * run finds them again: it cuts off a block that is not whole, and takes one whose checksum differs as
 * missing. The head of the file names scene, version and recipe, and another run's file is refused. */
#include "solver/formfactor/rows/row_file.h"
#include "solver/formfactor/source.h"

#include "solver/base/clock.h"
#include "store/store.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

/* The file: a header, then blocks in the order in which they were finished. Each block is a block_head, a
 * row_head for every row, the packed rows, and with a sky the shares of each row's rays on the ground (f64)
 * and on the tiles (f32). All numbers are little-endian, as in memory. */
#define MAGIC "lambert rows\n"
enum { FORMAT_VERSION = 1 };

/* A power failure loses at most the blocks of this time. */
static const double flush_seconds = 5;

/* Every field is a machine word or a text of whole words, so that no padding is hashed. */
typedef struct file_head {
    char magic[16];
    uint64_t version;
    char tool[32];     /* the version: another one may sample differently */
    char geometry[40]; /* 32 digits */
    uint64_t n, block_rows, kind;
    uint64_t method, rays, resolution, seed;
    double accuracy;
    char sky[32];      /* the tiling and what is up; empty: none */
    uint64_t checksum; /* of all before */
} file_head;

typedef struct block_head {
    uint64_t block, n_rows, bytes; /* of all that follows it */
    uint64_t checksum;             /* of that */
    uint64_t own;                  /* of all before */
} block_head;

typedef struct row_head {
    double leaving, absorbed;
    uint32_t n_bytes, n_entries;
} row_head;

_Static_assert(sizeof(row_head) == 24 && sizeof(block_head) == 40, "no padding");

struct row_file {
    int fd;
    char *path;
    const uint32_t *order;
    row_file_contents contents;
    size_t n_blocks, n_there, kept;
    uint64_t *offset; /* [n_blocks], of the bytes behind a block's head; 0: missing */
    uint64_t end;     /* of the last whole block */
    double flushed;   /* clock_seconds */
};

static size_t block_first(const row_file *f, size_t block) {
    return block * f->contents.block_rows;
}

static size_t block_length(const row_file *f, size_t block) {
    const size_t first = block_first(f, block), rest = f->contents.n - first;
    return rest < f->contents.block_rows ? rest : f->contents.block_rows;
}

/* Bytes of one row's shares on the ground and the tiles. */
static size_t sky_bytes(const row_file *f) {
    const sky_bounce *sky = f->contents.sky;
    return sky == NULL ? 0 : sizeof(double) + sky->tiling.n_tiles * sizeof(float);
}

static void sky_store(const sky_bounce *sky, size_t element, char *to) {
    memcpy(to, &sky->ground[element], sizeof(double));
    to += sizeof(double);
    for (size_t t = 0; t < sky->tiling.n_tiles; t++, to += sizeof(float))
        memcpy(to, &sky->first_bounce[t * sky->n + element], sizeof(float));
}

static void sky_fetch(sky_bounce *sky, size_t element, const uint8_t *from) {
    memcpy(&sky->ground[element], from, sizeof(double));
    from += sizeof(double);
    for (size_t t = 0; t < sky->tiling.n_tiles; t++, from += sizeof(float))
        memcpy(&sky->first_bounce[t * sky->n + element], from, sizeof(float));
}

static bool read_all(int fd, void *to, size_t bytes, uint64_t offset) {
    for (size_t done = 0; done < bytes;) {
        const ssize_t got = pread(fd, (char *)to + done, bytes - done, (off_t)(offset + done));
        if (got < 0 && errno == EINTR) continue;
        if (got == 0) errno = EIO;
        if (got <= 0) return false;
        done += (size_t)got;
    }
    return true;
}

static bool write_all(int fd, const void *from, size_t bytes, uint64_t offset) {
    for (size_t done = 0; done < bytes;) {
        const ssize_t put = pwrite(fd, (const char *)from + done, bytes - done, (off_t)(offset + done));
        if (put < 0 && errno == EINTR) continue;
        if (put == 0) errno = ENOSPC;
        if (put <= 0) return false;
        done += (size_t)put;
    }
    return true;
}

static lam_status file_failed(const row_file *f, lam_error *error) {
    return status_fail(error, LAM_ERR_IO,
                       "%s: %s; %zu of %zu blocks stay there: make room and run the same command again",
                       f->path, strerror(errno), f->n_there, f->n_blocks);
}

static void head_fill(const row_file_contents *c, file_head *head) {
    memset(head, 0, sizeof *head);
    memcpy(head->magic, MAGIC, sizeof MAGIC);
    head->version = FORMAT_VERSION;
    strncpy(head->tool, LAMBERT_VERSION, sizeof head->tool - 1);
    memcpy(head->geometry, c->geometry, sizeof c->geometry);
    head->n = c->n;
    head->block_rows = c->block_rows;
    head->kind = c->kind;
    head->method = (uint32_t)source_number(&c->recipe);
    head->rays = c->recipe.rays;
    head->resolution = c->recipe.resolution;
    head->seed = c->recipe.seed;
    head->accuracy = c->recipe.accuracy;
    if (c->sky != NULL)
        snprintf(head->sky, sizeof head->sky, "%s %c", c->sky->tiling.name, c->sky->tiling.up);
    head->checksum = store_checksum(head, offsetof(file_head, checksum));
}

/* Compares the header with ours. A file that ends inside the header holds no rows yet and gets ours. */
static lam_status check_head(row_file *f, uint64_t size, lam_error *error) {
    lam_status status = LAM_OK;
    file_head ours, theirs;
    memset(&theirs, 0, sizeof theirs);
    head_fill(&f->contents, &ours);
    const size_t there = size < sizeof theirs ? (size_t)size : sizeof theirs;
    if (!read_all(f->fd, &theirs, there, 0)) TRY(file_failed(f, error));
    if (memcmp(theirs.magic, ours.magic, there < sizeof ours.magic ? there : sizeof ours.magic) != 0)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: is not a scratch file of lambert; use another folder", f->path);
    if (there == sizeof theirs && memcmp(&theirs, &ours, sizeof ours) != 0) {
        const bool whole = theirs.checksum == store_checksum(&theirs, offsetof(file_head, checksum));
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: %s; finish that run, remove the file, or use another --scratch folder", f->path,
             !whole ? "its head is damaged"
             : memcmp(theirs.geometry, ours.geometry, sizeof ours.geometry) != 0
                 ? "holds the rows of another scene"
             : theirs.version != ours.version || memcmp(theirs.tool, ours.tool, sizeof ours.tool) != 0
                 ? "was made by another version of lambert"
                 : "holds the rows of a run with other options");
    }
    if (there < sizeof theirs && !write_all(f->fd, &ours, sizeof ours, 0)) TRY(file_failed(f, error));
    f->end = sizeof ours;
done:
    return status;
}

/* True where the rows of a block that was read are valid. */
static bool check_block(const row_file *f, size_t block, const void *data, size_t bytes) {
    const size_t n_rows = block_length(f, block);
    const row_head *heads = data;
    uint64_t at = n_rows * sizeof *heads;
    for (size_t r = 0; r < n_rows; r++) {
        const packed_row row = {(const uint8_t *)data + at, heads[r].n_bytes, heads[r].n_entries};
        at += row.n_bytes;
        if (at > bytes || !row_check(f->contents.kind, &row, f->contents.n)) return false;
        if (!(heads[r].leaving >= 0 && heads[r].leaving <= 1 + 1e-9) ||
            !(heads[r].absorbed >= 0 && heads[r].absorbed <= 1 + 1e-9))
            return false;
    }
    return at + n_rows * sky_bytes(f) == bytes;
}

/* Finds the whole blocks and truncates the file behind them. */
static lam_status find_blocks(row_file *f, uint64_t size, lam_error *error) {
    lam_status status = LAM_OK;
    char *data = NULL;
    while (f->end + sizeof(block_head) <= size) {
        block_head head;
        if (!read_all(f->fd, &head, sizeof head, f->end)) TRY(file_failed(f, error));
        if (head.own != store_checksum(&head, offsetof(block_head, own)) || head.block >= f->n_blocks ||
            head.n_rows != block_length(f, head.block) || head.bytes > size - f->end - sizeof head ||
            head.bytes < head.n_rows * sizeof(row_head))
            break;
        free(data);
        data = memory_allocate(head.bytes, 1, "a block of form factors", error);
        if (data == NULL) TRY(LAM_ERR_MEMORY);
        const uint64_t at = f->end + sizeof head;
        if (!read_all(f->fd, data, head.bytes, at)) TRY(file_failed(f, error));
        if (store_checksum(data, head.bytes) == head.checksum &&
            check_block(f, head.block, data, head.bytes) && f->offset[head.block] == 0) {
            f->offset[head.block] = at;
            f->n_there++;
            f->kept += head.n_rows;
        }
        f->end = at + head.bytes;
    }
    if (f->end < size && ftruncate(f->fd, (off_t)f->end) != 0) TRY(file_failed(f, error));
done:
    free(data);
    return status;
}

lam_status row_file_open(scratch *s, const char *name, const row_file_contents *contents,
                         const uint32_t *order, row_file **out, lam_error *error) {
    lam_status status = LAM_OK;
    struct stat about;
    row_file *f = memory_allocate(1, sizeof *f, "scratch", error);
    if (f == NULL) return LAM_ERR_MEMORY;
    f->fd = -1;
    f->order = order;
    f->contents = *contents;
    f->n_blocks = (contents->n + contents->block_rows - 1) / contents->block_rows;
    f->offset = memory_allocate(f->n_blocks, sizeof *f->offset, "scratch", error);
    if (f->offset == NULL) TRY(LAM_ERR_MEMORY);
    TRY(scratch_file(s, name, &f->fd, &f->path, error));
    if (fstat(f->fd, &about) != 0) TRY(file_failed(f, error));
    if (!S_ISREG(about.st_mode)) FAIL(error, LAM_ERR_IO, "%s: is not a regular file", f->path);
    TRY(check_head(f, (uint64_t)about.st_size, error));
    TRY(find_blocks(f, (uint64_t)about.st_size, error));
    f->flushed = clock_seconds();
    *out = f;
    f = NULL;
done:
    row_file_close(f);
    return status;
}

void row_file_close(row_file *f) {
    if (f == NULL) return;
    if (f->fd >= 0) close(f->fd);
    free(f->path);
    free(f->offset);
    free(f);
}

bool row_file_has(const row_file *f, size_t block) {
    return f->offset[block] != 0;
}

size_t row_file_kept(const row_file *f) {
    return f->kept;
}

lam_status row_file_read(const row_file *f, size_t block, packed_row *rows, void **data, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t first = block_first(f, block), n_rows = block_length(f, block);
    block_head head;
    uint8_t *bytes = NULL;
    if (!read_all(f->fd, &head, sizeof head, f->offset[block] - sizeof head)) TRY(file_failed(f, error));
    bytes = memory_allocate(head.bytes, 1, "a block of form factors", error);
    if (bytes == NULL) TRY(LAM_ERR_MEMORY);
    if (!read_all(f->fd, bytes, head.bytes, f->offset[block])) TRY(file_failed(f, error));
    size_t at = n_rows * sizeof(row_head);
    for (size_t r = 0; r < n_rows; r++) {
        row_head row;
        memcpy(&row, bytes + r * sizeof row, sizeof row);
        rows[f->order[first + r]] = (packed_row){bytes + at, row.n_bytes, row.n_entries};
        at += row.n_bytes;
    }
    *data = bytes;
    bytes = NULL;
done:
    free(bytes);
    return status;
}

lam_status row_file_append(row_file *f, size_t block, const packed_row *rows, const double *leaving,
                           const double *absorbed, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t first = block_first(f, block), n_rows = block_length(f, block);
    size_t bytes = n_rows * sizeof(row_head), at = sizeof(block_head) + bytes;
    for (size_t r = 0; r < n_rows; r++) bytes += rows[f->order[first + r]].n_bytes + sky_bytes(f);
    char *data = memory_allocate(sizeof(block_head) + bytes, 1, "a block of form factors", error);
    if (data == NULL) return LAM_ERR_MEMORY;
    row_head *heads = (row_head *)(data + sizeof(block_head));
    for (size_t r = 0; r < n_rows; r++) {
        const size_t i = f->order[first + r];
        heads[r] = (row_head){leaving != NULL ? leaving[i] : 0, absorbed != NULL ? absorbed[i] : 0,
                              rows[i].n_bytes, rows[i].n_entries};
        if (rows[i].n_bytes > 0) memcpy(data + at, rows[i].bytes, rows[i].n_bytes);
        at += rows[i].n_bytes;
    }
    for (size_t r = 0; r < n_rows && f->contents.sky != NULL; r++, at += sky_bytes(f))
        sky_store(f->contents.sky, f->order[first + r], data + at);
    block_head *head = (block_head *)data;
    *head = (block_head){
        .block = block, .n_rows = n_rows, .bytes = bytes, .checksum = store_checksum(heads, bytes)};
    head->own = store_checksum(head, offsetof(block_head, own));
    if (!write_all(f->fd, data, at, f->end)) {
        status = file_failed(f, error);
        if (ftruncate(f->fd, (off_t)f->end) != 0) goto done; /* then the next run truncates it */
        goto done;
    }
    f->offset[block] = f->end + sizeof *head;
    f->end += at;
    f->n_there++;
    if (clock_seconds() - f->flushed > flush_seconds) {
        if (fdatasync(f->fd) != 0) TRY(file_failed(f, error));
        f->flushed = clock_seconds();
    }
done:
    free(data);
    return status;
}

lam_status row_file_map(row_file *f, packed_rows *rows, double *leaving, double *absorbed, lam_error *error) {
    lam_status status = LAM_OK;
    void *map = mmap(NULL, f->end, PROT_READ, MAP_SHARED, f->fd, 0);
    if (map == MAP_FAILED) FAIL(error, LAM_ERR_IO, "%s: %s", f->path, strerror(errno));
    rows->map = map;
    rows->map_bytes = f->end;
    for (size_t b = 0; b < f->n_blocks; b++) {
        const size_t n_rows = block_length(f, b), first = block_first(f, b);
        const uint8_t *data = (const uint8_t *)map + f->offset[b], *at = data + n_rows * sizeof(row_head);
        for (size_t r = 0; r < n_rows; r++) {
            const size_t i = f->order[first + r];
            row_head head;
            memcpy(&head, data + r * sizeof head, sizeof head);
            leaving[i] = head.leaving;
            absorbed[i] = head.absorbed;
            rows->rows[i] = (packed_row){at, head.n_bytes, head.n_entries};
            at += head.n_bytes;
        }
        for (size_t r = 0; r < n_rows && f->contents.sky != NULL; r++, at += sky_bytes(f))
            sky_fetch(f->contents.sky, f->order[first + r], at);
    }
done:
    return status;
}
