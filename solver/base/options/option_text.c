#include "solver/base/options/option_text.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

enum { WIDTH = 80, COLUMN = 29, TEXT_MOST = 1024 };

const option_row option_help_row = {
    .name = "help", .letter = 'h', .kind = OPTION_FLAG, .help = "Print this and stop"};

bool option_is_first(const option_table *tables, const option_row *row) {
    if (row->help == NULL) return false;
    OPTIONS_EACH_ROW(tables, t, other) {
        if (other == row) return true;
        if (other->help != NULL && strcmp(other->name, row->name) == 0) return false;
    }
    return true;
}

const char *option_argument(const option_row *row) {
    if (row->kind == OPTION_FLAG) return NULL;
    return row->argument != NULL ? row->argument : row->choices;
}

bool option_is_verb(const option_command *command) {
    return strchr(command->name, ' ') != NULL;
}

/* Prints words from column `at` on, further lines from column `from` on. A newline ends a line. */
static void print_wrapped(const char *text, size_t at, size_t from) {
    for (bool first = true; *text != '\0'; first = false) {
        const bool broken = *text == '\n';
        text += strspn(text, " \n");
        const size_t length = strcspn(text, " \n");
        if (broken || (!first && at + 1 + length > WIDTH)) {
            printf("\n%*s", (int)from, "");
            at = from;
        } else if (!first) {
            putchar(' ');
            at++;
        }
        printf("%.*s", (int)length, text);
        at += length;
        text += length;
    }
    putchar('\n');
}

/* "-o, --output=FILE"; a value that may be left out is in brackets. */
static void option_signature(const option_row *row, char out[TEXT_MOST]) {
    const char *argument = option_argument(row);
    char letter[8] = "";
    if (row->letter != 0) snprintf(letter, sizeof letter, "-%c, ", row->letter);
    if (argument == NULL)
        snprintf(out, TEXT_MOST, "%s--%s", letter, row->name);
    else if (option_may_stand_alone(row))
        snprintf(out, TEXT_MOST, "%s--%s[=%s]", letter, row->name, argument);
    else
        snprintf(out, TEXT_MOST, "%s--%s=%s", letter, row->name, argument);
}

/* "above 0, at most 1", or nothing. */
static void option_limits(const option_row *row, char out[TEXT_MOST]) {
    char most[64] = "";
    out[0] = '\0';
    if (row->kind == OPTION_SIZE || (row->least == 0 && row->most == 0 && !row->above)) return;
    if (row->most > row->least)
        snprintf(most, sizeof most, ", %s %.12g", row->below ? "below" : "at most", row->most);
    snprintf(out, TEXT_MOST, "%s %.12g%s", row->above ? "above" : "at least", row->least, most);
}

/* "not with --rays, --sky", or nothing. */
static void option_exclusions(const option_row *row, char out[TEXT_MOST]) {
    size_t used = 0;
    out[0] = '\0';
    for (const char *word = row->not_with; word != NULL && *word != '\0';) {
        const size_t length = strcspn(word, "|");
        used += (size_t)snprintf(out + used, TEXT_MOST - used, "%s--%.*s", used == 0 ? "not with " : ", ",
                                 (int)length, word);
        word += length + (word[length] == '|');
    }
}

/* Puts into out the help of a row and, in brackets, its preset with its unit, where wanted its limits, and
 * the options that it excludes. */
static void option_explanation(const option_row *row, bool with_limits, char out[TEXT_MOST]) {
    char preset[TEXT_MOST] = "", limits[TEXT_MOST] = "", others[TEXT_MOST];
    if (row->preset != NULL)
        snprintf(preset, sizeof preset, "preset %s%s%s", row->preset, row->unit != NULL ? " " : "",
                 row->unit != NULL ? row->unit : "");
    else if (row->otherwise != NULL)
        snprintf(preset, sizeof preset, "preset: %s", row->otherwise);
    if (with_limits) option_limits(row, limits);
    option_exclusions(row, others);
    const char *const parts[] = {preset, limits, others};
    size_t used = (size_t)snprintf(out, TEXT_MOST, "%s", row->help);
    bool open = false;
    for (size_t k = 0; k < sizeof parts / sizeof *parts && used < TEXT_MOST; k++) {
        if (*parts[k] == '\0') continue;
        used += (size_t)snprintf(out + used, TEXT_MOST - used, "%s%.256s", open ? "; " : " (", parts[k]);
        open = true;
    }
    if (open && used < TEXT_MOST) snprintf(out + used, TEXT_MOST - used, ")");
}

/* A signature that is too long for its column has a line of its own. */
static void help_row(const option_row *row) {
    char left[TEXT_MOST], right[TEXT_MOST];
    option_signature(row, left);
    option_explanation(row, false, right);
    const int indent = row->letter != 0 ? 2 : 6;
    if (indent + strlen(left) + 2 > COLUMN)
        printf("%*s%s\n%*s", indent, "", left, COLUMN, "");
    else
        printf("%*s%-*s", indent, "", COLUMN - indent, left);
    print_wrapped(right, COLUMN, COLUMN);
}

