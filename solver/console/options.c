#include "solver/console/options.h"

#include <argp.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* argp takes printable keys for letters, so the rows' own keys begin above them. */
#define KEY_ROW 0x1000
#define KEY_HELP 0x2000

typedef struct parse_state {
    const option_verb *verb;
    void *fields;
    option_result *result;
    bool helped;
    bool told; /* one line was printed already */
} parse_state;

static void usage_line(const char *verb, const char *text) {
    fprintf(stderr, "lambert %s: %s\n", verb, text);
}

int options_usage(const char *verb, const char *format, ...) {
    lam_error error = {0};
    va_list arguments;
    char text[sizeof error.message];
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    status_fail(&error, LAM_ERR_ARGUMENT, "%s", text);
    usage_line(verb, error.message);
    return 2;
}

static lam_status bounds_check(const option_row *row, const char *what, const char *text, double value,
                               lam_error *error) {
    lam_status status = LAM_OK;
    if (row->low == 0 && row->high == 0 && !row->low_open) return LAM_OK;
    bool has_high = row->high > row->low;
    bool low_bad = row->low_open ? value <= row->low : value < row->low;
    bool high_bad = has_high && (row->high_open ? value >= row->high : value > row->high);
    if (!low_bad && !high_bad) return LAM_OK;
    if (has_high)
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: must be %s %.12g and %s %.12g", what, text,
             row->low_open ? "above" : "at least", row->low, row->high_open ? "below" : "at most", row->high);
    FAIL(error, LAM_ERR_ARGUMENT, "%s %s: must be %s %.12g", what, text, row->low_open ? "above" : "at least",
         row->low);
done:
    return status;
}

static lam_status choice_set(const option_row *row, const char *what, const char *text, const char **field,
                             lam_error *error) {
    lam_status status = LAM_OK;
    /* "reinhart:" among the later words stands for every value that begins so. */
    size_t prefix = strcspn(text, ":");
    char head[64] = "";
    if (text[prefix] == ':' && prefix + 1 < sizeof head) memcpy(head, text, prefix + 1);
    if (row->later != NULL && (option_among(text, row->later) || option_among(head, row->later)))
        FAIL(error, LAM_ERR_UNSUPPORTED, "%s %s is not supported yet", what, text);
    if (!option_among(text, row->choices)) {
        char words[160];
        snprintf(words, sizeof words, "%s", row->choices);
        for (char *c = words; *c != '\0'; c++)
            if (*c == '|') *c = ' ';
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: must be one of: %s", what, text, words);
    }
    *field = text;
done:
    return status;
}

static lam_status list_add(option_list *list, const char *what, const char *text, lam_error *error) {
    lam_status status = LAM_OK;
    if (list->count == OPTION_LIST_MAX)
        FAIL(error, LAM_ERR_ARGUMENT, "%s %s: given more than %d times", what, text, OPTION_LIST_MAX);
    list->items[list->count++] = text;
done:
    return status;
}

static lam_status row_set(const option_row *row, const char *text, void *fields, lam_error *error) {
    lam_status status = LAM_OK;
    void *field = (char *)fields + row->offset;
    char what[64];
    double number = 0;
    uint64_t count = 0;
    snprintf(what, sizeof what, "%s%s", strlen(row->name) == 1 ? "-" : "--", row->name);
    switch (row->kind) {
    case OPTION_FLAG:
        *(bool *)field = true;
        break;
    case OPTION_TEXT:
        if (text[0] == '\0') FAIL(error, LAM_ERR_ARGUMENT, "%s: needs a value that is not empty", what);
        *(const char **)field = text;
        break;
    case OPTION_LIST:
        TRY(list_add(field, what, text, error));
        break;
    case OPTION_NUMBER:
        TRY(option_number(what, text, &number, error));
        TRY(bounds_check(row, what, text, number, error));
        *(double *)field = number;
        break;
    case OPTION_COUNT_AUTO:
    case OPTION_COUNT:
        if (row->kind == OPTION_COUNT_AUTO && strcmp(text, "auto") == 0) {
            *(uint64_t *)field = OPTION_AUTO;
            break;
        }
        TRY(option_count(what, text, &count, error));
        TRY(bounds_check(row, what, text, (double)count, error));
        *(uint64_t *)field = count;
        break;
    case OPTION_SIZE:
        TRY(option_size(what, text, &count, error));
        *(uint64_t *)field = count;
        break;
    case OPTION_CHOICE:
        TRY(choice_set(row, what, text, field, error));
        break;
    case OPTION_OPTIONAL:
        if (text != NULL && row->later != NULL && option_among(text, row->later))
            FAIL(error, LAM_ERR_UNSUPPORTED, "%s=%s is not supported yet", what, text);
        if (text != NULL && !option_among(text, row->choices))
            FAIL(error, LAM_ERR_ARGUMENT, "%s=%s: no such value", what, text);
        *(const char **)field = text == NULL ? "" : text;
        break;
    case OPTION_CUSTOM:
        TRY(row->parse(text, field, error));
        break;
    case OPTION_LATER:
        FAIL(error, LAM_ERR_UNSUPPORTED, "%s is not supported yet", what);
    case OPTION_HEADING:
        break;
    }
done:
    return status;
}

