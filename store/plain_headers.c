/* Object headers of HDF5's file format: groups, arrays, links and attributes, and the reply that HDF5 would
 * give about them (plain.h, store_reply.h). */
#include "store/plain.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Most links of a group and attributes of an object; stores have some dozens. */
enum { LINKS_MOST = 256, ATTRIBUTES_MOST = 256 };

/* Places are those in the texts of an object; names are set when all of these are read. */
typedef struct plain_link {
    uint64_t address;
    size_t place;
    const char *name;
} plain_link;

typedef struct plain_attribute {
    attribute_record record;
    size_t place, text_place;
    const char *name;
} plain_attribute;

/* An object as its messages are read. */
typedef struct plain_object {
    plain_file *f;
    bool has_links, has_type, has_space, has_layout; /* the first: it is a group */
    object_record record;
    plain_bytes type;
    uint8_t type_bytes[64];
    uint64_t data_address, data_bytes;
    uint64_t link_heap, link_tree, attribute_heap, attribute_tree; /* PLAIN_NOWHERE: there are none */
    size_t n_links, n_attributes;
    plain_link links[LINKS_MOST];
    plain_attribute attributes[ATTRIBUTES_MOST];
    char *texts; /* names and texts of this object, each with its NUL */
    size_t n_texts, texts_capacity;
} plain_object;

/* Copies `length` bytes and a NUL. */
static bool keep_text(plain_object *o, const uint8_t *text, size_t length, size_t *place) {
    if (length > REPLY_MOST_BYTES - o->n_texts) return false;
    if (o->texts_capacity - o->n_texts <= length) {
        const size_t capacity = 2 * (o->n_texts + length) + 1024;
        char *texts = realloc(o->texts, capacity);
        if (texts == NULL) return false;
        o->texts = texts;
        o->texts_capacity = capacity;
    }
    *place = o->n_texts;
    memcpy(o->texts + o->n_texts, text, length);
    o->texts[o->n_texts + length] = '\0';
    o->n_texts += length + 1;
    return true;
}

/* The same of a name, which has no NUL. */
static bool keep_name(plain_object *o, const uint8_t *name, size_t length, size_t *place) {
    return length > 0 && memchr(name, '\0', length) == NULL && keep_text(o, name, length, place);
}

/* A datatype: its class and version, three bytes of bits, its size, and the rest, as stores have them. */
typedef struct plain_type {
    uint8_t begin[8];
    uint8_t n_rest, rest[12];
} plain_type;

static const plain_type number_type = {{0x11, 0x20, 63, 0, 8}, 12, {0, 0, 64, 0, 52, 11, 0, 52, 255, 3}};
static const plain_type integer_type = {{0x10, 8, 0, 0, 8}, 4, {0, 0, 64}};

/* By store_type. */
static const plain_type types[] = {
    [STORE_F32] = {{0x11, 0x20, 31, 0, 4}, 12, {0, 0, 32, 0, 23, 8, 0, 23, 127}},
    [STORE_F64] = {{0x11, 0x20, 63, 0, 8}, 12, {0, 0, 64, 0, 52, 11, 0, 52, 255, 3}},
    [STORE_U32] = {{0x10, 0, 0, 0, 4}, 4, {0, 0, 32}},
    [STORE_U64] = {{0x10, 0, 0, 0, 8}, 4, {0, 0, 64}},
    [STORE_F16] = {{0x11, 0x20, 15, 0, 2}, 12, {0, 0, 16, 0, 10, 5, 0, 10, 15}},
    [STORE_U16] = {{0x10, 0, 0, 0, 2}, 4, {0, 0, 16}},
    [STORE_I8] = {{0x10, 8, 0, 0, 1}, 4, {0, 0, 8}},
};

static bool is_type(plain_bytes given, const plain_type *type) {
    return given.left == sizeof type->begin + type->n_rest &&
           memcmp(given.at, type->begin, sizeof type->begin) == 0 &&
           memcmp(given.at + sizeof type->begin, type->rest, type->n_rest) == 0;
}

/* A text of fixed length, padded with zeros, UTF-8. */
static bool is_text(plain_bytes given, uint64_t *size) {
    static const uint8_t begin[4] = {0x13, 0x11};
    return plain_expect(&given, begin, sizeof begin) && plain_number(&given, 4, size) && *size > 0 &&
           given.left == 0;
}

