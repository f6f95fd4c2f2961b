/* GET /v1/scenes/NAME/elements: the elements of a scene as columns of numbers. */
#include "server/route/element_table.h"
#include "server/route/kept_answer.h"

#include <string.h>

/* Seconds to read, write and compress a byte of an answer, roughly. */
#define PER_BYTE 20e-9

/* Elements of an answer in JSON. */
#define JSON_ELEMENTS_MOST ((size_t)65536)

/* "area, normal, ...", for messages. */
#define NAMES_ROOM 80
static void name_fields(char names[NAMES_ROOM]) {
    char *at = names;
    for (element_field f = 0; f < ELEMENT_FIELDS; f++)
        at = stpcpy(stpcpy(at, f > 0 ? ", " : ""), element_field_name(f));
}

/* The field of a name; ELEMENT_FIELDS: there is none. */
static element_field find_field(const char *name, size_t length) {
    element_field f = 0;
    while (f < ELEMENT_FIELDS &&
           !(strlen(element_field_name(f)) == length && memcmp(element_field_name(f), name, length) == 0))
        f++;
    return f;
}

/* Reads area,normal,... in any order, each once. */
static bool read_fields(const char *text, unsigned *fields, problem *why) {
    char names[NAMES_ROOM];
    name_fields(names);
    *fields = 0;
    if (*text == '\0')
        return problem_set(why, PROBLEM_WRONG_LENGTH, "fields is empty, must list some of %s", names);
    for (size_t k = 0;; k++) {
        const size_t length = strcspn(text, ",");
        const element_field field = find_field(text, length);
        const int shown = length < 60 ? (int)length : 60;
        if (field == ELEMENT_FIELDS)
            return problem_set(why, PROBLEM_UNKNOWN_WORD, "fields[%zu] is \"%.*s\", must be one of %s", k,
                               shown, text, names);
        if (*fields & FIELD_BIT(field))
            return problem_set(why, PROBLEM_GIVEN_TWICE, "fields[%zu] gives \"%.*s\" a second time", k, shown,
                               text);
        *fields |= FIELD_BIT(field);
        if (text[length] == '\0') return true;
        text += length + 1;
    }
}

/* Reads the query: ?fields=LIST or nothing. */
static bool read_query(const call *in, unsigned *fields, problem *why) {
    const char *list = NULL;
    for (size_t k = 0; k < in->n_query; k++) {
        if (strcmp(in->query[k].name, "fields") != 0)
            return problem_set(why, PROBLEM_WRONG_MEMBERS, "the query has \"%.60s\", may have fields alone",
                               in->query[k].name);
        if (list != NULL) return problem_set(why, PROBLEM_GIVEN_TWICE, "the query has fields a second time");
        list = in->query[k].value;
    }
    *fields = ALL_FIELDS;
    return list == NULL || read_fields(list, fields, why);
}

/* Sets the table that a request asks for, without its columns. */
static bool read_question(const call *in, element_table *asked, problem *why) {
    *asked = (element_table){.of = in->scene, .encoding = in->accept.type};
    const scene *s = in->scene;
    if (!read_query(in, &asked->fields, why)) return false;
    const bool several = (asked->fields & (asked->fields - 1)) != 0;
    if (asked->encoding == MEDIA_JSON && s->n > JSON_ELEMENTS_MOST)
        return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                           "%zu elements, in JSON there may be %zu; accept application/zip, or "
                           "application/x-npy with one field",
                           s->n, JSON_ELEMENTS_MOST);
    if (asked->encoding == MEDIA_NPY && in->accept.npy_given)
        return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                           "each field has its own type in application/x-npy; leave dtype out of Accept");
    if (asked->encoding == MEDIA_NPY && several) {
        char names[NAMES_ROOM];
        name_fields(names);
        return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                           "application/x-npy holds one field; ask for one of %s by ?fields=, or accept "
                           "application/zip",
                           names);
    }
    if (asked->encoding == MEDIA_ZIP && element_table_bytes_most(asked) > ZIP_BYTES_MOST)
        return problem_set(why, PROBLEM_NOT_IN_ENCODING,
                           "%zu elements take more than 4 GiB; ask for fewer fields, or accept "
                           "application/x-npy with one",
                           s->n);
    return true;
}

static bool build(const call *in, buffer *out, problem *why) {
    const scene *s = in->scene;
    element_table table;
    lam_error error;
    if (!read_question(in, &table, why)) return false;
    const lam_status status = scene_elements_read(s->elements, table.fields, &table.columns, &error);
    bool good = status == LAM_OK || call_refuse_store(s, status, &error, why);
    if (good && !element_table_write(&table, out))
        good = problem_set(why, PROBLEM_NO_MEMORY, "not enough memory for elements");
    element_columns_free(&table.columns);
    return good;
}

bool keeps_elements(const call *in, kept_source *from, answer *out) {
    static const char *const types[] = {[MEDIA_JSON] = "application/json",
                                        [MEDIA_NPY] = "application/x-npy",
                                        [MEDIA_ZIP] = "application/zip"};
    scene_elements *elements = in->scene->elements;
    element_table asked;
    problem why;
    if (!read_question(in, &asked, &why)) {
        answer_problem(out, &why);
        return false;
    }
    const unsigned which = asked.fields | (unsigned)asked.encoding << ELEMENT_FIELDS;
    const size_t most = element_table_bytes_most(&asked);
    kept_forms *forms = scene_elements_forms(elements, which);
    if (forms == NULL) {
        answer_refuse(out, PROBLEM_NO_MEMORY, "not enough memory for elements");
        return false;
    }
    *from = (kept_source){.forms = forms,
                          .type = types[asked.encoding],
                          .what = "elements",
                          .by_type = true,
                          .tag = scene_elements_tag(elements, which),
                          .cost = PER_BYTE * (double)most,
                          .build = build,
                          .build_bytes = bytes_plus(scene_elements_read_bytes(elements, asked.fields), most),
                          .most = most};
    return true;
}
