/* Headers of a store as a process sends them are taken only when they are sound, whatever the sender says. */
#include "store/store_private.h"
#include "support/suite.h"

#include <string.h>

#define FILE_NAME "a.h5"
enum { FILE_SIZE = 10000, MOST = 1 << 14 };

static lam_error error;

/* A reply under construction. */
typedef struct reply {
    reply_head head;
    char bytes[MOST];
} reply;

static void put(reply *r, const void *data, size_t size) {
    ck_assert_uint_le(r->head.bytes + size, MOST);
    memcpy(r->bytes + r->head.bytes, data, size);
    r->head.bytes += size;
}

static void put_attribute(reply *r, attribute_kind kind, const char *name, const char *text, uint64_t value) {
    const attribute_record record = {.kind = kind,
                                     .name_bytes = (uint32_t)strlen(name) + 1,
                                     .text_bytes = text == NULL ? 0 : (uint32_t)strlen(text) + 1,
                                     .value = value};
    put(r, &record, sizeof record);
    put(r, name, record.name_bytes);
    if (text != NULL) put(r, text, record.text_bytes);
    r->head.n_attributes++;
}

/* Attributes follow by put_attribute. */
static void put_object(reply *r, object_record record, const char *name, const char *fault) {
    record.name_bytes = (uint32_t)strlen(name) + 1;
    if (fault != NULL) record.fault_bytes = (uint32_t)strlen(fault) + 1;
    put(r, &record, sizeof record);
    put(r, name, record.name_bytes);
    if (fault != NULL) put(r, fault, record.fault_bytes);
    r->head.n_objects++;
}

static object_record group(uint32_t n_attributes) {
    return (object_record){.kind = OBJECT_GROUP, .n_attributes = n_attributes};
}

static object_record array(uint64_t length, uint64_t offset) {
    return (object_record){.kind = OBJECT_ARRAY,
                           .type = STORE_F64,
                           .rank = 1,
                           .value_size = 8,
                           .dims = {length},
                           .offset = offset};
}

/* A root with attributes of each kind, two groups, two arrays, texts and an array that cannot be read. */
static reply sound(void) {
    reply r = {.head = {.magic = REPLY_MAGIC}};
    const double half = .5;
    uint64_t bits;
    memcpy(&bits, &half, sizeof bits);
    put_object(&r, group(4), "/", NULL);
    put_attribute(&r, ATTRIBUTE_INTEGER, "integer", NULL, 7);
    put_attribute(&r, ATTRIBUTE_NUMBER, "number", NULL, bits);
    put_attribute(&r, ATTRIBUTE_OTHER, "other", NULL, 0);
    put_attribute(&r, ATTRIBUTE_TEXT, "text", "words", 0);
    put_object(&r, group(0), "/mesh", NULL);
    put_object(&r, array(100, 4096), "/mesh/area", NULL);
    put_object(&r, array(0, 0), "/mesh/empty", NULL);
    put_object(&r, array(100, 4896), "/mesh/next", NULL);
    put_object(&r, group(1), "/mesh-2", NULL);
    put_attribute(&r, ATTRIBUTE_TEXT, "text", "", 0);
    put_object(
        &r,
        (object_record){
            .kind = OBJECT_ARRAY, .is_text = 1, .rank = 1, .value_size = 5, .dims = {3}, .offset = 8000},
        "/mesh/names", NULL);
    put_object(&r, (object_record){.kind = OBJECT_FAULTY, .status = LAM_ERR_FORMAT}, "/mesh/odd",
               FILE_NAME ": /mesh/odd is chunked");
    return r;
}

/* As store_open reads it. */
static lam_status read_reply(const reply *r, store_index *index) {
    lam_status status = store_reply_check(&r->head, FILE_NAME, &error);
    if (status != LAM_OK) return status;
    ck_assert_uint_le(r->head.bytes, MOST);
    char *bytes = malloc(r->head.bytes + 1);
    memcpy(bytes, r->bytes, r->head.bytes);
    status = store_reply_read(&r->head, FILE_NAME, FILE_SIZE, bytes, index, &error);
    ck_assert(status == LAM_OK || (index->objects == NULL && index->bytes == NULL));
    return status;
}

static void check_refused(const reply *r, const char *words) {
    store_index index = {.bytes = NULL};
    error.message[0] = '\0';
    ck_assert_int_ne(read_reply(r, &index), LAM_OK);
    ck_assert_msg(strncmp(error.message, FILE_NAME ": ", 6) == 0 && strstr(error.message, words) != NULL,
                  "%s", error.message);
}

