#include "solver/base/options/options.h"

#include "solver/base/nearest.h"
#include "solver/base/options/option_text.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* The options of every command; --print-... are for installers and stand in no help. */
typedef struct common_fields {
    bool help, manual;
    const char *shell;
} common_fields;

static const option_row common_rows[] = {
    {.name = "help", .letter = 'h', .kind = OPTION_FLAG, .offset = offsetof(common_fields, help)},
    {.name = "print-manual", .kind = OPTION_FLAG, .offset = offsetof(common_fields, manual)},
    {.name = "print-completion",
     .kind = OPTION_CHOICE,
     .offset = offsetof(common_fields, shell),
     .choices = OPTION_SHELLS},
    {0},
};

typedef struct parser {
    const option_command *command;
    const option_table *tables[2]; /* the common ones and those of the command */
    option_result *result;
} parser;

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
    OPTIONS_EACH_ROW(tables, t, row) {
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

/* Fails with "--NAME: no such option", and names the nearest one. */
static lam_status no_such_option(const parser *p, const char *name, lam_error *error) {
    enum { MOST = 256 };
    const char *names[MOST];
    size_t n = 0;
    OPTIONS_EACH_ROW(p->tables[1], t, row)
    if (n < MOST) names[n++] = row->name;
    const char *nearest = nearest_word(name, n, names);
    if (nearest != NULL)
        return status_fail(error, LAM_ERR_ARGUMENT, "--%s: no such option; did you mean --%s?", name,
                           nearest);
    return status_fail(error, LAM_ERR_ARGUMENT, "--%s: no such option; see %s --help", name,
                       p->command->name);
}

/* Fails for an option, or a value of one, that the command has no longer. */
static lam_status check_gone(const parser *p, const char *word, size_t name_length, lam_error *error) {
    for (const option_gone *g = p->command->gone; g != NULL && g->word != NULL; g++)
        if (strcmp(g->word, word) == 0 ||
            (strlen(g->word) == name_length && strncmp(g->word, word, name_length) == 0))
            return status_fail(error, LAM_ERR_ARGUMENT, "--%s: was removed; %s", g->word, g->instead);
    return LAM_OK;
}

/* The row of a name, or of the only name that begins so and is in the help. */
static lam_status find_name(const parser *p, const char *name, const option_row **found, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t length = strlen(name);
    const option_row *longer = NULL, *other = NULL;
    for (size_t k = 0; k < 2; k++) OPTIONS_EACH_ROW(p->tables[k], t, row) {
            if (strcmp(row->name, name) == 0) {
                *found = row;
                return LAM_OK;
            }
            if (strncmp(row->name, name, length) != 0 || strncmp(row->name, "print-", 6) == 0) continue;
            if (longer == NULL)
                longer = row;
            else if (strcmp(longer->name, row->name) != 0)
                other = row;
        }
    if (other != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "--%s: ambiguous, may be --%s or --%s", name, longer->name,
             other->name);
    if (longer == NULL) TRY(no_such_option(p, name, error));
    *found = longer;
done:
    return status;
}

static lam_status find_letter(const parser *p, char letter, const option_row **found, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k < sizeof p->tables / sizeof *p->tables; k++) OPTIONS_EACH_ROW(p->tables[k], t, row) {
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
    for (size_t k = 0; k < 2; k++) OPTIONS_EACH_ROW(p->tables[k], t, row)
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
        char name[64];
        const size_t length = strcspn(word + 2, "=");
        snprintf(name, sizeof name, "%.*s", (int)length, word + 2);
        TRY(check_gone(p, word + 2, length, error));
        TRY(find_name(p, name, &row, error));
        if (word[2 + length] == '=') value = word + 2 + length + 1;
    } else {
        TRY(find_letter(p, word[1], &row, error));
        if (word[2] != '\0') value = word + 2;
    }
    if (!takes_value(row) && value != NULL) FAIL(error, LAM_ERR_ARGUMENT, "--%s: takes no value", row->name);
    if (takes_value(row) && !option_may_stand_alone(row) && value == NULL) {
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

/* Calls for each row of an option that was given; stops at the first result that is not OPTIONS_GO. */
static int for_given(const option_table *tables, const option_result *result,
                     int (*call)(const void *context, const option_row *row), const void *context) {
    for (const option_table *t = tables; t->rows != NULL; t++)
        for (const option_row *row = t->rows; row->name != NULL; row++) {
            const int code = options_given(result, row->name) ? call(context, row) : OPTIONS_GO;
            if (code != OPTIONS_GO) return code;
        }
    return OPTIONS_GO;
}

/* A command line that was read, and what is said of it. */
typedef struct read_line {
    const option_command *command;
    const option_result *result;
    const char *instead;
} read_line;

static int refuse_pair(const void *context, const option_row *row) {
    const read_line *line = context;
    for (size_t i = 0; row->not_with != NULL && i < line->result->n_given; i++)
        if (option_among(line->result->given[i], row->not_with))
            return options_usage(line->command->name, "--%s and --%s exclude each other: give one of the two",
                                 row->name, line->result->given[i]);
    return OPTIONS_GO;
}

static int refuse_settled(const void *context, const option_row *row) {
    const read_line *line = context;
    if (row->settled == NULL) return OPTIONS_GO;
    return options_usage(line->command->name, "--%s: %s; %s", row->name, row->settled, line->instead);
}

int options_refuse_settled(const option_command *command, const option_table *tables,
                           const option_result *result, const char *instead) {
    const read_line line = {command, result, instead};
    return for_given(tables, result, refuse_settled, &line);
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
    if (common.help) option_text_help(command, tables);
    if (common.manual) option_text_manual(command, tables);
    if (common.shell != NULL) option_text_completion(common.shell, command, tables);
    if (common.help || common.manual || common.shell != NULL) return 0;
    if (status != LAM_OK) return options_usage(command->name, "%s", error.message);
    if (parsed.n_arguments < command->least_arguments)
        return options_usage(command->name, "too few arguments; usage: %s %s", command->name,
                             command->arguments);
    const read_line line = {command, &parsed, NULL};
    const int code = for_given(tables, &parsed, refuse_pair, &line);
    if (code == OPTIONS_GO) *result = parsed;
    return code;
}

static const option_verb *find_verb(const option_verb *verbs, const char *name) {
    while (verbs->name != NULL && strcmp(verbs->name, name) != 0) verbs++;
    return verbs->name != NULL ? verbs : NULL;
}

static int no_such_verb(const option_command *program, const option_verb *verbs, const char *word) {
    const char *names[64] = {"help"};
    char advice[512];
    size_t n = 1;
    for (; verbs->name != NULL && n < sizeof names / sizeof *names; verbs++) names[n++] = verbs->name;
    nearest_advice(word, n, names, advice, sizeof advice);
    return options_usage(program->name, "%.40s: no such verb; %s", word, advice);
}

/* Has every verb print its part of a text. */
static void print_verbs(const option_verb *verbs, char *option) {
    for (; verbs->name != NULL; verbs++) {
        char name[64];
        char *argv[] = {name, option, NULL};
        snprintf(name, sizeof name, "%s", verbs->name);
        verbs->run(2, argv);
    }
}

/* The answer to an option of the whole program. */
static int program_option(const option_command *program, const option_verb *verbs, char *option) {
    static const char completion[] = "--print-completion=";
    const char *shell = option + sizeof completion - 1;
    if (strcmp(option, "--help") == 0 || strcmp(option, "-h") == 0) {
        option_text_help_verbs(program, verbs);
    } else if (strcmp(option, "--version") == 0) {
        printf("%s " LAMBERT_VERSION "\n", program->name);
    } else if (strcmp(option, "--print-manual") == 0) {
        option_text_manual_begin(program, verbs);
        print_verbs(verbs, option);
        option_text_manual_end(program);
    } else if (strncmp(option, completion, sizeof completion - 1) == 0 &&
               option_among(shell, OPTION_SHELLS)) {
        option_text_completion_begin(shell, program);
        print_verbs(verbs, option);
        option_text_completion_end(shell, program, verbs);
    } else {
        return options_usage(program->name, "%s: no such option; see %s --help", option, program->name);
    }
    return 0;
}

int options_run_verb(const option_command *program, const option_verb *verbs, int argc, char **argv) {
    static char help[] = "--help";
    if (argc < 2) return options_usage(program->name, "no verb given; see %s --help", program->name);
    if (argv[1][0] == '-') return program_option(program, verbs, argv[1]);
    const bool asks_help = strcmp(argv[1], "help") == 0;
    if (asks_help && argc == 2) return program_option(program, verbs, help);
    char *name = asks_help ? argv[2] : argv[1];
    const option_verb *verb = find_verb(verbs, name);
    if (verb == NULL) return no_such_verb(program, verbs, name);
    if (asks_help) return verb->run(2, (char *[]){name, help, NULL});
    return verb->run(argc - 1, argv + 1);
}