/* rank 0: a single value. */
static bool read_space(plain_bytes b, uint32_t *rank, uint64_t dims[STORE_MAX_RANK]) {
    uint64_t version, n, flags, kind, most;
    if (!plain_number(&b, 1, &version) || !plain_number(&b, 1, &n) || !plain_number(&b, 1, &flags) ||
        !plain_number(&b, 1, &kind) || version != 2 || n > STORE_MAX_RANK || flags > 1 ||
        kind != (n > 0 ? 1u : 0u))
        return false;
    *rank = (uint32_t)n;
    for (size_t i = 0; i < n; i++)
        if (!plain_number(&b, 8, &dims[i])) return false;
    for (size_t i = 0; i < n && flags == 1; i++)
        if (!plain_number(&b, 8, &most) || most != dims[i]) return false;
    return b.left == 0;
}

/* A link: version, flags, the length of its name, the name, an address. */
static bool read_link(void *context, plain_bytes b) {
    plain_object *o = context;
    plain_link *link = &o->links[o->n_links];
    uint64_t length;
    if (o->n_links == LINKS_MOST || !plain_expect(&b, "\1\0", 2) || !plain_number(&b, 1, &length))
        return false;
    const uint8_t *name = b.at;
    if (!plain_skip(&b, (size_t)length) || !plain_number(&b, 8, &link->address) || b.left != 0 ||
        !keep_name(o, name, (size_t)length, &link->place))
        return false;
    o->n_links++;
    return true;
}

/* An attribute: version, flags, sizes of name, type and shape, letters, these three, its value. */
static bool read_attribute(void *context, plain_bytes b) {
    plain_object *o = context;
    plain_attribute *a = &o->attributes[o->n_attributes];
    uint64_t of_name, of_type, of_space, size, dims[STORE_MAX_RANK], letters;
    uint32_t rank;
    if (o->n_attributes == ATTRIBUTES_MOST || !plain_expect(&b, "\3\0", 2) ||
        !plain_number(&b, 2, &of_name) || !plain_number(&b, 2, &of_type) || !plain_number(&b, 2, &of_space) ||
        !plain_number(&b, 1, &letters) || letters > 1 || of_name < 2)
        return false;
    const uint8_t *name = b.at;
    if (!plain_skip(&b, (size_t)of_name) || name[of_name - 1] != '\0' ||
        !keep_name(o, name, (size_t)of_name - 1, &a->place))
        return false;
    const plain_bytes type = {b.at, (size_t)of_type};
    if (!plain_skip(&b, (size_t)of_type)) return false;
    const plain_bytes space = {b.at, (size_t)of_space};
    if (!plain_skip(&b, (size_t)of_space) || !read_space(space, &rank, dims) || rank != 0) return false;
    a->record = (attribute_record){.name_bytes = (uint32_t)of_name};
    if (is_type(type, &number_type) || is_type(type, &integer_type)) {
        a->record.kind = is_type(type, &number_type) ? ATTRIBUTE_NUMBER : ATTRIBUTE_INTEGER;
        if (!plain_number(&b, 8, &a->record.value)) return false;
    } else {
        a->record.kind = ATTRIBUTE_TEXT;
        if (!is_text(type, &size) || size != b.left || !keep_text(o, b.at, b.left, &a->text_place))
            return false;
        a->record.text_bytes = (uint32_t)strlen(o->texts + a->text_place) + 1;
        b.left = 0;
    }
    if (b.left != 0) return false;
    o->n_attributes++;
    return true;
}

/* Where links or attributes are: version, flags, the addresses of a heap and of its B-tree. */
static bool read_places(plain_bytes b, uint64_t *heap, uint64_t *tree) {
    return plain_expect(&b, "\0\0", 2) && plain_number(&b, 8, heap) && plain_number(&b, 8, tree) &&
           (*heap == PLAIN_NOWHERE) == (*tree == PLAIN_NOWHERE) && b.left == 0;
}

enum {
    MESSAGE_NONE = 0,
    MESSAGE_SPACE = 1,
    MESSAGE_LINKS = 2,
    MESSAGE_TYPE = 3,
    MESSAGE_FILL = 5,
    MESSAGE_LINK = 6,
    MESSAGE_LAYOUT = 8,
    MESSAGE_GROUP = 10,
    MESSAGE_ATTRIBUTE = 12,
    MESSAGE_NEXT = 16,
    MESSAGE_ATTRIBUTES = 21
};

