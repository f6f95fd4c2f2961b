/* Explains the tables of options: --help. */
#include "solver/base/options.h"

#include <stdio.h>
#include <string.h>

enum { WIDTH = 80, COLUMN = 29, LINE_MOST = 512 };

/* Prints words from column `at` on, the lines after the first from column `from` on. */
static void print_wrapped(const char *text, size_t at, size_t from) {
    for (bool first = true; *text != '\0'; first = false) {
        const size_t space = first ? 0 : 1, length = strcspn(text, " ");
        if (!first && at + space + length > WIDTH) {
            printf("\n%*s", (int)from, "");
            at = from;
        } else if (!first) {
            putchar(' ');
            at++;
        }
        printf("%.*s", (int)length, text);
        at += length;
        text += length + strspn(text + length, " ");
    }
    putchar('\n');
}

/* The value's name: "N", or the words of a choice. */
static const char *argument_of(const option_row *row) {
    return row->argument != NULL ? row->argument : row->choices;
}

static void row_signature(const option_row *row, char out[LINE_MOST]) {
    char letter[8] = "    ";
    if (row->letter != 0) snprintf(letter, sizeof letter, "-%c, ", row->letter);
    snprintf(out, LINE_MOST, "  %s--%s%s%s%s", letter, row->name,
             row->kind == OPTION_FLAG       ? ""
             : row->kind == OPTION_OPTIONAL ? "[="
                                            : "=",
             row->kind == OPTION_FLAG ? "" : argument_of(row), row->kind == OPTION_OPTIONAL ? "]" : "");
}

/* The help of a row, then its preset and unit in brackets. */
static void row_text(const option_row *row, char out[LINE_MOST * 2]) {
    const char *unit = row->unit != NULL ? row->unit : "";
    int length = snprintf(out, LINE_MOST * 2, "%s", row->help);
    if (row->preset != NULL)
        snprintf(out + length, LINE_MOST * 2 - (size_t)length, " (preset %s%s%s)", row->preset,
                 *unit != '\0' ? " " : "", unit);
    else if (row->otherwise != NULL)
        snprintf(out + length, LINE_MOST * 2 - (size_t)length, " (preset: %s)", row->otherwise);
}

static void print_row(const option_row *row) {
    char left[LINE_MOST], right[LINE_MOST * 2];
    row_signature(row, left);
    row_text(row, right);
    if (strlen(left) + 2 > COLUMN)
        printf("%s\n%*s", left, COLUMN, "");
    else
        printf("%-*s", COLUMN, left);
    print_wrapped(right, COLUMN, COLUMN);
}

void options_help(const option_command *command, const option_table *tables) {
    static const option_row help = {.name = "help", .kind = OPTION_FLAG, .help = "Print this and stop"};
    char usage[LINE_MOST];
    snprintf(usage, sizeof usage, "Usage: %s [OPTION...] %s", command->name, command->arguments);
    print_wrapped(usage, 0, 4);
    print_wrapped(command->summary, 0, 0);
    for (const option_table *t = tables; t->rows != NULL; t++) {
        putchar('\n');
        if (t->heading != NULL) {
            putchar(' ');
            print_wrapped(t->heading, 1, 1);
        }
        for (const option_row *row = t->rows; row->name != NULL; row++) print_row(row);
    }
    putchar('\n');
    print_row(&help);
    if (command->notes == NULL) return;
    putchar('\n');
    print_wrapped(command->notes, 0, 0);
}