static error_t parse_key(int key, char *text, struct argp_state *state) {
    parse_state *parse = state->input;
    const option_row *rows = parse->verb->options;
    if (key == ARGP_KEY_INIT) {
        /* getopt says what is wrong in one line; what argp would add goes nowhere. */
        state->err_stream = NULL;
        return 0;
    }
    if (key == KEY_HELP) {
        argp_state_help(state, stdout, ARGP_HELP_STD_HELP & ~(unsigned)ARGP_HELP_EXIT_OK);
        parse->helped = true;
        return ECANCELED;
    }
    if (key == ARGP_KEY_ARG) {
        if (parse->result->n_arguments == parse->verb->max_arguments) {
            options_usage(parse->verb->name, "%s: one argument too many; see lambert %s --help", text,
                          parse->verb->name);
            parse->told = true;
            return EINVAL;
        }
        parse->result->arguments[parse->result->n_arguments++] = text;
        return 0;
    }
    for (size_t i = 0; rows[i].name != NULL || rows[i].doc != NULL; i++) {
        if (rows[i].kind == OPTION_HEADING) continue;
        if (key != rows[i].letter && key != (int)(KEY_ROW + i)) continue;
        lam_error error = {0};
        if (row_set(&rows[i], text, parse->fields, &error) != LAM_OK) {
            usage_line(parse->verb->name, error.message);
            parse->told = true;
            return EINVAL;
        }
        parse->result->given |= UINT64_C(1) << i;
        return 0;
    }
    return ARGP_ERR_UNKNOWN;
}

/* One argp row per row of ours; rows between two headings form a group of --help. */
static void argp_rows(const option_row *rows, struct argp_option *out) {
    size_t i = 0;
    int group = 0;
    for (; (rows[i].name != NULL || rows[i].doc != NULL) && i < OPTIONS_MAX; i++) {
        bool letter_only = rows[i].name != NULL && strlen(rows[i].name) == 1;
        bool takes = rows[i].kind != OPTION_FLAG && rows[i].kind != OPTION_HEADING;
        if (rows[i].kind == OPTION_HEADING) group++;
        out[i] = (struct argp_option){
            .name = letter_only ? NULL : rows[i].name,
            .key = rows[i].kind == OPTION_HEADING ? 0
                   : rows[i].letter != 0          ? rows[i].letter
                                                  : (int)(KEY_ROW + i),
            .arg = takes ? rows[i].value : NULL,
            .flags = rows[i].kind == OPTION_OPTIONAL ? OPTION_ARG_OPTIONAL : 0,
            .doc = rows[i].doc,
            .group = group,
        };
    }
    out[i++] =
        (struct argp_option){.name = "help", .key = KEY_HELP, .doc = "Print this and stop", .group = -1};
    out[i] = (struct argp_option){0};
}

int options_parse(const option_verb *verb, int argc, char **argv, void *fields, option_result *result) {
    struct argp_option rows[OPTIONS_MAX + 2];
    char name[64];
    option_result parsed = {0};
    parse_state parse = {.verb = verb, .fields = fields, .result = &parsed};
    argp_rows(verb->options, rows);
    struct argp argp = {
        .options = rows, .parser = parse_key, .args_doc = verb->arguments, .doc = verb->summary};
    snprintf(name, sizeof name, "lambert %s", verb->name);
    argv[0] = name;
    error_t code = argp_parse(&argp, argc, argv, ARGP_NO_EXIT | ARGP_NO_HELP, NULL, &parse);
    if (parse.helped) return 0;
    if (code != 0) {
        if (code != EINVAL && !parse.told && code != ARGP_ERR_UNKNOWN)
            options_usage(verb->name, "%s", strerror(code));
        return 2;
    }
    if (parsed.n_arguments < verb->min_arguments)
        return options_usage(verb->name, "too few arguments; usage: lambert %s %s", verb->name,
                             verb->arguments);
    *result = parsed;
    return OPTIONS_GO;
}

bool options_given(const option_verb *verb, const option_result *result, const char *name) {
    for (size_t i = 0; verb->options[i].name != NULL || verb->options[i].doc != NULL; i++)
        if (verb->options[i].name != NULL && strcmp(verb->options[i].name, name) == 0)
            return (result->given >> i & 1) != 0;
    return false;
}