static bool read_message(plain_object *o, uint64_t kind, plain_bytes b) {
    switch (kind) {
    case MESSAGE_NONE:
    case MESSAGE_FILL:
    case MESSAGE_GROUP:
        return true;
    case MESSAGE_SPACE:
        if (o->has_space) return false;
        o->has_space = true;
        return read_space(b, &o->record.rank, o->record.dims);
    case MESSAGE_TYPE:
        if (o->has_type || b.left > sizeof o->type_bytes) return false;
        o->has_type = true;
        memcpy(o->type_bytes, b.at, b.left);
        o->type = (plain_bytes){o->type_bytes, b.left};
        return true;
    case MESSAGE_LAYOUT: /* version 3, contiguous */
        if (o->has_layout) return false;
        o->has_layout = true;
        return plain_expect(&b, "\3\1", 2) && plain_number(&b, 8, &o->data_address) &&
               plain_number(&b, 8, &o->data_bytes) && b.left == 0;
    case MESSAGE_LINKS:
        if (o->has_links) return false;
        o->has_links = true;
        return read_places(b, &o->link_heap, &o->link_tree);
    case MESSAGE_LINK:
        return read_link(o, b);
    case MESSAGE_ATTRIBUTE:
        return read_attribute(o, b);
    case MESSAGE_ATTRIBUTES:
        return o->attribute_heap == PLAIN_NOWHERE && read_places(b, &o->attribute_heap, &o->attribute_tree);
    default:
        return false; /* of something that no store has */
    }
}

/* A part of a header that another continues. */
typedef struct plain_part {
    uint64_t address, bytes;
} plain_part;

enum { PARTS_MOST = 64 };

/* The messages of one part; those of others that they name go to parts. */
static bool read_messages(plain_object *o, plain_bytes b, plain_part *parts, size_t *n_parts) {
    uint64_t kind, size, flags;
    while (b.left >= 4) { /* fewer are a gap */
        if (!plain_number(&b, 1, &kind) || !plain_number(&b, 2, &size) || !plain_number(&b, 1, &flags))
            return false;
        plain_bytes message = {b.at, (size_t)size};
        /* Constant, or never shared. */
        if (!plain_skip(&b, (size_t)size) || (flags & ~(uint64_t)5) != 0) return false;
        if (kind != MESSAGE_NEXT) {
            if (!read_message(o, kind, message)) return false;
            continue;
        }
        if (*n_parts == PARTS_MOST || !plain_number(&message, 8, &parts[*n_parts].address) ||
            !plain_number(&message, 8, &parts[*n_parts].bytes) || message.left != 0)
            return false;
        ++*n_parts;
    }
    return true;
}

/* The first part has a head of letters, version, flags and the size of its messages. */
static bool read_parts(plain_object *o, uint64_t address) {
    plain_file *f = o->f;
    plain_part parts[PARTS_MOST];
    size_t n_parts = 0;
    uint8_t head[16];
    uint64_t flags, size;
    plain_bytes b = {head, sizeof head};
    if (!plain_fetch(f, address, head, sizeof head) || !plain_expect(&b, "OHDR\2", 5) ||
        !plain_number(&b, 1, &flags) || flags > 2)
        return false;
    const size_t width = (size_t)1 << flags;
    if (!plain_number(&b, width, &size) || size > PLAIN_BLOCK_MOST / 2) return false;
    uint8_t *bytes = plain_block(f, address, 6 + width + (size_t)size + 4, "OHDR", &b);
    bool good = bytes != NULL && plain_skip(&b, 2 + width) && read_messages(o, b, parts, &n_parts);
    free(bytes);
    for (size_t k = 0; good && k < n_parts; k++) {
        if (parts[k].bytes > PLAIN_BLOCK_MOST) return false;
        bytes = plain_block(f, parts[k].address, (size_t)parts[k].bytes, "OCHK", &b);
        good = bytes != NULL && read_messages(o, b, parts, &n_parts);
        free(bytes);
    }
    return good;
}

static bool describe_array(plain_object *o) {
    object_record *r = &o->record;
    uint64_t size;
    size_t type = 0, bytes;
    if (!o->has_type || !o->has_space || r->rank == 0 || o->n_links > 0) return false;
    while (type < sizeof types / sizeof *types && !is_type(o->type, &types[type])) type++;
    if (type < sizeof types / sizeof *types) {
        r->type = (uint32_t)type;
        r->value_size = store_type_size((store_type)type);
    } else {
        if (!is_text(o->type, &size)) return false;
        r->is_text = 1;
        r->value_size = size;
    }
    bytes = (size_t)r->value_size;
    for (size_t i = 0; i < r->rank; i++)
        if (!size_multiply(bytes, (size_t)r->dims[i], &bytes)) return false;
    if (bytes == 0) return true;
    const uint64_t end = o->f->file->size;
    r->offset = o->data_address;
    return o->data_bytes == bytes && r->offset <= end && bytes <= end - r->offset;
}

static int compare_links(const void *a, const void *b) {
    return strcmp(((const plain_link *)a)->name, ((const plain_link *)b)->name);
}

static int compare_attributes(const void *a, const void *b) {
    return strcmp(((const plain_attribute *)a)->name, ((const plain_attribute *)b)->name);
}

