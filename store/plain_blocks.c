/* Blocks of HDF5's file format and their checksums; heaps of links and attributes (plain.h). */
#include "store/plain.h"

#include <stdlib.h>
#include <string.h>

bool plain_skip(plain_bytes *b, size_t count) {
    if (count > b->left) return false;
    b->at += count;
    b->left -= count;
    return true;
}

bool plain_number(plain_bytes *b, size_t bytes, uint64_t *out) {
    const uint8_t *from = b->at;
    if (!plain_skip(b, bytes)) return false;
    *out = 0;
    for (size_t i = bytes; i-- > 0;) *out = *out << 8 | from[i];
    return true;
}

bool plain_expect(plain_bytes *b, const void *expected, size_t bytes) {
    const uint8_t *from = b->at;
    return plain_skip(b, bytes) && memcmp(from, expected, bytes) == 0;
}

bool plain_fetch(plain_file *f, uint64_t address, void *out, size_t size) {
    const uint64_t end = f->file->size;
    if (size > PLAIN_BLOCK_MOST || address > end || size > end - address) return false;
    if (size > PLAIN_WINDOW) return store_file_read(f->file, address, out, size);
    if (f->window_size == 0 || address < f->window_start ||
        address - f->window_start > f->window_size - size || f->window_size < size) {
        f->window_size = 0;
        const size_t count = end - address < PLAIN_WINDOW ? (size_t)(end - address) : PLAIN_WINDOW;
        if (!store_file_read(f->file, address, f->window, count)) return false;
        f->window_start = address;
        f->window_size = count;
    }
    memcpy(out, f->window + (address - f->window_start), size);
    return true;
}

static uint32_t turned(uint32_t x, unsigned by) {
    return x << by | x >> (32 - by);
}

uint32_t plain_checksum(const uint8_t *data, size_t size) {
    uint32_t a = 0xdeadbeef + (uint32_t)size, b = a, c = a;
    while (size > 0) {
        uint32_t word[3] = {0};
        const size_t count = size < sizeof word ? size : sizeof word;
        memcpy(word, data, count);
        a += word[0];
        b += word[1];
        c += word[2];
        if (size <= sizeof word) break;
        static const unsigned turns[6] = {4, 6, 8, 16, 19, 4};
        for (size_t k = 0; k < 6; k += 3) {
            a = (a - c) ^ turned(c, turns[k]);
            c += b;
            b = (b - a) ^ turned(a, turns[k + 1]);
            a += c;
            c = (c - b) ^ turned(b, turns[k + 2]);
            b += a;
        }
        data += count;
        size -= count;
    }
    if (size == 0) return c;
    c = (c ^ b) - turned(b, 14);
    a = (a ^ c) - turned(c, 11);
    b = (b ^ a) - turned(a, 25);
    c = (c ^ b) - turned(b, 16);
    a = (a ^ c) - turned(c, 4);
    b = (b ^ a) - turned(a, 14);
    return (c ^ b) - turned(b, 24);
}

enum { SUM = 4, LETTERS = 4 };

uint8_t *plain_block(plain_file *f, uint64_t address, size_t size, const char *letters, plain_bytes *b) {
    uint8_t *bytes = NULL;
    if (size < LETTERS + SUM || size > PLAIN_BLOCK_MOST || ++f->n_blocks > PLAIN_BLOCKS_MOST) return NULL;
    bytes = malloc(size);
    if (bytes == NULL || !plain_fetch(f, address, bytes, size)) goto bad;
    plain_bytes sum = {bytes + size - SUM, SUM};
    uint64_t expected;
    if (!plain_number(&sum, SUM, &expected) || plain_checksum(bytes, size - SUM) != expected) goto bad;
    *b = (plain_bytes){bytes, size - SUM};
    if (!plain_expect(b, letters, LETTERS)) goto bad;
    return bytes;
bad:
    free(bytes);
    return NULL;
}

/* Bytes of a heap's header, of that of a B-tree, and of the beginning of a node and of a direct block. */
enum { HEAP_HEAD = 146, TREE_HEAD = 38, NODE_HEAD = 6 };

/* The first direct block has 512 bytes, of attributes 1,024. It is alone, or there are up to eight rows of
 * WIDTH blocks each, of once, once, twice, four times … these bytes. */
enum { LINKS_BLOCK = 512, ATTRIBUTES_BLOCK = 1024, WIDTH = 4, ROWS_MOST = 8, DIRECT_MOST = 65536 };