START_TEST(what_was_sent_is_found) {
    const reply r = sound();
    char name[] = FILE_NAME;
    store s = {.path = name};
    const store_array *found = NULL;
    ck_ok(read_reply(&r, &s.index));
    ck_assert_uint_eq(s.index.n_objects, 8);
    ck_ok(store_array_find(&s, "/mesh/next", &found, &error));
    ck_assert_uint_eq(found->offset, 4896);
    ck_assert_uint_eq(found->bytes, 800);
    ck_ok(store_array_find(&s, "/mesh/names", &found, &error));
    ck_assert(found->is_text && found->bytes == 15);
    ck_assert_int_eq(store_array_find(&s, "/mesh", &found, &error), LAM_ERR_FORMAT);
    ck_assert_int_eq(store_array_find(&s, "/mesh/none", &found, &error), LAM_ERR_FORMAT);
    ck_assert_int_eq(store_array_find(&s, "/mesh/odd", &found, &error), LAM_ERR_FORMAT);
    ck_assert_str_eq(error.message, FILE_NAME ": /mesh/odd is chunked");
    double number = 0;
    int64_t integer = 0;
    ck_ok(store_get_number(&s, "/", "number", &number, &error));
    ck_ok(store_get_integer(&s, "/", "integer", &integer, &error));
    ck_assert(number == .5 && integer == 7);
    ck_assert(store_has_attribute(&s, "/", "other") && store_has_attribute(&s, "/mesh-2", "text"));
    ck_assert(store_find(&s, "/mesh-3") == NULL && store_find(&s, "") == NULL);
    store_index_free(&s.index);
}
END_TEST

START_TEST(lies_of_the_head_are_refused) {
    reply r = sound();
    r.head.magic[0] = 'L';
    check_refused(&r, "nonsense");
    r = sound();
    r.head.bytes = REPLY_MOST_BYTES + 1;
    check_refused(&r, "nonsense");
    r = sound();
    r.head.n_objects = (uint64_t)1 << 40; /* more names than bytes */
    check_refused(&r, "nonsense");
    r = sound();
    r.head.n_attributes = UINT64_MAX;
    check_refused(&r, "nonsense");
    r = sound();
    r.head.n_objects--;
    check_refused(&r, "nonsense");
    r = sound();
    r.head.n_attributes++;
    check_refused(&r, "nonsense");
    static const uint64_t statuses[] = {LAM_ERR_CANCELLED, LAM_ERR_VERSION, 1000, UINT64_MAX};
    for (size_t k = 0; k < sizeof statuses / sizeof *statuses; k++) {
        r = sound();
        r.head.status = statuses[k];
        strcpy(r.head.message, FILE_NAME ": refused");
        check_refused(&r, "nonsense");
    }
    static const char *const messages[] = {"", "other.h5: refused", FILE_NAME ": two\nlines",
                                           FILE_NAME ": \033[31m"};
    for (size_t k = 0; k < sizeof messages / sizeof *messages; k++) {
        r = sound();
        r.head.status = LAM_ERR_FORMAT;
        strcpy(r.head.message, messages[k]);
        check_refused(&r, "nonsense");
    }
    r = sound();
    memset(r.head.message, 'x', sizeof r.head.message); /* without an end */
    check_refused(&r, "nonsense");
}
END_TEST

/* One more object behind sound ones. */
static void check_object(object_record record, const char *name, const char *fault, const char *words) {
    reply r = sound();
    put_object(&r, record, name, fault);
    check_refused(&r, words);
}

START_TEST(lies_about_arrays_are_refused) {
    object_record wrong = array(1, 9993);
    check_object(wrong, "/x", NULL, "nonsense"); /* one byte behind the end */
    check_object(array(2, UINT64_MAX - 8), "/x", NULL, "nonsense");
    check_object(array(UINT64_MAX / 8 + 2, 16), "/x", NULL,
                 "nonsense"); /* 8 bytes, if multiplied carelessly */
    check_object(array(0, 1), "/x", NULL, "nonsense");
    wrong = array(1, 16);
    wrong.value_size = 4;
    check_object(wrong, "/x", NULL, "nonsense");
    wrong = array(1, 16);
    wrong.type = STORE_I8 + 1;
    check_object(wrong, "/x", NULL, "nonsense");
    wrong = array(1, 16);
    wrong.is_text = 2;
    check_object(wrong, "/x", NULL, "nonsense");
    wrong = array(1, 16);
    wrong.rank = 0;
    check_object(wrong, "/x", NULL, "nonsense");
    wrong.rank = STORE_MAX_RANK + 1;
    check_object(wrong, "/x", NULL, "nonsense");
    wrong = array(1, 16);
    wrong.is_text = 1;
    wrong.value_size = 0;
    check_object(wrong, "/x", NULL, "nonsense");
    wrong = array(1, 16);
    wrong.kind = OBJECT_FAULTY + 1;
    check_object(wrong, "/x", NULL, "nonsense");
    check_object(array(1, 4096), "/x", NULL, "share bytes");
    check_object(array(1, 4096 + 799), "/x", NULL, "share bytes");
    check_object(array(1000, 1), "/x", NULL, "share bytes");
}
END_TEST