static void sort_names(plain_object *o) {
    for (size_t k = 0; k < o->n_links; k++) o->links[k].name = o->texts + o->links[k].place;
    for (size_t k = 0; k < o->n_attributes; k++) o->attributes[k].name = o->texts + o->attributes[k].place;
    qsort(o->links, o->n_links, sizeof *o->links, compare_links);
    qsort(o->attributes, o->n_attributes, sizeof *o->attributes, compare_attributes);
}

static bool read_object(plain_object *o, uint64_t address) {
    if (!read_parts(o, address)) return false;
    o->record.kind = o->has_layout ? OBJECT_ARRAY : OBJECT_GROUP;
    if (o->has_layout == o->has_links || (o->has_layout && !describe_array(o))) return false;
    if (o->has_links && (o->has_type || o->has_space)) return false;
    if (o->link_heap != PLAIN_NOWHERE && !plain_each(o->f, o->link_heap, o->link_tree, false, read_link, o))
        return false;
    if (o->attribute_heap != PLAIN_NOWHERE &&
        !plain_each(o->f, o->attribute_heap, o->attribute_tree, true, read_attribute, o))
        return false;
    sort_names(o);
    return true;
}

/* The reply as it grows. */
typedef struct plain_reply {
    plain_file f;
    reply_buffer out;
    reply_head head;
} plain_reply;

static bool write_object(plain_reply *r, const char *name, plain_object *o) {
    const char *path = ""; /* of an error that nobody reads */
    lam_error unused;
    o->record.name_bytes = (uint32_t)strlen(name) + 1;
    o->record.n_attributes = (uint32_t)o->n_attributes;
    bool good = reply_add(&r->out, path, &o->record, sizeof o->record, &unused) == LAM_OK &&
                reply_add(&r->out, path, name, o->record.name_bytes, &unused) == LAM_OK;
    for (size_t k = 0; good && k < o->n_attributes; k++) {
        const plain_attribute *a = &o->attributes[k];
        good = reply_add(&r->out, path, &a->record, sizeof a->record, &unused) == LAM_OK &&
               reply_add(&r->out, path, a->name, a->record.name_bytes, &unused) == LAM_OK &&
               reply_add(&r->out, path, o->texts + a->text_place, a->record.text_bytes, &unused) == LAM_OK;
    }
    r->head.n_objects++;
    r->head.n_attributes += o->n_attributes;
    return good;
}

/* An object and all that is below it, in the order of names. Several links to one object, which no store has,
 * would take more blocks than there may be where they make a circle. */
static bool write_tree(plain_reply *r, const char *name, uint64_t address, size_t depth) {
    char below[STORE_NAME_SIZE];
    plain_object *o = calloc(1, sizeof *o);
    if (o == NULL) return false;
    o->f = &r->f;
    o->link_heap = o->link_tree = o->attribute_heap = o->attribute_tree = PLAIN_NOWHERE;
    bool good = depth <= STORE_MAX_DEPTH && read_object(o, address) && write_object(r, name, o);
    const size_t length = strcmp(name, "/") == 0 ? 0 : strlen(name);
    for (size_t k = 0; good && k < o->n_links; k++) {
        const char *last = o->links[k].name;
        const int written = snprintf(below, sizeof below, "%.*s/%s", (int)length, name, last);
        good = written > 0 && (size_t)written < sizeof below && strchr(last, '/') == NULL;
        if (!good) break;
        good = write_tree(r, below, o->links[k].address, depth + 1);
    }
    free(o->texts);
    free(o);
    return good;
}

bool plain_headers(store *s, reply_head *head, char **bytes) {
    static const uint8_t begin[12] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n', 2, 8, 8, 0};
    plain_bytes b;
    uint64_t base, more, end, root, sum;
    uint8_t superblock[48];
    plain_reply *r = calloc(1, sizeof *r);
    if (r == NULL) return false;
    r->f.file = &s->file;
    b = (plain_bytes){superblock, sizeof superblock};
    const bool good = plain_fetch(&r->f, 0, superblock, sizeof superblock) &&
                      plain_expect(&b, begin, sizeof begin) && plain_number(&b, 8, &base) &&
                      plain_number(&b, 8, &more) && plain_number(&b, 8, &end) && plain_number(&b, 8, &root) &&
                      plain_number(&b, 4, &sum) && base == 0 && more == PLAIN_NOWHERE &&
                      end <= s->file.size && plain_checksum(superblock, sizeof superblock - 4) == sum &&
                      write_tree(r, "/", root, 0);
    s->file.error = 0; /* HDF5 meets it again */
    if (good) {
        memcpy(r->head.magic, REPLY_MAGIC, sizeof r->head.magic);
        r->head.bytes = r->out.size;
        *head = r->head;
        *bytes = r->out.bytes;
    } else {
        free(r->out.bytes);
    }
    free(r);
    return good;
}