/* A heap whose objects are all in direct blocks. */
typedef struct plain_heap {
    uint64_t address;
    size_t id_bytes, offset_bytes, first_block;
    size_t n_blocks;
    uint64_t block[WIDTH * ROWS_MOST], start[WIDTH * ROWS_MOST]; /* addresses; places in the heap */
    size_t size[WIDTH * ROWS_MOST];
    uint8_t *bytes[WIDTH * ROWS_MOST]; /* read and compared; NULL: not yet */
} plain_heap;

/* The direct blocks of the root's rows. */
static bool read_rows(plain_file *f, plain_heap *h, uint64_t root, size_t rows) {
    plain_bytes b;
    uint64_t start = 0, at;
    if (rows > ROWS_MOST) return false;
    uint8_t *bytes =
        plain_block(f, root, LETTERS + 1 + 8 + h->offset_bytes + 8 * WIDTH * rows + SUM, "FHIB", &b);
    bool good = bytes != NULL && plain_expect(&b, "\0", 1) && plain_number(&b, 8, &at) && at == h->address &&
                plain_number(&b, h->offset_bytes, &at) && at == 0;
    for (size_t k = 0; good && k < WIDTH * rows; k++) {
        const size_t row = k / WIDTH, size = h->first_block << (row > 0 ? row - 1 : 0);
        good = plain_number(&b, 8, &at);
        if (at != PLAIN_NOWHERE) {
            h->block[h->n_blocks] = at;
            h->start[h->n_blocks] = start;
            h->size[h->n_blocks++] = size;
        }
        start += size;
    }
    free(bytes);
    return good && b.left == 0;
}

static bool read_heap(plain_file *f, uint64_t address, bool attributes, plain_heap *h) {
    static const uint8_t none[8] = {0};
    plain_bytes b;
    uint64_t root = 0, rows = 0, width, least, most, bits, ids, skipped;
    uint8_t *bytes = plain_block(f, address, HEAP_HEAD, "FRHP", &b);
    *h = (plain_heap){.address = address, .first_block = attributes ? ATTRIBUTES_BLOCK : LINKS_BLOCK};
    /* Version, filters, checksums of blocks; no huge or tiny objects. */
    bool good = bytes != NULL && plain_expect(&b, "\0", 1) && plain_number(&b, 2, &ids) &&
                plain_expect(&b, "\0\0\2", 3) && plain_skip(&b, 4 + 8) && plain_number(&b, 8, &skipped) &&
                skipped == PLAIN_NOWHERE && plain_skip(&b, 8 * 6) && plain_expect(&b, none, 8) &&
                plain_expect(&b, none, 8) && plain_expect(&b, none, 8) && plain_expect(&b, none, 8) &&
                plain_number(&b, 2, &width) && plain_number(&b, 8, &least) && plain_number(&b, 8, &most) &&
                plain_number(&b, 2, &bits) && plain_skip(&b, 2) && plain_number(&b, 8, &root) &&
                plain_number(&b, 2, &rows) && b.left == 0;
    good = good && width == WIDTH && least == h->first_block && most == DIRECT_MOST &&
           bits == (attributes ? 40 : 32) && ids == (attributes ? 8 : 7);
    free(bytes);
    if (!good) return false;
    h->id_bytes = (size_t)ids;
    h->offset_bytes = (size_t)bits / 8;
    if (rows > 0) return read_rows(f, h, root, (size_t)rows);
    h->block[0] = root;
    h->size[0] = h->first_block;
    h->n_blocks = 1;
    return true;
}

/* Reads a direct block, whose checksum is of its bytes with 0 in place of this. */
static bool read_direct(plain_file *f, plain_heap *h, size_t k) {
    const size_t head = LETTERS + 1 + 8 + h->offset_bytes;
    uint64_t sum, at, start;
    if (h->bytes[k] != NULL) return true;
    if (++f->n_blocks > PLAIN_BLOCKS_MOST) return false;
    uint8_t *bytes = h->bytes[k] = malloc(h->size[k]);
    if (bytes == NULL || !plain_fetch(f, h->block[k], bytes, h->size[k])) return false;
    plain_bytes b = {bytes, head + SUM};
    const bool good = plain_expect(&b, "FHDB\0", LETTERS + 1) && plain_number(&b, 8, &at) &&
                      plain_number(&b, h->offset_bytes, &start) && plain_number(&b, SUM, &sum);
    memset(bytes + head, 0, SUM);
    return good && at == h->address && start == h->start[k] && plain_checksum(bytes, h->size[k]) == sum;
}