START_TEST(lies_about_names_are_refused) {
    char deep[] = "/a/b/c/d/e/f/g/h/i", long_name[STORE_NAME_SIZE + 2];
    memset(long_name, 'n', sizeof long_name);
    long_name[0] = '/';
    long_name[STORE_NAME_SIZE + 1] = '\0';
    const char *const names[] = {"/",       "/mesh",        "/mesh/area", "x",          "",
                                 "/x/",     "//x",          "/mesh//x",   "/none/x",    deep,
                                 long_name, "/mesh/area/x", "/mesh/",     "/mesh/odd/x"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        check_object(group(0), names[k], NULL, "nonsense");
    check_object(group(1), "/x", NULL, "nonsense"); /* an attribute that is not there */
    check_object((object_record){.kind = OBJECT_FAULTY, .status = LAM_OK}, "/x", FILE_NAME ": x", "nonsense");
    check_object((object_record){.kind = OBJECT_FAULTY, .status = LAM_ERR_IO}, "/x", "b.h5: x", "nonsense");
    check_object((object_record){.kind = OBJECT_FAULTY, .status = LAM_ERR_IO}, "/x", NULL, "nonsense");
    check_object(group(0), "/x", FILE_NAME ": x", "nonsense"); /* a group has no fault */
    reply r = {.head = {.magic = REPLY_MAGIC}};
    check_refused(&r, "nonsense"); /* no root */
    put_object(&r, group(0), "/mesh", NULL);
    check_refused(&r, "nonsense");
}
END_TEST

START_TEST(lies_about_attributes_are_refused) {
    for (int lie = 0; lie < 5; lie++) {
        reply r = sound();
        put_object(&r, group(2), "/x", NULL);
        const uint64_t start = r.head.bytes;
        put_attribute(&r, ATTRIBUTE_TEXT, "b", "text", 0);
        attribute_record record;
        memcpy(&record, r.bytes + start, sizeof record);
        if (lie == 1) record.kind = ATTRIBUTE_OTHER + 1;
        if (lie == 2) record.text_bytes = UINT32_MAX;
        if (lie == 3) record.name_bytes = 1;          /* ends before its NUL */
        if (lie == 4) record.kind = ATTRIBUTE_NUMBER; /* which has no text */
        memcpy(r.bytes + start, &record, sizeof record);
        put_attribute(&r, ATTRIBUTE_TEXT, lie == 0 ? "b" : "c", "text", 0); /* twice the same name */
        check_refused(&r, "nonsense");
    }
}
END_TEST

/* Every byte set to several values: it is refused, or all that is found lies within the file and the reply.
 */
START_TEST(any_changed_byte_is_harmless) {
    const unsigned char values[] = {0, 1, 2, 0x2f, 0x7f, 0x80, 0xff};
    const reply right = sound();
    size_t taken = 0, refused = 0;
    for (size_t at = 0; at < sizeof right.head + right.head.bytes; at++)
        for (size_t k = 0; k < sizeof values; k++) {
            reply r = right;
            store_index index = {.bytes = NULL};
            ((unsigned char *)&r)[at] = values[k];
            if (r.head.bytes > MOST && r.head.bytes <= REPLY_MOST_BYTES)
                continue; /* ends before: receive says so */
            if (read_reply(&r, &index) != LAM_OK) {
                refused++;
                continue;
            }
            taken++;
            for (size_t i = 0; i < index.n_objects; i++) {
                const store_object *o = &index.objects[i];
                ck_assert(o->name >= index.bytes && o->name < index.bytes + r.head.bytes);
                ck_assert_uint_le(o->array.offset + o->array.bytes, FILE_SIZE);
                for (size_t a = 0; a < o->n_attributes; a++)
                    ck_assert(o->attributes[a].kind != ATTRIBUTE_TEXT ||
                              strlen(o->attributes[a].text) < MOST);
            }
            store_index_free(&index);
        }
    ck_assert_uint_gt(taken, 100);
    ck_assert_uint_gt(refused, 1000);
}
END_TEST

/* Cut anywhere, or with bytes behind its end. */
START_TEST(other_lengths_are_refused) {
    const reply right = sound();
    for (uint64_t bytes = 0; bytes < right.head.bytes; bytes++) {
        reply r = right;
        r.head.bytes = bytes;
        check_refused(&r, "nonsense");
    }
    reply r = right;
    put(&r, "", 1);
    check_refused(&r, "nonsense");
}
END_TEST

int main(void) {
    Suite *suite = suite_create("store index");
    TCase *tests = tcase_create("index");
    tcase_add_test(tests, what_was_sent_is_found);
    tcase_add_test(tests, lies_of_the_head_are_refused);
    tcase_add_test(tests, lies_about_arrays_are_refused);
    tcase_add_test(tests, lies_about_names_are_refused);
    tcase_add_test(tests, lies_about_attributes_are_refused);
    tcase_add_test(tests, any_changed_byte_is_harmless);
    tcase_add_test(tests, other_lengths_are_refused);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
