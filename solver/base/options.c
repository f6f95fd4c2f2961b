#include "solver/base/options.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* The options of every program. */
typedef struct common_fields {
    bool help;
} common_fields;

static const option_row common_rows[] = {
    {.name = "help", .kind = OPTION_FLAG, .offset = offsetof(common_fields, help)},
    {0},
};

typedef struct parser {
    const option_command *command;
    const option_table *tables[2]; /* the common ones and the program's */
    option_result *result;
} parser;

/* All rows of a list of tables. */
#define EACH_ROW(tables, t, row)                                                                             \
    for (const option_table *t = (tables); t->rows != NULL; t++)                                             \
        for (const option_row *row = t->rows; row->name != NULL; row++)

int options_usage(const char *name, const char *format, ...) {
    lam_error error = {0};
    va_list arguments;
    char text[sizeof error.message];
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    status_fail(&error, LAM_ERR_ARGUMENT, "%s", text);
    fprintf(stderr, "%s: %s\n", name, error.message);
    return 2;
}

bool options_given(const option_result *result, const char *name) {
    for (size_t i = 0; i < result->n_given; i++)
        if (strcmp(result->given[i], name) == 0) return true;
    return false;
}

static void take_presets(const option_table *tables) {
    EACH_ROW(tables, t, row) {
        lam_error error = {0};
        if (row->preset == NULL) continue;
        const lam_status status = option_read(row, row->preset, (char *)t->fields + row->offset, &error);
        assert(status == LAM_OK);
        (void)status;
    }
}

static bool takes_value(const option_row *row) {
    return row->kind != OPTION_FLAG;
}

/* The row of a name, or of the only name that begins so. */
static lam_status find_name(const parser *p, const char *name, size_t length, const option_row **found,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const option_row *longer = NULL, *other = NULL;
    for (size_t k = 0; k < 2; k++) EACH_ROW(p->tables[k], t, row) {
            if (strncmp(row->name, name, length) != 0) continue;
            if (row->name[length] == '\0') {
                *found = row;
                return LAM_OK;
            }
            if (longer == NULL)
                longer = row;
            else if (strcmp(longer->name, row->name) != 0)
                other = row;
        }
    if (other != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "--%.*s: ambiguous, may be --%s or --%s", (int)length, name,
             longer->name, other->name);
    if (longer == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "--%.*s: no such option; see %s --help", (int)length, name,
             p->command->name);
    *found = longer;
done:
    return status;
}

static lam_status find_letter(const parser *p, char letter, const option_row **found, lam_error *error) {
    lam_status status = LAM_OK;
    EACH_ROW(p->tables[1], t, row) {
        if (row->letter != letter) continue;
        *found = row;
        return LAM_OK;
    }
    FAIL(error, LAM_ERR_ARGUMENT, "-%c: no such option; see %s --help", letter, p->command->name);
done:
    return status;
}

/* Gives a value to every row of this name. */
static lam_status set_value(const parser *p, const char *name, const char *value, lam_error *error) {
    lam_status status = LAM_OK;
    option_result *result = p->result;
    for (size_t k = 0; k < 2; k++) EACH_ROW(p->tables[k], t, row)
    if (strcmp(row->name, name) == 0) TRY(option_read(row, value, (char *)t->fields + row->offset, error));
    if (!options_given(result, name)) {
        assert(result->n_given < OPTIONS_GIVEN_MAX);
        result->given[result->n_given++] = name;
    }
done:
    return status;
}

/* Reads the option in argv[*i], and argv[*i + 1] where that is its value. */
static lam_status parse_option(const parser *p, int argc, char **argv, int *i, lam_error *error) {
    lam_status status = LAM_OK;
    const char *word = argv[*i], *value = NULL;
    const option_row *row = NULL;
    if (word[1] == '-') {
        const size_t length = strcspn(word + 2, "=");
        TRY(find_name(p, word + 2, length, &row, error));
        if (word[2 + length] == '=') value = word + 2 + length + 1;
    } else {
        TRY(find_letter(p, word[1], &row, error));
        if (word[2] != '\0') value = word + 2;
    }
    if (!takes_value(row) && value != NULL) FAIL(error, LAM_ERR_ARGUMENT, "--%s: takes no value", row->name);
    if (takes_value(row) && row->kind != OPTION_OPTIONAL && value == NULL) {
        if (*i + 1 == argc) FAIL(error, LAM_ERR_ARGUMENT, "--%s: needs a value", row->name);
        value = argv[++*i];
    }
    TRY(set_value(p, row->name, value, error));
done:
    return status;
}

static lam_status parse_all(const parser *p, int argc, char **argv, lam_error *error) {
    lam_status status = LAM_OK;
    option_result *result = p->result;
    bool only_arguments = false;
    for (int i = 1; i < argc; i++) {
        if (only_arguments || argv[i][0] != '-' || argv[i][1] == '\0') {
            if (result->n_arguments == p->command->most_arguments)
                FAIL(error, LAM_ERR_ARGUMENT, "%s: one argument too many; see %s --help", argv[i],
                     p->command->name);
            result->arguments[result->n_arguments++] = argv[i];
        } else if (strcmp(argv[i], "--") == 0) {
            only_arguments = true;
        } else {
            TRY(parse_option(p, argc, argv, &i, error));
        }
    }
done:
    return status;
}

int options_parse(const option_command *command, const option_table *tables, int argc, char **argv,
                  option_result *result) {
    common_fields common = {0};
    const option_table common_tables[] = {{NULL, common_rows, &common}, {0}};
    option_result parsed = {.arguments = argv + 1};
    lam_error error = {0};
    const parser p = {.command = command, .tables = {common_tables, tables}, .result = &parsed};
    take_presets(tables);
    const lam_status status = parse_all(&p, argc, argv, &error);
    if (common.help) {
        options_help(command, tables);
        return 0;
    }
    if (status != LAM_OK) return options_usage(command->name, "%s", error.message);
    if (parsed.n_arguments < command->least_arguments)
        return options_usage(command->name, "too few arguments; usage: %s %s", command->name,
                             command->arguments);
    *result = parsed;
    return OPTIONS_GO;
}