/* The object that an identifier leads to. */
static bool find_object(plain_file *f, plain_heap *h, plain_bytes *id, plain_bytes *out) {
    uint64_t offset, length;
    if (!plain_expect(id, "\0", 1) || !plain_number(id, h->offset_bytes, &offset) ||
        !plain_number(id, h->id_bytes - 1 - h->offset_bytes, &length))
        return false;
    for (size_t k = 0; k < h->n_blocks; k++) {
        if (offset < h->start[k] || offset - h->start[k] >= h->size[k]) continue;
        const size_t within = (size_t)(offset - h->start[k]);
        if (length > h->size[k] - within || within < LETTERS + 1 + 8 + h->offset_bytes + SUM) return false;
        if (!read_direct(f, h, k)) return false;
        *out = (plain_bytes){h->bytes[k] + within, (size_t)length};
        return true;
    }
    return false;
}

/* A B-tree, and what its records lead to. */
typedef struct plain_tree {
    plain_file *f;
    plain_heap *heap;
    bool attributes;
    size_t node_bytes, record_bytes;
    uint64_t n_left; /* records that were promised and not met */
    plain_visit *visit;
    void *context;
} plain_tree;

static bool read_record(plain_tree *t, plain_bytes record) {
    plain_bytes object;
    uint64_t flags = 0;
    if (t->n_left == 0 || (!t->attributes && !plain_skip(&record, 4))) return false;
    t->n_left--;
    if (!find_object(t->f, t->heap, &record, &object)) return false;
    /* An attribute may be shared with others, but no store has such. */
    if (t->attributes && (!plain_number(&record, 1, &flags) || (flags & 2) != 0)) return false;
    return t->visit(t->context, object);
}

/* A node of n records; depth 0: a leaf. */
static bool read_node(plain_tree *t, uint64_t address, uint64_t n, size_t depth) {
    const size_t most = (t->node_bytes - NODE_HEAD - SUM) / t->record_bytes;
    /* Numbers of records in nodes of the lowest level take a byte; deeper trees are not read. */
    const size_t child = depth > 0 ? 8 + 1 : 0;
    plain_bytes b, records;
    uint64_t type;
    if (depth > 1 || most > UINT8_MAX || n == 0 || n > most) return false;
    const size_t size = NODE_HEAD + (size_t)n * t->record_bytes + ((size_t)n + 1) * child + SUM;
    uint8_t *bytes = plain_block(t->f, address, size, depth > 0 ? "BTIN" : "BTLF", &b);
    bool good = bytes != NULL && size <= t->node_bytes && plain_expect(&b, "\0", 1) &&
                plain_number(&b, 1, &type) && type == (t->attributes ? 8u : 5u);
    records = b;
    for (uint64_t k = 0; good && k < n; k++) {
        good = read_record(t, (plain_bytes){records.at, t->record_bytes}) &&
               plain_skip(&records, t->record_bytes);
    }
    for (uint64_t k = 0; good && depth > 0 && k <= n; k++) {
        uint64_t at, count;
        good = plain_number(&records, 8, &at) && plain_number(&records, 1, &count) &&
               read_node(t, at, count, depth - 1);
    }
    free(bytes);
    return good;
}

bool plain_each(plain_file *f, uint64_t heap, uint64_t tree, bool attributes, plain_visit *visit,
                void *context) {
    plain_heap h;
    plain_bytes b;
    plain_tree t = {.f = f, .heap = &h, .attributes = attributes, .visit = visit, .context = context};
    uint64_t type, node, record, depth, root, n, total;
    if (!read_heap(f, heap, attributes, &h)) return false;
    uint8_t *bytes = plain_block(f, tree, TREE_HEAD, "BTHD", &b);
    bool good = bytes != NULL && plain_expect(&b, "\0", 1) && plain_number(&b, 1, &type) &&
                plain_number(&b, 4, &node) && plain_number(&b, 2, &record) && plain_number(&b, 2, &depth) &&
                plain_skip(&b, 2) && plain_number(&b, 8, &root) && plain_number(&b, 2, &n) &&
                plain_number(&b, 8, &total);
    good = good && type == (attributes ? 8u : 5u) && node == 512 && record == (attributes ? 17u : 11u) &&
           depth <= 1;
    if (good) {
        t.node_bytes = (size_t)node;
        t.record_bytes = (size_t)record;
        t.n_left = total;
        good = read_node(&t, root, n, (size_t)depth) && t.n_left == 0;
    }
    free(bytes);
    for (size_t k = 0; k < h.n_blocks; k++) free(h.bytes[k]);
    return good;
}