/* "lambert solve [OPTION...] STORE", "lambert VERB [OPTION...]". */
static void option_usage(const option_command *command, bool has_options, char out[TEXT_MOST]) {
    snprintf(out, TEXT_MOST, "%s %s%s", command->name, has_options ? "[OPTION...] " : "", command->arguments);
}

static void help_begin(const option_command *command, bool has_options) {
    char usage[TEXT_MOST];
    option_usage(command, has_options, usage);
    fputs("Usage: ", stdout);
    print_wrapped(usage, 7, 4);
    print_wrapped(command->summary, 0, 0);
}

static void help_end(const option_command *command) {
    help_row(&option_help_row);
    if (command->notes == NULL) return;
    putchar('\n');
    print_wrapped(command->notes, 0, 0);
}

/* True if some row of a table is explained here and not in another table. */
static bool has_help(const option_table *tables, const option_table *t) {
    for (const option_row *row = t->rows; row->name != NULL; row++)
        if (option_is_first(tables, row)) return true;
    return false;
}

void option_text_help(const option_command *command, const option_table *tables) {
    help_begin(command, true);
    for (const option_table *t = tables; t->rows != NULL; t++) {
        if (!has_help(tables, t)) continue;
        if (t->heading == NULL || *t->heading != '\0') putchar('\n');
        if (t->heading != NULL && *t->heading != '\0') {
            putchar(' ');
            print_wrapped(t->heading, 1, 1);
        }
        for (const option_row *row = t->rows; row->name != NULL; row++)
            if (option_is_first(tables, row)) help_row(row);
    }
    putchar('\n');
    help_end(command);
}

void option_text_help_verbs(const option_command *program, const option_verb *verbs) {
    static const option_row version = {
        .name = "version", .kind = OPTION_FLAG, .help = "Print the version and stop"};
    help_begin(program, false);
    putchar('\n');
    for (; verbs->name != NULL; verbs++) printf("  %-12s%s\n", verbs->name, verbs->summary);
    putchar('\n');
    help_row(&version);
    help_end(program);
}

/* Text of a roff line: no character is taken for a request, and a dash can be copied into a shell. */
static void roff(const char *text) {
    if (*text == '.' || *text == '\'') fputs("\\&", stdout);
    for (; *text != '\0'; text++) {
        if (*text == '\\')
            fputs("\\e", stdout);
        else if (*text == '-')
            fputs("\\-", stdout);
        else if (*text == '\n')
            fputs("\n.PP\n", stdout);
        else
            putchar(*text);
    }
    putchar('\n');
}

static void roff_request(const char *request, const char *text) {
    printf(".%s ", request);
    roff(text);
}

static void roff_item(const char *label, const char *text) {
    puts(".TP");
    roff_request("B", label);
    roff(text);
}

static void manual_begin(const option_command *command) {
    char upper[64];
    snprintf(upper, sizeof upper, "%s", command->name);
    for (char *c = upper; *c != '\0'; c++) *c = (char)toupper((unsigned char)*c);
    printf(".TH %s 1 \"\" \"lambert %s\" \"User commands\"\n.SH NAME\n", upper, LAMBERT_VERSION);
    printf("%s \\- ", command->name);
    roff(command->summary);
    puts(".SH SYNOPSIS");
}

static void manual_usage(const option_command *command, bool has_options) {
    char usage[TEXT_MOST];
    option_usage(command, has_options, usage);
    roff_request("B", usage);
}

static void manual_tables(const option_table *tables) {
    char label[TEXT_MOST], text[TEXT_MOST];
    for (const option_table *t = tables; t->rows != NULL; t++) {
        if (!has_help(tables, t)) continue;
        if (t->heading != NULL && *t->heading != '\0') roff_request("SS", t->heading);
        for (const option_row *row = t->rows; row->name != NULL; row++) {
            if (!option_is_first(tables, row)) continue;
            option_signature(row, label);
            option_explanation(row, true, text);
            roff_item(label, text);
        }
    }
}

void option_text_manual(const option_command *command, const option_table *tables) {
    if (option_is_verb(command)) {
        roff_request("SH", command->name);
        manual_usage(command, true);
        puts(".PP");
        roff(command->summary);
    } else {
        manual_begin(command);
        manual_usage(command, true);
        puts(".SH OPTIONS");
    }
    manual_tables(tables);
    if (command->notes == NULL) return;
    puts(option_is_verb(command) ? ".PP" : ".SH NOTES");
    roff(command->notes);
}

void option_text_manual_begin(const option_command *program, const option_verb *verbs) {
    manual_begin(program);
    manual_usage(program, false);
    puts(".SH VERBS");
    for (; verbs->name != NULL; verbs++) roff_item(verbs->name, verbs->summary);
}

void option_text_manual_end(const option_command *program) {
    puts(".SH NOTES");
    roff(program->notes);
}
