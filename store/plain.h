/* The part of HDF5's file format that stores are written in, read without HDF5: superblocks of version 2,
 * object headers of version 2, links and attributes in them or in a fractal heap with a B-tree of version 2,
 * whole arrays. Each block has a checksum, which is compared. A file that is not exactly so, damaged or of
 * another writer, is left to HDF5 in a child process (store_open.c): nothing here says what is wrong.
 *
 * Every number comes from outside. Blocks are copied before they are looked at, as a file may change; sizes
 * and depths are bounded, and so is the number of blocks, so that no file takes more than a second.
 */
#ifndef LAMBERT_STORE_PLAIN_H
#define LAMBERT_STORE_PLAIN_H

#include "store/store_private.h"

/* Bytes that are read at a time, the longest block, and the most blocks of a file: several for each of some
 * thousand objects. */
enum { PLAIN_WINDOW = 8192, PLAIN_BLOCK_MOST = 65536, PLAIN_BLOCKS_MOST = 16384 };

#define PLAIN_NOWHERE UINT64_MAX

typedef struct plain_file {
    store_file *file;
    size_t n_blocks;
    uint64_t window_start;
    size_t window_size; /* 0: nothing was read yet */
    uint8_t window[PLAIN_WINDOW];
} plain_file;

/* Bytes of a block that are still to be read; false of a function: they are too few, or not as expected. */
typedef struct plain_bytes {
    const uint8_t *at;
    size_t left;
} plain_bytes;

bool plain_skip(plain_bytes *b, size_t count);

/* A number of 1 to 8 bytes, little-endian. */
bool plain_number(plain_bytes *b, size_t bytes, uint64_t *out);
bool plain_expect(plain_bytes *b, const void *expected, size_t bytes);

/* Reads `size` bytes at an address, at most PLAIN_BLOCK_MOST. */
bool plain_fetch(plain_file *f, uint64_t address, void *out, size_t size);

/* The checksum of metadata: lookup3 (Jenkins 2006, hashlittle) with 0 to begin with. */
uint32_t plain_checksum(const uint8_t *data, size_t size);

/* Reads a block that ends with its checksum into memory that the caller frees, NULL where it is not sound,
 * and leaves *b behind the four letters that it begins with. */
uint8_t *plain_block(plain_file *f, uint64_t address, size_t size, const char *letters, plain_bytes *b);

/* Calls visit with each object of a fractal heap that a B-tree of names lists; false where one of these is
 * not as stores have them, or visit says so. attributes: the records are those of attributes, not of links.
 */
typedef bool plain_visit(void *context, plain_bytes object);
bool plain_each(plain_file *f, uint64_t heap, uint64_t tree, bool attributes, plain_visit *visit,
                void *context);

/* The headers of an open file as store_headers_send sends them. *bytes is freed by the caller. False: the
 * file is to be read by HDF5. */
bool plain_headers(store *s, reply_head *head, char **bytes);

#endif
